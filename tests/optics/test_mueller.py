"""Elements as the textbooks know them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.optics.mueller import circular_polariser, linear_polariser, linear_retarder, rotator, turned

Float = NDArray[np.float64]

ANGLES = np.random.default_rng(1).uniform(-np.pi, np.pi, 50)
RETARDANCES = np.random.default_rng(2).uniform(0.0, 2 * np.pi, 50)
ALONG_X = np.array([1.0, 1.0, 0.0, 0.0])


def stokes_of_field(x: Float, y: Float) -> Float:
    """Stokes vector of a field over one period, for an observer with x right and y up who looks into it."""
    rotation = np.mean(x * np.roll(y, -1) - y * np.roll(x, -1)) / np.sin(2 * np.pi / len(x))
    counter_clockwise = 2 * rotation
    return np.array(
        [
            2 * np.mean(x**2 + y**2),
            2 * np.mean(x**2 - y**2),
            4 * np.mean(x * y),
            -counter_clockwise,
        ]
    )


def test_malus_law() -> None:
    passed = (linear_polariser(ANGLES) @ ALONG_X)[..., 0]
    np.testing.assert_allclose(passed, np.cos(ANGLES) ** 2, atol=1e-15)


def test_crossed_polarisers_that_leak_pass_twice_their_extinction() -> None:
    e = 1e-3
    parallel, crossed = (linear_polariser(angle, e) @ linear_polariser(0.0, e) for angle in (0.0, np.pi / 2))
    np.testing.assert_allclose(crossed[0, 0] / parallel[0, 0], 2 * e / (1 + e**2), atol=1e-15)


def test_what_passes_a_leaking_polariser_along_and_across_stays_as_polarised() -> None:
    """A diattenuator without depolarisation: the determinant test s0² = s1² + s2² + s3² holds on."""
    circular = np.array([1.0, 0.0, 0.0, 1.0])
    s0, *polarised = linear_polariser(0.3, 0.01) @ circular
    np.testing.assert_allclose(np.linalg.norm(polarised), s0, rtol=1e-14)


def test_crossed_polarisers_pass_nothing() -> None:
    crossed = linear_polariser(ANGLES + np.pi / 2) @ linear_polariser(ANGLES)
    np.testing.assert_allclose(crossed, 0.0, atol=1e-15)


def test_a_polariser_passes_half_of_unpolarised_light_along_its_axis() -> None:
    out = linear_polariser(ANGLES)[..., 0]
    expected = 0.5 * np.stack(
        [np.ones_like(ANGLES), np.cos(2 * ANGLES), np.sin(2 * ANGLES), 0 * ANGLES], axis=-1
    )
    np.testing.assert_allclose(out, expected, atol=1e-15)


def test_a_frame_turned_onto_the_vibration_sees_it_along_x() -> None:
    vibration = np.stack([np.ones_like(ANGLES), np.cos(2 * ANGLES), np.sin(2 * ANGLES), 0 * ANGLES], axis=-1)
    seen = (rotator(ANGLES) @ vibration[..., None])[..., 0]
    np.testing.assert_allclose(seen, np.broadcast_to(ALONG_X, seen.shape), atol=1e-15)


def test_from_a_frame_at_45_degrees_x_lies_at_minus_45() -> None:
    np.testing.assert_allclose(rotator(np.pi / 4) @ ALONG_X, [1.0, 0.0, -1.0, 0.0], atol=1e-15)


def test_turns_add() -> None:
    np.testing.assert_allclose(rotator(ANGLES / 2) @ rotator(ANGLES / 2), rotator(ANGLES), atol=1e-15)
    np.testing.assert_allclose(
        rotator(ANGLES) @ rotator(ANGLES[::-1]), rotator(ANGLES + ANGLES[::-1]), atol=1e-14
    )


def test_a_frame_upside_down_is_the_same_frame() -> None:
    np.testing.assert_allclose(rotator(ANGLES + np.pi), rotator(ANGLES), atol=1e-14)


def test_a_turned_element_equals_one_built_at_that_angle() -> None:
    np.testing.assert_allclose(turned(linear_polariser(), ANGLES), linear_polariser(ANGLES), atol=1e-15)
    np.testing.assert_allclose(
        turned(linear_retarder(0.7, 0.2), ANGLES), linear_retarder(0.7, 0.2 + ANGLES), atol=1e-14
    )


@pytest.mark.parametrize(("angle", "handedness"), [(np.pi / 4, 1.0), (-np.pi / 4, -1.0)])
def test_a_quarter_wave_at_45_degrees_makes_linear_light_circular(angle: float, handedness: float) -> None:
    """Right circular turns clockwise to an observer who looks into the beam: s3 > 0."""
    phase = np.linspace(0.0, 2 * np.pi, 24, endpoint=False)
    along_fast = np.cos(angle) * np.cos(phase)
    # the slow component comes a quarter of a period later
    along_slow = -np.sin(angle) * np.cos(phase - np.pi / 2)
    x = np.cos(angle) * along_fast - np.sin(angle) * along_slow
    y = np.sin(angle) * along_fast + np.cos(angle) * along_slow
    expected = [1.0, 0.0, 0.0, handedness]
    np.testing.assert_allclose(stokes_of_field(x, y), expected, atol=1e-14)
    np.testing.assert_allclose(linear_retarder(np.pi / 2, angle) @ ALONG_X, expected, atol=1e-15)


def test_a_retarder_does_to_a_field_what_its_matrix_says() -> None:
    phase = np.linspace(0.0, 2 * np.pi, 24, endpoint=False)
    for delta, angle in zip(RETARDANCES[:20], ANGLES[:20], strict=True):
        along_fast = np.cos(angle) * np.cos(phase)
        along_slow = -np.sin(angle) * np.cos(phase - delta)
        x = np.cos(angle) * along_fast - np.sin(angle) * along_slow
        y = np.sin(angle) * along_fast + np.cos(angle) * along_slow
        np.testing.assert_allclose(linear_retarder(delta, angle) @ ALONG_X, stokes_of_field(x, y), atol=1e-13)


def test_a_turned_retarder_equals_its_explicit_matrix() -> None:
    c, s = np.cos(2 * ANGLES), np.sin(2 * ANGLES)
    k, q = np.cos(RETARDANCES), np.sin(RETARDANCES)
    zero, one = np.zeros_like(c), np.ones_like(c)
    rows = [
        [one, zero, zero, zero],
        [zero, c * c + k * s * s, (1 - k) * c * s, -q * s],
        [zero, (1 - k) * c * s, s * s + k * c * c, q * c],
        [zero, q * s, -q * c, k],
    ]
    explicit = np.moveaxis(np.array(rows), -1, 0)
    np.testing.assert_allclose(linear_retarder(RETARDANCES, ANGLES), explicit, atol=1e-14)


def test_a_retarder_and_the_same_one_crossed_cancel() -> None:
    both = linear_retarder(RETARDANCES, ANGLES) @ linear_retarder(RETARDANCES, ANGLES + np.pi / 2)
    np.testing.assert_allclose(both, np.broadcast_to(np.eye(4), both.shape), atol=1e-14)


def test_circular_polarisers_pass_their_own_hand_only() -> None:
    right, left = circular_polariser(right=True), circular_polariser(right=False)
    np.testing.assert_allclose(right @ [1.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 1.0])
    np.testing.assert_allclose(left @ [1.0, 0.0, 0.0, -1.0], [1.0, 0.0, 0.0, -1.0])
    np.testing.assert_allclose(right @ left, 0.0)
    np.testing.assert_allclose(right @ right, right)


def test_angles_and_retardances_broadcast() -> None:
    assert linear_retarder(RETARDANCES[:3], ANGLES[:4, None]).shape == (4, 3, 4, 4)
    assert linear_retarder(0.3, 0.1).shape == (4, 4)
    assert linear_polariser(ANGLES.reshape(5, 10)).shape == (5, 10, 4, 4)
