from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pbrdf.errors import InputError
from pbrdf.optics.elements import IDEAL
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.settings.checked import read_checked
from pbrdf.settings.plan import (
    CapturePlan,
    Light,
    Metering,
    bright_state,
    brightest_states,
    capture_plan,
    light_id,
)
from pbrdf.settings.rig import read_rig
from pbrdf.settings.targets import session_plans

SOURCE = Path(__file__).resolve().parents[2] / "config/rig/virtual.yaml"

RIG: dict[str, Any] = {"filters_nm": [450, 550, 650], "arm": {"radius_mm": 800, "limits_deg": [5, 175]}}
PLAN: dict[str, Any] = {
    "lights_deg": [8, 41, 170],
    "bands_nm": [450, 650],
    "states": {"count": 36, "step_deg": 5, "ratio": 5},
    "exposures_ms": [5, 80],
    "darks": 3,
    "references": 0,
}
METERED = {"shortest": 0.1, "longest": 800, "count": 3, "ratio": 8}


def _refusal(**changes: Any) -> InputError:
    with pytest.raises(InputError) as refused:
        capture_plan(PLAN | changes, RIG, "config.yaml")
    assert refused.value.source == "config.yaml"
    return refused.value


def test_the_states_are_those_of_the_published_measurements() -> None:
    """Analyser's retarder at θ, generator's at 5 θ, crossed polarisers (Baek et al. 2020)."""
    states = capture_plan(PLAN, RIG, "config.yaml").states_deg
    assert len(states) == 36
    for n, state in enumerate(states):
        theta = 5.0 * n
        assert state == (0.0, (5.0 * theta) % 360.0, theta, 90.0)
    assert states[35] == (0.0, 155.0, 175.0, 90.0)


def test_states_may_be_any_list() -> None:
    listed = [[0, 1.5 * n, 2 * n, 90] for n in range(20)]
    states = capture_plan(PLAN | {"states": listed}, RIG, "config.yaml").states_deg
    assert states == tuple(tuple(map(float, state)) for state in listed)


def test_times_become_seconds_and_frames_are_counted() -> None:
    plan = capture_plan(PLAN, RIG, "config.yaml")
    assert plan.exposures_s == pytest.approx((0.005, 0.08), rel=1e-15)
    assert plan.frames_per_light() == (2 * 36 + 3) * 2


@pytest.mark.parametrize(
    ("angle", "name"), [(8, "008.00"), (41.125, "041.12"), (0.0, "000.00"), (-0.0, "000.00"), (360, "360.00")]
)
def test_a_light_is_called_by_its_angle(angle: float, name: str) -> None:
    assert light_id(angle) == name


def test_a_light_keeps_its_name_whatever_else_is_planned() -> None:
    few = capture_plan(PLAN, RIG, "config.yaml").lights
    many = capture_plan(PLAN | {"lights_deg": [8, 20, 41, 60, 170]}, RIG, "config.yaml").lights
    assert set(few) < set(many)
    assert few[1] == Light("041.00", 41.0)


def test_lights_may_be_told_by_their_ends() -> None:
    spec = {"first": 8, "last": 170, "count": 28}
    lights = capture_plan(PLAN | {"lights_deg": spec}, RIG, "config.yaml").lights
    assert [light.angle_deg for light in lights] == [8.0 + 6.0 * n for n in range(28)]


@pytest.mark.parametrize(("angle", "limit"), [(4.99, "4.99°"), (175.01, "175.01°")])
def test_an_angle_beyond_the_arms_limits_is_refused(angle: float, limit: str) -> None:
    refused = _refusal(lights_deg=sorted([30, angle]))
    assert refused.field == "plan.lights_deg"
    assert limit in refused.problem
    assert refused.remedy == "stay in 5…175°"


def test_the_limits_themselves_are_reached() -> None:
    lights = capture_plan(PLAN | {"lights_deg": [5, 175]}, RIG, "config.yaml").lights
    assert [light.id for light in lights] == ["005.00", "175.00"]


