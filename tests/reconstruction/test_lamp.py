"""The lamp's disc found in an image, and the matrix that its pixels agree on."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.optics.mueller import linear_polariser, linear_retarder
from pbrdf.reconstruction.lamp import EDGE_PX, lamp_matrix, lamp_pixels

Float = NDArray[np.float64]

SIZE, RADIUS = 61, 14.0
NOISE = 1.0


def distance() -> Float:
    """Of each pixel from the middle of the frame, px."""
    row, column = np.indices((SIZE, SIZE)) - SIZE // 2
    return np.hypot(row, column)


def photograph(level: float = 1000.0, seed: int = 1) -> Float:
    """M00 of a lamp with a soft edge before noisy darkness, and its neighbourhood dark."""
    clear = level * np.clip(RADIUS - distance() + 0.5, 0.0, 1.0)
    return clear + np.random.default_rng(seed).normal(0.0, NOISE, clear.shape)


def found(m00: Float) -> NDArray[np.bool_]:
    return lamp_pixels(m00, np.full(m00.shape, NOISE**2), "frames.zarr", "550nm")


def refusal(m00: Float) -> InputError:
    with pytest.raises(InputError) as refused:
        found(m00)
    assert (refused.value.source, refused.value.field) == ("frames.zarr", "550nm")
    return refused.value


def test_the_disc_is_found_without_its_edge() -> None:
    lamp = found(photograph())
    assert lamp[distance() < RADIUS - 2 * EDGE_PX].all()
    assert not lamp[distance() > RADIUS - EDGE_PX].any()


@pytest.mark.parametrize("level", [300.0, 1e6])
def test_the_disc_is_the_same_however_bright_it_is(level: float) -> None:
    np.testing.assert_array_equal(found(photograph(level)), found(photograph()))


def test_a_hot_pixel_is_not_the_lamp() -> None:
    m00 = photograph()
    m00[3, 4], m00[SIZE // 2, SIZE // 2] = 1e5, 1e5
    np.testing.assert_array_equal(found(m00), found(photograph()))


def test_a_ghost_beside_the_lamp_is_left_out() -> None:
    m00 = photograph()
    m00[2:14, 2:14] += 300.0
    np.testing.assert_array_equal(found(m00), found(photograph()))


def test_saturated_pixels_are_left_out_and_cost_no_neighbours() -> None:
    m00, lamp = photograph(), found(photograph())
    burnt = distance() < 4
    m00[burnt] = np.nan
    np.testing.assert_array_equal(found(m00), lamp & ~burnt)


def test_darkness_is_refused() -> None:
    noise = np.random.default_rng(2).normal(0.0, NOISE, (SIZE, SIZE))
    assert "shows the lamp in no pixel" in refusal(noise).problem


def test_a_lamp_too_small_to_lose_its_edge_is_refused() -> None:
    m00 = np.zeros((SIZE, SIZE))
    m00[10:12, 10:12] = 1000.0
    assert "shows the lamp in no pixel" in refusal(m00).problem


def test_a_saturated_lamp_is_refused() -> None:
    m00 = photograph()
    m00[distance() < RADIUS - 1.0] = np.nan
    assert "is saturated at every exposure in 100 % of the lamp's pixels" in refusal(m00).problem


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
