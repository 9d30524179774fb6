"""The measurement matrix: rows, rank, condition, and the harmonics of air."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.optics.mueller import linear_polariser, linear_retarder
from pbrdf.optics.polarimeter import Polarimeter

Float = NDArray[np.float64]
QUARTER = np.pi / 2


def rotating(count: int, step_deg: float, ratio: float = 5.0, *, analyser: float = 0.0) -> Float:
    """Retarders turned together, the analyser's `ratio` times as far; polarisers fixed. Radians."""
    slow = np.deg2rad(step_deg) * np.arange(count)
    return np.stack([0 * slow, slow, ratio * slow, 0 * slow + analyser], axis=-1)


def noise_gain(w: Float) -> float:
    """States times the trace of (WᵀW)⁻¹: noise of all elements together, states for states."""
    return float(len(w) * np.trace(np.linalg.inv(w.T @ w)))


def test_an_intensity_is_the_first_element_of_the_product_of_all_elements() -> None:
    random = np.random.default_rng(1)
    states, zeros = random.uniform(-np.pi, np.pi, (40, 4)), random.uniform(-0.1, 0.1, 4)
    polarimeter = Polarimeter(1.4, 1.7, tuple(zeros))
    sample = random.normal(size=(4, 4))
    expected = [
        (
            linear_polariser(ap)
            @ linear_retarder(1.7, ar)
            @ sample
            @ linear_retarder(1.4, gr)
            @ linear_polariser(gp)
        )[0, 0]
        for gp, gr, ar, ap in states + zeros
    ]
    np.testing.assert_allclose(polarimeter.measurement_matrix(states) @ sample.ravel(), expected, atol=1e-14)


def test_rows_are_the_outer_products_of_analyser_and_generator() -> None:
    states = rotating(36, 5)
    polarimeter = Polarimeter(1.5, 1.6, (0.1, -0.2, 0.05, 0.02))
    w = polarimeter.measurement_matrix(states)
    for row, a, g in zip(w, polarimeter.analysed(states), polarimeter.generated(states), strict=True):
        np.testing.assert_allclose(row.reshape(4, 4), np.outer(a, g), atol=1e-15)


def test_generated_light_is_fully_polarised_and_half_as_bright() -> None:
    g = Polarimeter(1.5, 1.6).generated(rotating(36, 5))
    np.testing.assert_allclose(g[:, 0], 0.5)
    np.testing.assert_allclose(np.linalg.norm(g[:, 1:], axis=-1), g[:, 0], atol=1e-15)


@pytest.mark.parametrize("delta", [QUARTER, 1.45, 2.2])
def test_generator_and_analyser_vectors_as_written_out(delta: float) -> None:
    """Chenault et al. 1992, first polariser along x."""
    states = rotating(36, 5, analyser=0.3)
    slow, fast = states[:, 1], states[:, 2]
    a, b = np.cos(delta / 2) ** 2, np.sin(delta / 2) ** 2
    one = np.ones_like(slow)
    generated = [one, a + b * np.cos(4 * slow), b * np.sin(4 * slow), np.sin(delta) * np.sin(2 * slow)]
    turned = 4 * fast - 2 * 0.3
    analysed = [
        one,
        a * np.cos(0.6) + b * np.cos(turned),
        a * np.sin(0.6) + b * np.sin(turned),
        -np.sin(delta) * np.sin(2 * fast - 2 * 0.3),
    ]
    polarimeter = Polarimeter(delta, delta)
    np.testing.assert_allclose(polarimeter.generated(states), 0.5 * np.stack(generated, axis=-1), atol=1e-14)
    np.testing.assert_allclose(polarimeter.analysed(states), 0.5 * np.stack(analysed, axis=-1), atol=1e-14)


@pytest.mark.parametrize("analyser", [0.0, QUARTER], ids=["parallel", "crossed"])
def test_thirty_six_states_over_half_a_turn_determine_all_elements(analyser: float) -> None:
    w = Polarimeter(QUARTER, QUARTER).measurement_matrix(rotating(36, 5, analyser=analyser))
    assert np.linalg.matrix_rank(w) == 16
    assert np.linalg.cond(w) == pytest.approx(13.05, abs=0.005)
    assert noise_gain(w) == pytest.approx(7056, abs=0.5)


def test_noise_of_each_element_over_half_a_turn() -> None:
    w = Polarimeter(QUARTER, QUARTER).measurement_matrix(rotating(36, 5))
    spread = np.sqrt(np.diag(np.linalg.inv(w.T @ w))).reshape(4, 4)
    expected = [
        [2, 3.27, 3.27, 1.63],
        [3.27, 5.33, 5.33, 2.67],
        [3.27, 5.33, 5.33, 2.67],
        [1.63, 2.67, 2.67, 1.33],
    ]
    np.testing.assert_allclose(spread, expected, atol=0.005)