def test_a_band_without_filter_is_refused() -> None:
    refused = _refusal(bands_nm=[450, 500])
    assert refused.field == "plan.bands_nm"
    assert refused.problem == "no filter passes 500 nm"
    assert refused.remedy == "the wheel has 450, 550, 650 nm"


@pytest.mark.parametrize(
    ("field", "values"),
    [
        ("lights_deg", [41, 8]),
        ("lights_deg", [8, 8]),
        ("lights_deg", [8, 8.001]),
        ("lights_deg", {"first": 170, "last": 8, "count": 3}),
        ("bands_nm", [650, 450]),
        ("bands_nm", [450, 450]),
        ("exposures_ms", [80, 5]),
        ("exposures_ms", [5, 5]),
    ],
)
def test_what_does_not_ascend_is_refused(field: str, values: Any) -> None:
    refused = _refusal(**{field: values})
    assert refused.field == f"plan.{field}"
    assert refused.problem == "does not ascend strictly"


def test_equal_plans_have_one_plain_form_however_their_numbers_are_written() -> None:
    whole = {"states": [[0, n, 2 * n, 90] for n in range(16)], "lights_deg": [8, 41], "exposures_ms": [5, 80]}
    pointed = {
        "states": [[0.0, float(n), 2.0 * n, 90.0] for n in range(16)],
        "lights_deg": [8.0, 41.0],
        "exposures_ms": [5.0, 80.0],
    }
    one, other = (capture_plan(PLAN | changes, RIG, "config.yaml") for changes in (whole, pointed))
    assert one == other
    assert json.dumps(one.plain()) == json.dumps(other.plain())


@pytest.mark.parametrize(
    "changes",
    [
        {"lights_deg": [8, 42, 170]},
        {"bands_nm": [450, 550]},
        {"states": {"count": 36, "step_deg": 5, "ratio": 4}},
        {"exposures_ms": [5, 81]},
        {"exposures_ms": {"shortest": 5, "longest": 80, "count": 2, "ratio": 16}},
        {"darks": 4},
        {"references": 3},
    ],
)
def test_other_plans_have_another_plain_form(changes: dict[str, Any]) -> None:
    assert capture_plan(PLAN, RIG, "c").plain() != capture_plan(PLAN | changes, RIG, "c").plain()


@pytest.mark.parametrize("exposures", [[5, 80], METERED])
def test_plain_form_is_json_and_loses_nothing(exposures: Any) -> None:
    plan = capture_plan(PLAN | {"references": 3, "exposures_ms": exposures}, RIG, "config.yaml")
    assert CapturePlan.from_plain(json.loads(json.dumps(plan.plain()))) == plan


def test_a_metered_plan_tells_the_longest_exposures_that_may_come() -> None:
    plan = capture_plan(PLAN | {"exposures_ms": METERED}, RIG, "config.yaml")
    assert plan.exposures_s == pytest.approx((0.0125, 0.1, 0.8), rel=1e-15)
    assert plan.metering == Metering(shortest_s=0.0001, fill=0.8)
    other = capture_plan(PLAN | {"exposures_ms": METERED | {"fill": 0.5}}, RIG, "config.yaml")
    assert other.metering == Metering(shortest_s=0.0001, fill=0.5)


@pytest.mark.parametrize("change", [{"count": 6}, {"ratio": 100}, {"longest": 6}, {"shortest": 900}])
def test_a_ladder_longer_than_its_range_is_refused(change: dict[str, float]) -> None:
    refused = _refusal(exposures_ms=METERED | change)
    assert refused.field == "plan.exposures_ms"
    assert "do not fit between" in refused.problem


def test_targets_of_a_session_are_not_metered() -> None:
    config = Path(__file__).resolve().parents[2] / "config/config.yaml"
    settings = read_checked(config, "config")
    plan = capture_plan(settings["plan"] | {"exposures_ms": METERED}, read_rig(SOURCE), config)
    assert all(target.metering is None for target in session_plans(plan, settings, config).values())


