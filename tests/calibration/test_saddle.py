"""Corners of a chessboard drawn by integrating over pixels, and what is no corner."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.calibration.saddle import refine_saddles

Float = NDArray[np.float64]
ANGLES = (0.2, 1.9)


def drawn(corner: tuple[float, float], noise: float = 0.0, size: int = 41) -> Float:
    """Two dark and two bright sectors around a corner, averaged over pixels and blurred a little."""
    fine = (np.arange(size * 10) + 0.5) / 10 - 0.5
    x, y = np.meshgrid(fine - corner[0], fine - corner[1])
    sides = [np.cos(angle) * y - np.sin(angle) * x > 0 for angle in ANGLES]
    sharp = np.where(sides[0] == sides[1], 900.0, 50.0)
    blurred = cv2.GaussianBlur(sharp, (0, 0), 8.0)
    picture: Float = blurred.reshape(size, 10, size, 10).mean(axis=(1, 3))
    return picture + np.random.default_rng(4).normal(0, noise, picture.shape)


@pytest.mark.parametrize("corner", [(20.0, 20.0), (20.5, 19.5), (20.31, 19.87)])
def test_a_corner_is_found_to_a_thousandth_of_a_pixel(corner: tuple[float, float]) -> None:
    start = np.array([corner]) + np.array([0.4, -0.3])
    found = refine_saddles(drawn(corner), start, np.array([ANGLES]) + 0.1, 5)
    np.testing.assert_allclose(found[0], corner, atol=0.001)


def test_noise_moves_a_corner_as_the_edges_steepness_says() -> None:
    """An edge of height 850 over two pixels, eleven long: a hundredth of a pixel at noise 50 of 850."""
    corner = (20.31, 19.87)
    found = refine_saddles(drawn(corner, noise=50.0), np.array([corner]), np.array([ANGLES]), 5)
    assert 0.0 < np.hypot(*(found[0] - corner)) < 0.05


def test_squares_may_be_dark_or_bright_and_faint() -> None:
    corner = (20.31, 19.87)
    for picture in (-drawn(corner), 7000.0 + 0.01 * drawn(corner)):
        found = refine_saddles(picture, np.array([corner]) + 0.3, np.array([ANGLES]), 5)
        np.testing.assert_allclose(found[0], corner, atol=0.001)


def test_what_is_no_corner_stays_where_it_was() -> None:
    starts = np.array([[20.2, 20.4], [2.0, 20.0], [39.0, 20.0]])
    edges = np.tile(ANGLES, (3, 1))
    flat = np.full((41, 41), 7.0)
    np.testing.assert_allclose(refine_saddles(flat, starts, edges, 5), starts, atol=1e-9)
    found = refine_saddles(drawn((20.2, 20.4)), starts, edges, 5)
    np.testing.assert_array_equal(found[1:], starts[1:])