@pytest.mark.parametrize(("count", "rank"), [(30, 12), (32, 14), (36, 14), (40, 12), (61, 16), (72, 16)])
def test_over_a_whole_turn_some_counts_lose_elements(count: int, rank: int) -> None:
    w = Polarimeter(QUARTER, QUARTER).measurement_matrix(rotating(count, 360 / count))
    assert np.linalg.matrix_rank(w) == rank


@pytest.mark.parametrize(("delta_deg", "condition"), [(120, 4.18), (128, 3.40), (132, 3.77), (135, 4.13)])
def test_other_retarders_are_better_conditioned(delta_deg: float, condition: float) -> None:
    delta = np.deg2rad(delta_deg)
    w = Polarimeter(delta, delta).measurement_matrix(rotating(36, 5))
    assert np.linalg.cond(w) == pytest.approx(condition, abs=0.006)


def test_four_by_six_states_are_as_good() -> None:
    """The states of Moon et al. 2025."""
    generator, analyser = np.meshgrid([30, -45, 60, -90], [0, 30, 60, 90, 120, 150], indexing="ij")
    zero = np.zeros(24)
    states = np.deg2rad(np.stack([zero, generator.ravel(), analyser.ravel(), zero], axis=-1))
    w = Polarimeter(QUARTER, QUARTER).measurement_matrix(states)
    assert np.linalg.matrix_rank(w) == 16
    assert np.linalg.cond(w) == pytest.approx(13.10, abs=0.005)
    assert noise_gain(w) == pytest.approx(7274, abs=0.5)


def test_harmonics_of_air() -> None:
    """Product of the two vectors above, gathered by harmonics of the slow angle."""
    delta1, delta2, e3, e4, p = 1.48, 1.61, 0.03, -0.02, 0.015
    theta = np.deg2rad(5.0) * np.arange(36)
    states = np.stack([0 * theta, theta, 5 * theta, 0 * theta], axis=-1)
    w = Polarimeter(delta1, delta2, (0.0, e3, e4, p)).measurement_matrix(states)
    a1, a2 = np.cos(delta1 / 2) ** 2, np.cos(delta2 / 2) ** 2
    b1, b2 = 1 - a1, 1 - a2
    both = 0.5 * np.sin(delta1) * np.sin(delta2)
    signal = (
        1
        + a1 * a2 * np.cos(2 * p)
        + b1 * a2 * np.cos(4 * theta + 4 * e3 - 2 * p)
        + a1 * b2 * np.cos(20 * theta + 4 * e4 - 2 * p)
        + b1 * b2 * np.cos(16 * theta - 4 * e3 + 4 * e4 - 2 * p)
        - both * np.cos(8 * theta - 2 * e3 + 2 * e4 - 2 * p)
        + both * np.cos(12 * theta + 2 * e3 + 2 * e4 - 2 * p)
    )
    np.testing.assert_allclose(4 * w @ np.eye(4).ravel(), signal, atol=1e-14)


def test_polarisers_that_leak_fade_what_turns() -> None:
    """Both let through e of what they should stop: contrast (1 − e) / (1 + e) each."""
    states, e = rotating(36, 5), 0.02
    pure = 4 * Polarimeter(1.5, 1.6).measurement_matrix(states) @ np.eye(4).ravel()
    leaking = 4 * Polarimeter(1.5, 1.6, extinction=e).measurement_matrix(states) @ np.eye(4).ravel()
    np.testing.assert_allclose(leaking, (1 + e) ** 2 + (1 - e) ** 2 * (pure - 1), atol=1e-14)


def test_air_does_not_tell_which_axes_are_fast() -> None:
    """Both retarders 90° off: the same signal from air, s3 turned over in every sample."""
    states = rotating(36, 5)
    w = Polarimeter(1.5, 1.6).measurement_matrix(states)
    swapped = Polarimeter(1.5, 1.6, (0.0, QUARTER, QUARTER, 0.0)).measurement_matrix(states)
    flip = np.diag([1.0, 1.0, 1.0, -1.0])
    sample = np.random.default_rng(3).normal(size=(4, 4))
    np.testing.assert_allclose(w @ np.eye(4).ravel(), swapped @ np.eye(4).ravel(), atol=1e-14)
    np.testing.assert_allclose(w @ (flip @ sample @ flip).ravel(), swapped @ sample.ravel(), atol=1e-14)