def test_some_metered_state_shows_any_mirror_nearly_at_its_brightest() -> None:
    """Twelve of the published 36 states: filled to 0.8 by them, the range holds all."""
    states = capture_plan(PLAN, RIG, "config.yaml").states_deg
    chosen = list(brightest_states(states))
    assert len(chosen) == 12
    weights = Polarimeter(np.pi / 2, np.pi / 2).measurement_matrix(np.deg2rad(states))
    for retardance in np.deg2rad(range(0, 360, 5)):
        for diattenuation in (-0.9, -0.5, -0.25, 0.0, 0.25, 0.5, 0.9):
            both = np.sqrt(1 - diattenuation**2)
            c, s = both * np.cos(retardance), both * np.sin(retardance)
            mirror = np.array(
                [[1, diattenuation, 0, 0], [diattenuation, 1, 0, 0], [0, 0, c, s], [0, 0, -s, c]]
            )
            light = weights @ mirror.ravel()
            assert light[chosen].max() > 0.89 * light.max()


def test_lights_beyond_half_a_turn_are_refused() -> None:
    rig = RIG | {"arm": {"radius_mm": 800, "limits_deg": [0, 360]}}
    with pytest.raises(InputError, match="190° is beyond 180°"):
        capture_plan(PLAN | {"lights_deg": [8, 190]}, rig, "config.yaml")


@pytest.mark.parametrize(
    ("count", "after"),
    [(0, ()), (1, (36,)), (2, (0, 36)), (3, (0, 18, 36)), (5, (0, 9, 18, 27, 36)), (36, (*range(35), 36))],
)
def test_repeats_are_evenly_spread_from_before_the_first_state_to_after_the_last(
    count: int, after: tuple[int, ...]
) -> None:
    plan = capture_plan(PLAN | {"references": count}, RIG, "config.yaml")
    assert plan.references == after
    assert plan.frames_per_light() == (2 * (36 + count) + 3) * 2


def test_no_known_element_makes_the_repeated_state_dark() -> None:
    """Between crossed quarter waves the first state is dark in air, and state 7 behind a polariser."""
    plan = capture_plan(PLAN | {"references": 3}, RIG, "config.yaml")
    weights = Polarimeter(np.pi / 2, np.pi / 2).measurement_matrix(np.deg2rad(plan.states_deg))
    elements = [np.diag([1.0, 1, -1, -1]), *(element / element[0, 0] for element in IDEAL.values())]
    light = np.array([weights @ element.ravel() for element in elements])
    assert light[:, 0].min() == pytest.approx(0.0, abs=1e-12)
    assert light[:, 7].min() < 0.01
    assert plan.reference_state == 6
    assert light[:, 6].min() == pytest.approx(light.min(axis=0).max(), abs=1e-12)
    # a quarter of unpolarised light is what a state sees on average
    assert light[:, 6].min() > 0.2 * 0.25


def test_of_states_alike_the_first_is_repeated() -> None:
    assert bright_state([(0.0, 0.0, 0.0, 90.0), (0.0, 150.0, 30.0, 90.0), (0.0, 330.0, 210.0, 90.0)]) == 1


def test_nothing_is_named_where_nothing_is_repeated() -> None:
    assert capture_plan(PLAN, RIG, "config.yaml").reference_state == 0


def test_more_repeats_than_states_are_refused() -> None:
    refused = _refusal(references=37)
    assert refused.field == "plan.references"
    assert refused.problem == "37 repeats are more than the 36 states between them"


def test_the_small_run_repeats_few_states() -> None:
    """Repeats cost less than a tenth of the frames."""
    config = Path(__file__).resolve().parents[2] / "config"
    settings = read_checked(config / "config.yaml", "config")
    plan = capture_plan(settings["plan"], read_rig(config / "rig/virtual.yaml"), "config.yaml")
    without = replace(plan, references=())
    assert 1.0 < plan.frames_per_light() / without.frames_per_light() < 1.1
