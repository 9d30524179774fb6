"""The highlight's place: held against the shortest way of light, in photographs traced ray by ray."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.highlights import find_highlight
from pbrdf.calibration.sphere import Sphere
from pbrdf.errors import InputError

Float = NDArray[np.float64]
BALL = Sphere((1.5, -2.0, 1001.0), 25.0)


def light_at(angle_deg: float) -> Float:
    angle = np.deg2rad(angle_deg)
    return np.array([800.0 * np.sin(angle), -30.0, 1000.0 - 800.0 * np.cos(angle)])


def spot(column: float, row: float, radius: float, value: float, size: int = 101) -> Float:
    """A disc with a rim one pixel wide."""
    rows, columns = np.mgrid[:size, :size]
    return value * np.clip(radius + 0.5 - np.hypot(columns - column, rows - row), 0, 1)


DISC = np.hypot(*(np.mgrid[:101, :101] - 50.0)) < 45


@pytest.mark.parametrize(
    ("focal_px", "gain", "rms_px"),
    [(8000.0, 2000.0, 0.05), (40_000.0, 2000.0, 0.05), (40_000.0, 200_000.0, 0.1)],
    ids=["small", "broad", "clipped"],
)
def test_place_is_that_of_the_shortest_way(
    focal_px: float,
    gain: float,
    rms_px: float,
    photograph: Callable[..., Float],
    shortest_path_point: Callable[[Sphere, Float], Float],
) -> None:
    draw = np.random.default_rng(5)
    apart, errors = [], []
    for angle in np.arange(20.0, 141.0, 20.0):
        light = light_at(angle)
        place = shortest_path_point(BALL, light)
        first = [int(focal_px * part / place[2]) - 30 for part in place[:2]]
        window = Camera((focal_px, focal_px), (-float(first[0]), -float(first[1])), 61, 61)
        electrons = gain * photograph(window, BALL, light, 12.7, samples=12) + 20
        frame = draw.poisson(electrons) + draw.normal(0, 5, electrons.shape)
        # the window is a part of the ball's picture; a blob of 20 px is a small share of the whole
        ball = np.ones((261, 261), dtype=bool)
        found = find_highlight(np.pad(frame, 100, constant_values=20), ball, saturation=10_000.0, noise=7.0)
        assert found.clipped == (gain > 10_000)
        column, row = window.project(place)
        apart.append([found.column - 100 - column, found.row - 100 - row])
        errors.append(found.error_px)
    assert np.sqrt(np.mean(np.square(apart))) < rms_px
    assert np.abs(apart / np.array(errors)[:, np.newaxis]).max() < 4


def test_where_the_grid_hides_the_place_the_error_says_so() -> None:
    """A mirror image narrower than a pixel, and a thin clipped one."""
    narrow = np.full((101, 101), 10.0)
    narrow[55:58, 40] += 900
    assert 0.2 < find_highlight(narrow, DISC).error_px < 0.4
    thin = np.full((101, 101), 10.0)
    thin[45:60, 40:42] += 9000
    assert 1.5 < find_highlight(thin, DISC, saturation=1000.0).error_px < 3


def test_weaker_mirror_images_and_hot_pixels_do_not_move_the_place() -> None:
    clean = 10 + spot(40.3, 61.8, 6, 900)
    crowded = clean + spot(70, 30, 4, 500) + spot(25, 40, 2, 900)
    crowded[20, 50] = 60_000
    alone, among = (find_highlight(image, DISC) for image in (clean, crowded))
    assert (among.column, among.row) == pytest.approx((alone.column, alone.row), abs=1e-9)
    assert (alone.column, alone.row) == pytest.approx((40.3, 61.8), abs=0.02)


def test_place_of_a_clipped_blob_is_that_of_its_saturated_part() -> None:
    streak = 10 + spot(40.0, 60.0, 6, 5000)
    streak[58:63, 40:80] += 300.0
    found = find_highlight(streak, DISC, saturation=1000.0)
    assert (found.column, found.row) == pytest.approx((40.0, 60.0), abs=0.1)
    assert found.clipped


def test_error_tells_that_a_streak_makes_the_place_a_matter_of_choice() -> None:
    round_one = 10 + spot(40.0, 60.0, 6, 900)
    streak = round_one.copy()
    streak[58:63, 40:70] += 300.0
    assert find_highlight(round_one, DISC).error_px < 0.06
    found = find_highlight(streak, DISC)
    assert found.error_px > 0.5 * np.hypot(found.column - 40, found.row - 60)
    assert found.error_px > 1.0


@pytest.mark.parametrize("size", [3, 200])
def test_place_is_as_far_off_as_the_error_says(size: int) -> None:
    draw = np.random.default_rng(size)
    apart, claimed = [], []
    for column, row in 50 + draw.uniform(-10, 10, (60, 2)):
        clean = 10 + spot(column, row, np.sqrt(size / np.pi), 400)
        found = find_highlight(clean + draw.normal(0, 8, clean.shape), DISC, noise=8.0)
        apart.append([found.column - column, found.row - row])
        claimed.append(found.error_px)
    rms = np.sqrt(np.mean(np.square(apart)))
    assert rms < np.median(claimed) < 6 * rms
    assert np.median(claimed) < 0.1


def refusal(image: Float, **others: object) -> str:
    with pytest.raises(InputError) as caught:
        find_highlight(image, DISC, source="angle 041.00", **others)  # type: ignore[arg-type]
    assert "angle 041.00" in str(caught.value)
    return str(caught.value)


def test_refusals_name_what_is_wrong() -> None:
    noise = np.random.default_rng(1).normal(10, 3, (101, 101))
    assert "none is there" in refusal(noise)
    assert "none is there" in refusal(np.full((101, 101), 7.0))
    hot = noise.copy()
    hot[50, 50] = 5000
    assert "1 hot pixels passed over" in refusal(hot)
    two = noise + spot(30, 50, 5, 900) + spot(70, 50, 5, 800)
    assert "equally bright" in refusal(two)
    assert "equally bright" in refusal(two * 10, saturation=3000.0)
    close = noise + spot(45, 50, 5, 900) + spot(57, 50, 5, 900) + spot(51, 50, 6, 300)
    assert "equally bright" in refusal(close)
    assert "outline" in refusal(noise + spot(50, 5, 5, 900))
    assert "none is there" in refusal(noise + spot(2, 2, 1.5, 900))
    assert "expose less" in refusal(noise + spot(50, 50, 18, 900))
    broken = noise + spot(50, 50, 5, 900)
    broken[50, 50] = np.nan
    assert "not finite" in refusal(broken)
    assert "shape" in refusal(noise[:50])
