"""The model as physics knows it: Brewster, reciprocity, mirror symmetry, metals, diffuse polarisation."""

import numpy as np
import pytest

from pbrdf.models import MODELS
from pbrdf.optics.rusinkiewicz import directions

MODEL = MODELS["baek2018"]
PLASTIC = {"alpha": 0.3, "eta": 1.5, "specular": 0.9, "albedo": 0.6}
GOLD = {"alpha": 0.2, "eta": 0.183, "kappa": 3.43, "specular": 1.0, "albedo": 0.0}


@pytest.fixture(scope="module")
def grid():
    theta_h, theta_d, phi_d = np.meshgrid(
        np.linspace(0.01, 1.4, 13), np.linspace(0.01, 1.4, 14), np.linspace(-np.pi, np.pi, 25), indexing="ij"
    )
    return theta_h, theta_d, phi_d


def relative(difference, values):
    return np.max(np.abs(difference)) / np.max(np.abs(values))


def test_light_and_camera_may_change_places(grid):
    theta_h, theta_d, phi_d = grid
    p = np.diag([1.0, 1.0, -1.0, 1.0])
    here = MODEL.evaluate(*directions(theta_h, theta_d, phi_d), PLASTIC)
    there = MODEL.evaluate(*directions(theta_h, theta_d, phi_d + np.pi), PLASTIC)
    assert relative(there - p @ np.swapaxes(here, -1, -2) @ p, here) < 1e-12


@pytest.mark.parametrize("material", [PLASTIC, GOLD], ids=["plastic", "gold"])
def test_the_mirror_image_is_the_same_surface(grid, material):
    theta_h, theta_d, phi_d = grid
    q = np.diag([1.0, 1.0, -1.0, -1.0])
    here = MODEL.evaluate(*directions(theta_h, theta_d, phi_d), material)
    mirrored = MODEL.evaluate(*directions(theta_h, theta_d, -phi_d), material)
    assert relative(here - q @ mirrored @ q, here) < 1e-12


def test_at_brewsters_angle_only_s_is_reflected():
    light, camera = directions(0.0, np.arctan(PLASTIC["eta"]), 0.0)
    m = MODEL.evaluate(light, camera, PLASTIC | {"albedo": 0.0})
    np.testing.assert_allclose(m[:2, :2], m[0, 0], rtol=1e-12)
    np.testing.assert_allclose(m[2:, 2:], 0.0, atol=1e-8 * m[0, 0])


def test_handedness_turns_over_below_brewsters_angle_only():
    below, above = (
        MODEL.evaluate(*directions(0.0, np.arctan(1.5) + turn, 0.0), PLASTIC | {"albedo": 0.0})
        for turn in (-0.1, 0.1)
    )
    assert below[3, 3] < 0 < above[3, 3]


def test_normal_incidence_is_a_mirror():
    n = [0.0, 0.0, 1.0]
    m = MODEL.evaluate(n, n, PLASTIC | {"albedo": 0.0})
    fresnel = ((1.5 - 1) / (1.5 + 1)) ** 2
    distribution = 1 / (np.pi * PLASTIC["alpha"] ** 2)
    expected = PLASTIC["specular"] * distribution * fresnel / 4
    np.testing.assert_allclose(m, expected * np.diag([1.0, 1.0, -1.0, -1.0]), atol=1e-15)


def test_gold_at_sixty_degrees():
    m = MODEL.evaluate(*directions(0.0, np.radians(60.0), 0.0), GOLD)
    m /= m[0, 0]
    found = [m[3, 2], m[2, 3], m[2, 2], m[0, 1]]
    np.testing.assert_allclose(found, [0.717, -0.717, -0.696, 0.036], atol=5e-4)


@pytest.mark.parametrize("theta", [0.2, 0.7, 1.2])
def test_diffuse_light_leaves_polarised_as_atkinson_and_hancock_say(theta):
    eta = 1.5
    camera = [np.sin(theta), 0.0, np.cos(theta)]
    m = MODEL.evaluate([0.3, 0.4, np.sqrt(0.75)], camera, PLASTIC | {"eta": eta, "specular": 0.0})
    found = np.hypot(m[1, 0], m[2, 0]) / m[0, 0]
    sine2 = np.sin(theta) ** 2
    numerator = (eta - 1 / eta) ** 2 * sine2
    root = np.sqrt(eta**2 - sine2)
    denominator = 2 + 2 * eta**2 - (eta + 1 / eta) ** 2 * sine2 + 4 * np.cos(theta) * root
    assert found == pytest.approx(numerator / denominator, rel=1e-12)


def test_diffuse_light_vibrates_in_the_plane_of_the_normal():
    # light far off that plane; p is brighter, so s1 < 0 about the s-axis n × V
    camera = np.array([np.sin(1.0), 0.0, np.cos(1.0)])
    light = np.array([0.2, 0.7, np.sqrt(1 - 0.04 - 0.49)])
    m = MODEL.evaluate(light, camera, PLASTIC | {"specular": 0.0})
    s = np.cross(light, camera) / np.linalg.norm(np.cross(light, camera))
    y = np.cross(camera, s)
    azimuth = 0.5 * np.arctan2(m[2, 0], m[1, 0])
    vibration = np.cos(azimuth) * s + np.sin(azimuth) * y
    assert abs(vibration @ [0.0, 1.0, 0.0]) < 1e-12


def test_a_single_reflection_and_a_depolariser_are_physical(grid):
    pauli = np.array([[[1, 0], [0, 1]], [[1, 0], [0, -1]], [[0, 1], [1, 0]], [[0, -1j], [1j, 0]]])
    basis = np.einsum("iab,jcd->ijacbd", pauli, pauli.conj()).reshape(4, 4, 4, 4)
    m = MODEL.evaluate(*directions(*grid), PLASTIC)
    coherency = 0.25 * np.einsum("...ij,ijab->...ab", m, basis)
    assert np.linalg.eigvalsh(coherency).min() > -1e-13 * m[..., 0, 0].max()


def test_directions_broadcast():
    light, camera = directions(0.3, np.linspace(0.1, 1.0, 5), 0.4)
    together = MODEL.evaluate(light[0], camera, PLASTIC)
    assert together.shape == (5, 4, 4)
    np.testing.assert_array_equal(together[3], MODEL.evaluate(light[0], camera[3], PLASTIC))
