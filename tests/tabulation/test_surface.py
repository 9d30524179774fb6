"""The point that shows a node: its own light, camera and normal make the node's angles."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.calibration.sphere import Sphere
from pbrdf.optics.frames import angle_between, normalised, table_axis, transverse
from pbrdf.optics.rusinkiewicz import angles
from pbrdf.tabulation.axes import table_axes
from pbrdf.tabulation.surface import SurfacePoints, node_points

Float = NDArray[np.float64]

AXES = table_axes(46, 2, 91)
THETA_H, PHI_D = AXES.theta_h[:, None], AXES.phi_d[None, :]


def sphere_and_light(distance_mm: float, radius_mm: float, angle_deg: float) -> tuple[Sphere, Float]:
    """A sphere a little off the camera's axis, and a light `angle_deg` from the camera, a little raised."""
    angle = np.deg2rad(angle_deg)
    sphere = Sphere((4.0, -3.0, distance_mm), radius_mm)
    direction = normalised([np.sin(angle), -0.03, -np.cos(angle)])
    return sphere, np.array(sphere.centre_mm) + 0.8 * distance_mm * direction


def normals(points: SurfacePoints, sphere: Sphere) -> Float:
    return (points.position_mm - np.array(sphere.centre_mm)) / sphere.radius_mm


def local(vector: Float, normal: Float) -> Float:
    x = transverse(np.broadcast_to([0.6, 0.8, 0.0], normal.shape), normal)
    return np.stack([np.sum(vector * axis, axis=-1) for axis in (x, np.cross(normal, x), normal)], axis=-1)


# near: a tenth of the camera's distance; far: as the paper's rig
@pytest.mark.parametrize(("distance_mm", "radius_mm"), [(250.0, 25.0), (1000.0, 25.0)], ids=["near", "far"])
@pytest.mark.parametrize("angle_deg", [8.0, 40.0, 90.0, 140.0, 165.0])
def test_a_point_shows_its_node(distance_mm: float, radius_mm: float, angle_deg: float) -> None:
    sphere, light = sphere_and_light(distance_mm, radius_mm, angle_deg)
    points = node_points(sphere, light, THETA_H, PHI_D)
    # near, with the light behind, there is no point for nodes at and below the horizon
    settled = np.isfinite(points.cos_light)
    assert settled.all() or angle_deg > 150
    normal = normals(points, sphere)
    theta_h, theta_d, phi_d = angles(local(points.to_light, normal), local(points.to_camera, normal))
    assert np.abs(theta_h - THETA_H)[settled].max() < 1e-10
    azimuth = np.abs((phi_d - PHI_D + np.pi) % (2 * np.pi) - np.pi)
    # at θh = 0 the azimuth is free; close to it, it is as uncertain as 1/sin θh
    assert (azimuth * np.sin(THETA_H))[settled].max() < 1e-10
    np.testing.assert_allclose(points.theta_d[settled], theta_d[settled], atol=1e-12)


@pytest.mark.parametrize("angle_deg", [2.0, 8.0, 40.0, 90.0, 140.0, 160.0, 168.0])
@pytest.mark.parametrize("distance_mm", [250.0, 1000.0])
def test_every_visible_point_is_found_by_its_node(distance_mm: float, angle_deg: float) -> None:
    """Points all over the sphere, their angles worked out from directions alone, back to points."""
    sphere, light = sphere_and_light(distance_mm, 25.0, angle_deg)
    normal = normalised(np.random.default_rng(1).normal(size=(20_000, 3)))
    position = np.array(sphere.centre_mm) + sphere.radius_mm * normal
    to_light, to_camera = normalised(light - position), normalised(-position)
    cosine = np.minimum(np.sum(normal * to_light, axis=-1), np.sum(normal * to_camera, axis=-1))
    visible = cosine > np.cos(np.deg2rad(85.0))
    normal, position = normal[visible], position[visible]
    theta_h, _, phi_d = angles(local(to_light[visible], normal), local(to_camera[visible], normal))
    found = node_points(sphere, light, theta_h, phi_d)
    np.testing.assert_allclose(found.position_mm, position, atol=1e-9 * sphere.radius_mm)


@pytest.mark.parametrize("angle_deg", [8.0, 90.0, 140.0])
def test_a_point_lies_on_the_sphere_and_its_directions_are_its_own(angle_deg: float) -> None:
    sphere, light = sphere_and_light(400.0, 25.0, angle_deg)
    points = node_points(sphere, light, THETA_H, PHI_D)
    normal = normals(points, sphere)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=-1), 1.0, atol=1e-12)
    np.testing.assert_allclose(points.to_light, normalised(light - points.position_mm), atol=1e-15)
    np.testing.assert_allclose(points.to_camera, normalised(-points.position_mm), atol=1e-15)
    np.testing.assert_allclose(points.cos_light, np.sum(normal * points.to_light, axis=-1), atol=1e-12)
    np.testing.assert_allclose(points.cos_camera, np.sum(normal * points.to_camera, axis=-1), atol=1e-12)
    distance = np.linalg.norm(light - points.position_mm, axis=-1)
    np.testing.assert_allclose(points.light_distance_mm, distance, rtol=1e-14)


def test_far_away_every_point_has_the_same_difference_angle() -> None:
    sphere, light = sphere_and_light(1e7, 25.0, 70.0)
    points = node_points(sphere, light, THETA_H, PHI_D)
    assert np.ptp(points.theta_d) < 1e-5


def test_a_light_right_behind_the_sphere_shows_nothing() -> None:
    sphere = Sphere((0.0, 0.0, 1000.0), 25.0)
    points = node_points(sphere, [0.0, 0.0, 1800.0], THETA_H, PHI_D)
    assert not np.any((points.cos_light > 0) & (points.cos_camera > 0))


def test_frame_angles_lead_from_the_modules_to_the_table() -> None:
    sphere, light = sphere_and_light(400.0, 25.0, 70.0)
    points = node_points(sphere, light, THETA_H[3:], PHI_D)
    axes = [0.1, -1.0, 0.2], [0.0, -1.0, 0.1]
    angle_in, angle_out = points.frame_angles(*axes)
    s = table_axis(points.to_light, points.to_camera)
    for axis, angle, beam in zip(
        axes, (angle_in, angle_out), (-points.to_light, points.to_camera), strict=True
    ):
        x = transverse(axis, beam)
        turned = np.cos(angle)[..., None] * x + np.sin(angle)[..., None] * np.cross(beam, x)
        np.testing.assert_allclose(turned, s, atol=1e-12)
        np.testing.assert_allclose(angle, angle_between(x, s, beam), atol=1e-15)
