"""The matrix that the pixels of the lamp's disc agree on."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.optics.mueller import linear_polariser, linear_retarder
from pbrdf.reconstruction.lamp import lamp_matrix

Float = NDArray[np.float64]

SIZE, RADIUS = 61, 14.0


def distance() -> Float:
    """Of each pixel from the middle of the frame, px."""
    row, column = np.indices((SIZE, SIZE)) - SIZE // 2
    return np.hypot(row, column)


def image(matrix: Float, sigma: float) -> tuple[Float, Float]:
    """A matrix in every pixel, with uncorrelated noise; elements and variances (16, rows, columns)."""
    noise = np.random.default_rng(3).normal(0.0, sigma, (16, SIZE, SIZE))
    return matrix.reshape(16, 1, 1) + noise, np.full((16, SIZE, SIZE), sigma**2)


def test_the_mean_is_the_matrix_whatever_its_scale() -> None:
    truth = linear_retarder(0.7, 0.3) + linear_polariser(1.1)
    mueller, variance = image(50.0 * truth, 0.0)
    measured = lamp_matrix(mueller, variance, distance() < RADIUS, (0.0, 0.0))
    np.testing.assert_allclose(measured.mueller, truth / truth[0, 0], atol=1e-12)
    assert measured.m00_dn_per_s == pytest.approx(50.0 * truth[0, 0])
    assert measured.pixels == np.count_nonzero(distance() < RADIUS)


def test_frames_turn_about_the_beam() -> None:
    """A polariser along the module's x stands at −α when x goes on by α; both frames turn alike."""
    mueller, variance = image(linear_polariser(0.0), 0.0)
    measured = lamp_matrix(mueller, variance, distance() < RADIUS, (0.4, 0.4))
    np.testing.assert_allclose(measured.mueller, 2 * linear_polariser(-0.4), atol=1e-12)


@pytest.mark.parametrize("turn", [(0.0, 0.0), (np.pi / 2, np.pi / 2), (0.4, -0.9)])
def test_variances_and_scatter_tell_the_same_error(turn: tuple[float, float]) -> None:
    """Uncorrelated noise of 1 % over 3721 pixels: both estimates agree to 4 standard errors of a scatter."""
    truth = np.eye(4) + linear_polariser(0.2)
    mueller, variance = image(truth, 0.01)
    everywhere = np.ones((SIZE, SIZE), np.bool_)
    measured = lamp_matrix(mueller, variance, everywhere, turn)
    by_scatter = measured.scatter / np.sqrt(measured.pixels)
    np.testing.assert_allclose(
        by_scatter.ravel()[1:], measured.standard_error.ravel()[1:], rtol=4 / np.sqrt(2 * SIZE**2)
    )
    assert measured.standard_error[0, 0] == by_scatter[0, 0] == 0.0
