"""Plans of a session's targets: the materials' plan with one light and exposures of their own."""

from __future__ import annotations

import pytest

from pbrdf.errors import InputError
from pbrdf.settings.checked import check
from pbrdf.settings.plan import CapturePlan, Light
from pbrdf.settings.targets import target_plan

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


@pytest.mark.parametrize("times", [[5, 5], [40, 5]])
def test_exposures_that_do_not_ascend_are_refused(times: list[int]) -> None:
    with pytest.raises(InputError) as refused:
        target_plan(PLAN, {"light_deg": 180, "exposures_ms": times}, "config.yaml", "validation")
    assert (refused.value.source, refused.value.field) == ("config.yaml", "validation.exposures_ms")
