"""Plans of a session's targets: the materials' plan with one light and exposures of their own."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from pbrdf.errors import InputError
from pbrdf.optics.elements import IDEAL
from pbrdf.settings.checked import check
from pbrdf.settings.plan import CapturePlan, Light
from pbrdf.settings.targets import AMBIENT, ambient_plan, board_names, board_view, session_plans, target_plan

PLAN = CapturePlan(
    (Light("008.00", 8.0), Light("041.00", 41.0)),
    (450, 650),
    ((0.0, 25.0, 5.0, 90.0),) * 16,
    (0.01,),
    darks=3,
)


def test_a_target_shares_all_but_light_and_exposures_with_the_materials() -> None:
    plan = target_plan(PLAN, {"light_deg": 180, "exposures_ms": [5, 40]}, "config.yaml", "validation")
    assert plan.lights == (Light("180.00", 180.0),)
    assert plan.exposures_s == (0.005, 0.04)
    assert (plan.bands_nm, plan.states_deg, plan.darks) == (PLAN.bands_nm, PLAN.states_deg, PLAN.darks)


def test_a_config_that_says_nothing_stands_the_arm_straight() -> None:
    section = check({"materials": "m.tsv"}, "config", "config.yaml")["validation"]
    assert target_plan(PLAN, section, "config.yaml", "validation").lights == (Light("180.00", 180.0),)


def plans(**session: Any) -> dict[str, CapturePlan]:
    config = check({"materials": "m.tsv", "session": session}, "config", "config.yaml")
    return session_plans(replace(PLAN, references=(0, 16), reference_state=5), config, "config.yaml")


def test_a_session_holds_elements_chrome_boards_flat_and_spectralon() -> None:
    boards = [f"board_{view:02d}" for view in range(1, 13)]
    assert set(plans()) == {*IDEAL, "chrome", "chrome_ambient", *boards, "flat", "spectralon"}
    assert [board_view(name) for name in board_names(12)] == list(range(1, 13))


def test_the_chrome_ball_is_taken_under_every_light_of_the_materials_in_one_frame() -> None:
    chrome = plans()["chrome"]
    assert chrome.lights == PLAN.lights
    assert (chrome.bands_nm, chrome.darks, chrome.references) == ((650,), 1, ())
    assert chrome.frames_per_light() == 2


def test_what_ambient_light_shows_is_one_frame_without_an_arm() -> None:
    session = plans(board={"views": 2})
    ambient = [session["chrome_ambient"], session["board_01"], session["board_02"]]
    ambient.append(ambient_plan(PLAN, check({"materials": "m"}, "config", "c")["session"], "c"))
    for plan in ambient:
        assert (plan.lights, plan.frames_per_light()) == ((AMBIENT,), 2)
    assert "board_03" not in session


def test_the_flat_field_is_one_state_many_times_in_every_band() -> None:
    flat = plans(flat={"repeats": 3, "darks": 6, "exposures_ms": [1, 2]})["flat"]
    assert (flat.lights, flat.bands_nm, flat.exposures_s) == ((AMBIENT,), PLAN.bands_nm, (0.001, 0.002))
    assert (len(flat.states_deg), len(set(flat.states_deg)), flat.darks) == (3, 1, 6)
    assert flat.frames_per_light() == (2 * 3 + 6) * 2


def test_spectralon_is_taken_as_materials_are() -> None:
    tile = plans(spectralon={"lights_deg": [25, 35], "exposures_ms": [7]})["spectralon"]
    assert tile.lights == (Light("025.00", 25.0), Light("035.00", 35.0))
    assert (tile.states_deg, tile.references, tile.reference_state) == (PLAN.states_deg, (0, 16), 5)


@pytest.mark.parametrize("section", ["chrome", "ambient", "board", "flat", "spectralon"])
def test_exposures_of_a_target_ascend(section: str) -> None:
    with pytest.raises(InputError) as refused:
        plans(**{section: {"exposures_ms": [8, 4]}})
    assert refused.value.field == f"session.{section}.exposures_ms"


@pytest.mark.parametrize("times", [[5, 5], [40, 5]])
def test_exposures_that_do_not_ascend_are_refused(times: list[int]) -> None:
    with pytest.raises(InputError) as refused:
        target_plan(PLAN, {"light_deg": 180, "exposures_ms": times}, "config.yaml", "validation")
    assert (refused.value.source, refused.value.field) == ("config.yaml", "validation.exposures_ms")
