"""Where the parts of a virtual rig stand when its arm's axis is tilted."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pbrdf.errors import InputError
from pbrdf.instruments.virtual_beam import VirtualBeam
from pbrdf.instruments.virtual_geometry import UP, virtual_arm
from pbrdf.settings.checked import check
from pbrdf.settings.rig import read_rig

SOURCE = Path(__file__).resolve().parents[2] / "config/rig/virtual.yaml"


@pytest.fixture
def settings() -> dict[str, Any]:
    return deepcopy(dict(read_rig(SOURCE)))


def tilted(settings: dict[str, Any], about_x: float, about_z: float) -> dict[str, Any]:
    return settings | {"arm": {**settings["arm"], "axis_tilt_deg": [about_x, about_z]}}


def test_an_arm_without_tilt_turns_about_the_vertical(settings: dict[str, Any]) -> None:
    for rig in (settings, tilted(settings, 0.0, 0.0)):
        arm = virtual_arm(rig)
        assert (arm.axis, arm.start, arm.generator_axis) == (UP, (0.0, 0.0, -1.0), UP)


def test_a_tilted_arm_is_rigid(settings: dict[str, Any]) -> None:
    arm = virtual_arm(tilted(settings, 0.6, -0.4))
    axis, start = np.array(arm.axis), np.array(arm.start)
    assert np.linalg.norm(axis) == pytest.approx(1.0)
    assert axis @ start == pytest.approx(0.0, abs=1e-12)
    assert arm.generator_axis == arm.axis
    for angle in (0.0, 41.0, 90.0, 180.0):
        spoke = arm.light_position(angle) - [0, 0, 1000]
        assert np.linalg.norm(spoke) == pytest.approx(800.0)
        assert spoke @ axis == pytest.approx(0.0, abs=1e-9)


def test_a_tilt_about_x_lifts_the_lamp_and_one_about_z_leans_the_axis(settings: dict[str, Any]) -> None:
    """Right-handed: about x the vertical (0, −1, 0) leans to −z; about z it leans to +x."""
    about_x, about_z = (virtual_arm(tilted(settings, *angles)) for angles in ((2.0, 0.0), (0.0, 2.0)))
    sine, cosine = np.sin(np.deg2rad(2.0)), np.cos(np.deg2rad(2.0))
    np.testing.assert_allclose(about_x.axis, (0, -cosine, -sine), atol=1e-12)
    np.testing.assert_allclose(
        about_x.light_position(180.0), (0, -800 * sine, 1000 + 800 * cosine), atol=1e-9
    )
    np.testing.assert_allclose(about_z.axis, (sine, -cosine, 0), atol=1e-12)
    np.testing.assert_allclose(about_z.light_position(180.0), (0, 0, 1800), atol=1e-9)


def test_the_lamp_of_a_slightly_tilted_arm_stays_within_the_frame(settings: dict[str, Any]) -> None:
    seen = VirtualBeam(tilted(settings, 0.6, -0.4), "air", SOURCE).mueller_image(180.0, 550)[..., 0]
    radius = 3200 * 12.7 / 1800
    assert seen.sum() / settings["lamp_disc"]["radiance"] == pytest.approx(np.pi * radius**2, rel=2e-3)
    row, _ = np.indices(seen.shape)
    lifted = 3200 * 800 * np.sin(np.deg2rad(0.6)) / 1800
    assert (seen * row).sum() / seen.sum() == pytest.approx(96.1 - lifted, abs=0.05)


def test_air_turns_by_the_lean_of_the_generator(settings: dict[str, Any]) -> None:
    """A tilt b about the view: light linear along the generator's x leaves at b to the analyser's x."""
    mueller = VirtualBeam(tilted(settings, 0.0, -3.0), "air", SOURCE).mueller_image(180.0, 550)[96, 95]
    leaves = mueller.reshape(4, 4) @ [1.0, 1.0, 0.0, 0.0] / mueller[0]
    angle = np.rad2deg(np.arctan2(leaves[2], leaves[1]) / 2)
    # z of the beam is toward the camera, against the view
    assert angle == pytest.approx(3.0, abs=1e-4)


def test_a_wild_tilt_is_refused(settings: dict[str, Any]) -> None:
    with pytest.raises(InputError) as refused:
        check(tilted(settings, 30.0, 0.0), "rig", "rig.yaml")
    assert refused.value.field == "arm.axis_tilt_deg.0"
