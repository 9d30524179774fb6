"""The supplement's map from bins to lights and points, and what its slips do."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.calibration.sphere import Sphere
from pbrdf.tabulation.inverse_map import Slip, circle_crossing, nearest_light, turn_angle, turn_angles_of
from pbrdf.tabulation.surface import SurfacePoints, node_points

Float = NDArray[np.float64]
SPHERE = Sphere((3.0, -2.0, 400.0), 25.0)
LIGHT = np.array([200.0, 30.0, 150.0])


@pytest.fixture(scope="module")
def seen() -> tuple[tuple[Float, Float, Float], SurfacePoints]:
    """Bins that the light shows, and the points that show them."""
    rng = np.random.default_rng(1)
    theta_h, phi_d = rng.uniform(0.02, 1.2, 500), rng.uniform(-np.pi, np.pi, 500)
    points = node_points(SPHERE, LIGHT, theta_h, phi_d)
    kept = (points.cos_light > 0.05) & (points.cos_camera > 0.05)
    assert kept.sum() > 200
    return (theta_h[kept], points.theta_d[kept], phi_d[kept]), node_points(
        SPHERE, LIGHT, theta_h[kept], phi_d[kept]
    )


def test_a_bin_that_a_light_shows_has_that_lights_theta_t(
    seen: tuple[tuple[Float, Float, Float], SurfacePoints],
) -> None:
    angle, distance = turn_angles_of(SPHERE, LIGHT[None])
    np.testing.assert_allclose(turn_angle(SPHERE, distance[0], seen[0]), angle[0], atol=1e-14)


def test_its_circles_cross_where_the_light_shows_it(
    seen: tuple[tuple[Float, Float, Float], SurfacePoints],
) -> None:
    bins, points = seen
    found = np.asarray(SPHERE.centre_mm) + SPHERE.radius_mm * circle_crossing(SPHERE, LIGHT, bins)
    np.testing.assert_allclose(found, points.position_mm, atol=1e-9)


def test_circles_do_not_cross_when_the_light_is_too_far_away() -> None:
    """At φd = 0 they lie in a plane with the normal, and θi + θo = 2 θd is at least θt, but for parallax."""
    light = np.array([0.0, 300.0, 100.0])
    (angle,), _ = turn_angles_of(SPHERE, light[None])
    for off, crosses in ((0.1, True), (-0.1, False)):
        bins = (np.array([0.3]), np.array([angle / 2 + off]), np.array([0.0]))
        assert np.isfinite(circle_crossing(SPHERE, light, bins)).all() == crosses


def test_each_bin_goes_to_the_light_of_nearest_theta_t(
    seen: tuple[tuple[Float, Float, Float], SurfacePoints],
) -> None:
    lights = np.stack([LIGHT + np.array([0.0, 0.0, step]) for step in (-80.0, -20.0, 0.0, 20.0, 60.0)])
    index, off = nearest_light(SPHERE, lights, seen[0])
    assert (index == 2).all()
    assert off.max() < 1e-9


@pytest.mark.parametrize(("slip", "least", "most"), [("camera", 0.03, 0.07), ("light", 1e-3, 5e-3)])
def test_a_slip_takes_another_theta_t(
    seen: tuple[tuple[Float, Float, Float], SurfacePoints], slip: Slip, least: float, most: float
) -> None:
    """The camera's is of the order of r over its distance, the light's of the parallax's cosine."""
    (angle,), (distance,) = turn_angles_of(SPHERE, LIGHT[None])
    off = np.abs(turn_angle(SPHERE, distance, seen[0], [slip]) - angle).max()
    assert least < off < most
