"""Half and difference angles: there and back, the two symmetries, the in-plane case and the poles."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.optics.frames import normalised
from pbrdf.optics.rusinkiewicz import angles, cosines, directions

Float = NDArray[np.float64]
COUNT = 2000


def angle_difference(a: Float, b: Float) -> Float:
    return np.abs((a - b + np.pi) % (2 * np.pi) - np.pi)


@pytest.fixture(scope="module")
def pairs() -> tuple[Float, Float]:
    """Directions over the whole upper hemisphere."""
    vectors = normalised(np.random.default_rng(1).normal(size=(2, COUNT, 3)))
    vectors[..., 2] = np.abs(vectors[..., 2])
    return vectors[0], vectors[1]


def random_angles() -> tuple[Float, Float, Float]:
    random = np.random.default_rng(2)
    return (
        random.uniform(0.01, 1.56, COUNT),
        random.uniform(0.01, 1.56, COUNT),
        random.uniform(-np.pi, np.pi, COUNT),
    )


def about_normal(turn: float) -> Float:
    c, s = np.cos(turn), np.sin(turn)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def test_angles_to_directions_and_back() -> None:
    wanted = random_angles()
    found = angles(*directions(*wanted))
    for name, a, b in zip(("theta_h", "theta_d", "phi_d"), wanted, found, strict=True):
        assert angle_difference(a, b).max() < 1e-12, name


def test_directions_to_angles_and_back_up_to_a_turn_about_the_normal(pairs: tuple[Float, Float]) -> None:
    light, camera = pairs
    half = light + camera
    found_light, found_camera = directions(*angles(light, camera))
    for index, azimuth in enumerate(np.arctan2(half[:, 1], half[:, 0])):
        turn = about_normal(azimuth)
        np.testing.assert_allclose(turn @ found_light[index], light[index], atol=1e-12)
        np.testing.assert_allclose(turn @ found_camera[index], camera[index], atol=1e-12)


def test_definitions(pairs: tuple[Float, Float]) -> None:
    light, camera = pairs
    theta_h, theta_d, phi_d = angles(light, camera)
    half = normalised(light + camera)
    np.testing.assert_allclose(np.cos(theta_h), half[:, 2], atol=1e-12)
    np.testing.assert_allclose(np.cos(2 * theta_d), np.sum(light * camera, axis=-1), atol=1e-12)
    # Rusinkiewicz 1998: d = Rot_b(-θh) Rot_n(-φh) L, and φd is its azimuth
    phi_h = np.arctan2(half[:, 1], half[:, 0])
    for index in range(0, COUNT, 20):
        x, y, z = about_normal(-phi_h[index]) @ light[index]
        c, s = np.cos(theta_h[index]), np.sin(theta_h[index])
        difference = np.array([c * x - s * z, y, s * x + c * z])
        np.testing.assert_allclose(difference[2], np.cos(theta_d[index]), atol=1e-12)
        assert angle_difference(np.arctan2(difference[1], difference[0]), phi_d[index]) < 1e-11


def test_cosines_are_the_heights_of_the_directions() -> None:
    wanted = random_angles()
    light, camera = directions(*wanted)
    cos_light, cos_camera = cosines(*wanted)
    np.testing.assert_allclose(cos_light, light[:, 2], atol=1e-15)
    np.testing.assert_allclose(cos_camera, camera[:, 2], atol=1e-15)


def test_the_mirror_image_turns_phi_d_over(pairs: tuple[Float, Float]) -> None:
    mirror = np.array([1.0, -1.0, 1.0])
    here, there = angles(*pairs), angles(pairs[0] * mirror, pairs[1] * mirror)
    np.testing.assert_allclose(there[0], here[0], atol=1e-13)
    np.testing.assert_allclose(there[1], here[1], atol=1e-13)
    assert angle_difference(there[2], -here[2]).max() < 1e-12


def test_light_and_camera_exchanged_turn_phi_d_by_half_a_turn(pairs: tuple[Float, Float]) -> None:
    here, there = angles(*pairs), angles(*pairs[::-1])
    np.testing.assert_allclose(there[0], here[0], atol=1e-13)
    np.testing.assert_allclose(there[1], here[1], atol=1e-13)
    assert angle_difference(there[2], here[2] + np.pi).max() < 1e-11


def test_a_turn_about_the_normal_changes_nothing(pairs: tuple[Float, Float]) -> None:
    turn = about_normal(2.1).T
    for a, b in zip(angles(*pairs), angles(pairs[0] @ turn, pairs[1] @ turn), strict=True):
        assert angle_difference(a, b).max() < 1e-11


@pytest.mark.parametrize(("theta_h", "theta_d"), [(0.3, 0.5), (0.7, 0.2), (0.05, 1.2)])
def test_in_plane_at_phi_d_zero_the_light_is_beyond_the_half_vector(theta_h: float, theta_d: float) -> None:
    light, camera = directions(theta_h, theta_d, 0.0)
    assert np.arccos(light[2]) == pytest.approx(theta_h + theta_d, abs=1e-12)
    assert np.arccos(camera[2]) == pytest.approx(abs(theta_d - theta_h), abs=1e-12)
    light, camera = directions(theta_h, theta_d, np.pi)
    assert np.arccos(camera[2]) == pytest.approx(theta_h + theta_d, abs=1e-12)


def test_where_the_half_vector_is_the_normal_phi_d_is_the_azimuth_of_the_light() -> None:
    azimuth = np.linspace(-3.0, 3.0, 13)
    light = np.stack(
        [np.sin(0.6) * np.cos(azimuth), np.sin(0.6) * np.sin(azimuth), 0 * azimuth + np.cos(0.6)], axis=-1
    )
    theta_h, theta_d, phi_d = angles(light, light * [-1.0, -1.0, 1.0])
    np.testing.assert_allclose(theta_h, 0.0, atol=1e-15)
    np.testing.assert_allclose(theta_d, 0.6, atol=1e-14)
    np.testing.assert_allclose(phi_d, azimuth, atol=1e-14)


@pytest.mark.parametrize("phi_d", [-2.0, 0.0, 0.4, 3.0])
def test_the_pole_is_the_limit_of_half_vectors_that_lean_along_x(phi_d: float) -> None:
    at_pole, beside = directions(0.0, 0.6, phi_d), directions(1e-9, 0.6, phi_d)
    np.testing.assert_allclose(at_pole, beside, atol=1e-8)
    np.testing.assert_allclose(angles(*at_pole), angles(*beside), atol=1e-8)


def test_light_at_the_camera_has_no_difference_angle() -> None:
    direction = np.array([np.sin(0.4), 0.0, np.cos(0.4)])
    theta_h, theta_d, phi_d = angles(direction, direction)
    assert theta_h == pytest.approx(0.4, abs=1e-15)
    assert theta_d == pytest.approx(0.0, abs=1e-15)
    assert np.isfinite(phi_d)
    # close to it no digit is lost
    assert angles(*directions(0.4, 1e-9, 1.0))[1] == pytest.approx(1e-9, rel=1e-6)


def test_grazing_light_from_the_side_has_the_half_vector_at_45_degrees() -> None:
    theta_h, theta_d, _ = angles([1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    np.testing.assert_allclose([theta_h, theta_d], np.pi / 4, atol=1e-15)
