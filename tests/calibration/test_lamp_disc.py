"""The lamp's disc found in an image."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.calibration.lamp_disc import EDGE_PX, lamp_pixels
from pbrdf.errors import InputError

Float = NDArray[np.float64]

SIZE, RADIUS = 61, 14.0
NOISE = 1.0


def distance() -> Float:
    """Of each pixel from the middle of the frame, px."""
    row, column = np.indices((SIZE, SIZE)) - SIZE // 2
    return np.hypot(row, column)


def photograph(level: float = 1000.0, seed: int = 1) -> Float:
    """A lamp with a soft edge before noisy darkness, and its neighbourhood dark."""
    clear = level * np.clip(RADIUS - distance() + 0.5, 0.0, 1.0)
    return clear + np.random.default_rng(seed).normal(0.0, NOISE, clear.shape)


def found(picture: Float) -> NDArray[np.bool_]:
    return lamp_pixels(picture, np.full(picture.shape, NOISE**2), "frames.zarr", "550nm")


def refusal(picture: Float) -> InputError:
    with pytest.raises(InputError) as refused:
        found(picture)
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
    picture = photograph()
    picture[3, 4], picture[SIZE // 2, SIZE // 2] = 1e5, 1e5
    np.testing.assert_array_equal(found(picture), found(photograph()))


def test_a_ghost_beside_the_lamp_is_left_out() -> None:
    picture = photograph()
    picture[2:14, 2:14] += 300.0
    np.testing.assert_array_equal(found(picture), found(photograph()))


def test_saturated_pixels_are_left_out_and_cost_no_neighbours() -> None:
    picture, lamp = photograph(), found(photograph())
    burnt = distance() < 4
    picture[burnt] = np.nan
    np.testing.assert_array_equal(found(picture), lamp & ~burnt)


def test_darkness_is_refused() -> None:
    noise = np.random.default_rng(2).normal(0.0, NOISE, (SIZE, SIZE))
    assert "shows the lamp in no pixel" in refusal(noise).problem


def test_a_lamp_too_small_to_lose_its_edge_is_refused() -> None:
    picture = np.zeros((SIZE, SIZE))
    picture[10:12, 10:12] = 1000.0
    assert "shows the lamp in no pixel" in refusal(picture).problem


def test_a_saturated_lamp_is_refused() -> None:
    picture = photograph()
    picture[distance() < RADIUS - 1.0] = np.nan
    assert "is saturated at every exposure in 100 % of the lamp's pixels" in refusal(picture).problem
