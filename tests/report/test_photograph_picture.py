"""Photographs as they are drawn: sizes, places, greys."""

from __future__ import annotations

import numpy as np
import pytest

from pbrdf.report.calibration_parts import with_error
from pbrdf.report.figures import number
from pbrdf.report.photograph_picture import exaggeration, grey


def test_a_small_photograph_is_drawn_pixel_by_pixel() -> None:
    drawn = grey(np.arange(12.0).reshape(3, 4), 10)
    assert drawn.rgba.shape == (3, 4, 4)
    assert drawn.extent == (-0.5, 3.5, 2.5, -0.5)
    assert drawn.block == 1


def test_a_large_one_is_drawn_in_blocks_and_marks_keep_their_places() -> None:
    image = np.zeros((101, 203))
    image[40:44, 80:84] = 1.0
    drawn = grey(image, 51)
    assert drawn.block == 4
    left, right, bottom, top = drawn.extent
    assert (left, top) == (-0.5, -0.5)
    assert ((right - left) / drawn.rgba.shape[1], (bottom - top) / drawn.rgba.shape[0]) == (4.0, 4.0)
    row, column = np.argwhere(drawn.rgba[..., 0] == 255)[0]
    assert (top + 4 * row, left + 4 * column) == (39.5, 79.5)


def test_a_window_keeps_the_pixels_of_the_photograph() -> None:
    drawn = grey(np.random.default_rng(1).uniform(size=(50, 60)), 100, (slice(10, 30), slice(20, 50)))
    assert drawn.extent == (19.5, 49.5, 29.5, 9.5)


def test_an_even_photograph_has_a_grey() -> None:
    assert grey(np.full((5, 5), 7.0), 10).rgba.shape == (5, 5, 4)


@pytest.mark.parametrize(
    ("typical", "wanted", "factor"), [(0.04, 9.6, 200.0), (1.0, 1.0, 1.0), (3.0, 1.0, 0.2), (0.0, 1.0, 1.0)]
)
def test_exaggeration_is_a_round_number(typical: float, wanted: float, factor: float) -> None:
    assert exaggeration(typical, wanted) == pytest.approx(factor)


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (3210.187, 12.48, "3210"),
        (96.4057, 6.43, "96.4"),
        (-0.79966, 0.0028, "−0.7997"),
        (0.25384, 3.5e-5, "0.25384"),
        (5896405.5, 266.2, "5.89641·10⁶"),
        (0.0004, 0.005, "0.0004"),
        (87.91104, 0.00997, "87.911"),
    ],
)
def test_a_value_is_told_to_the_second_digit_of_its_error(value: float, error: float, text: str) -> None:
    shown, _ = with_error(value, error)
    assert number(shown.value, shown.digits) == text
