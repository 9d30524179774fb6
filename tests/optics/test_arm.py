"""The arm: a circle that is walked right-handed about its axis, with the generator's frame turning along."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pbrdf.optics.arm import Arm, generator_axis_at_zero

UP = (0.0, -1.0, 0.0)
SIMPLE = Arm((0.0, 0.0, 1000.0), axis=UP, start=(0.0, 0.0, -1.0), radius_mm=800.0, generator_axis=UP)
ANGLES = np.linspace(-170.0, 350.0, 27)


def leaning() -> Arm:
    """Axis, start and generator in no special place."""
    axis, start, generator = Rotation.from_euler("xyz", [0.2, -0.4, 1.1]).as_matrix()
    generator = 0.8 * generator + 0.6 * axis
    a, s, g = (tuple(float(x) for x in vector) for vector in (axis, start, generator))
    return Arm((3.0, -4.0, 990.0), axis=a, start=s, radius_mm=750.0, generator_axis=g)  # type: ignore[arg-type]


def test_at_zero_the_light_stands_at_the_start() -> None:
    np.testing.assert_allclose(SIMPLE.light_position(0.0), [0.0, 0.0, 200.0])
    np.testing.assert_allclose(SIMPLE.generator_x(0.0), UP)


def test_a_quarter_turn_is_right_handed_about_the_axis() -> None:
    # axis up (−y), start toward the camera (−z): the light moves toward up × (−z) = +x
    np.testing.assert_allclose(SIMPLE.light_position(90.0), [800.0, 0.0, 1000.0], atol=1e-10)


@pytest.mark.parametrize("arm", [SIMPLE, leaning()], ids=["upright", "leaning"])
def test_lights_lie_on_the_circle(arm: Arm) -> None:
    spokes = np.array([arm.light_position(angle) for angle in ANGLES]) - arm.centre_mm
    np.testing.assert_allclose(np.linalg.norm(spokes, axis=-1), arm.radius_mm, rtol=1e-14)
    np.testing.assert_allclose(spokes @ arm.axis, 0.0, atol=1e-10)
    step = np.sum(spokes[1:] * spokes[:-1], axis=-1) / arm.radius_mm**2
    np.testing.assert_allclose(np.rad2deg(np.arccos(step)), 20.0, atol=1e-10)


def test_light_and_generator_turn_by_the_same_rotation() -> None:
    arm = leaning()
    for angle in ANGLES:
        turn = Rotation.from_rotvec(np.deg2rad(angle) * np.array(arm.axis))
        expected = np.array(arm.centre_mm) + arm.radius_mm * turn.apply(arm.start)
        np.testing.assert_allclose(arm.light_position(angle), expected, atol=1e-10)
        np.testing.assert_allclose(arm.generator_x(angle), turn.apply(arm.generator_axis), atol=1e-14)


def test_a_whole_turn_leads_back() -> None:
    arm = leaning()
    np.testing.assert_allclose(arm.light_position(375.0), arm.light_position(15.0), atol=1e-10)


def test_an_offset_moves_the_light_at_its_angle_alone() -> None:
    arm = replace(SIMPLE, offsets_mm={41.0: (0.5, -1.5, 0.25)})
    moved = arm.light_position(41.0) - SIMPLE.light_position(41.0)
    np.testing.assert_allclose(moved, [0.5, -1.5, 0.25], atol=1e-12)
    # an angle that went through a sum of steps is the same angle
    np.testing.assert_allclose(arm.light_position(41.0 + 1e-9), arm.light_position(41.0), atol=1e-6)
    np.testing.assert_array_equal(arm.light_position(41.5), SIMPLE.light_position(41.5))
    np.testing.assert_array_equal(arm.generator_x(41.0), SIMPLE.generator_x(41.0))


def test_the_generators_axis_known_at_180_degrees_leads_back_to_zero() -> None:
    arm = leaning()
    at_zero = generator_axis_at_zero(arm.generator_x(180.0), 180.0, arm.axis)
    np.testing.assert_allclose(at_zero, arm.generator_axis, atol=1e-14)
