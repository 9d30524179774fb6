"""The circle of a ball in a photograph, with mirror images inside and clutter outside."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.calibration.sphere_circle import find_circle
from pbrdf.errors import InputError

Float = NDArray[np.float64]
ROWS, COLUMNS = np.mgrid[:300, :340].astype(np.float64)


def disc(column: float, row: float, radius: float) -> Float:
    return np.clip(radius + 0.5 - np.hypot(COLUMNS - column, ROWS - row), 0, 1)


def scene(seed: int = 0) -> Float:
    """A dark ball before a background of two tones, with bright lamps, a ring and a stand in it."""
    draw = np.random.default_rng(seed)
    background = np.where(COLUMNS < 150, 90.0, 140.0)
    ball = disc(163.4, 141.7, 104.2)
    image = background * (1 - ball) + 20 * ball
    for column, row, radius in ((140, 100, 9), (200, 150, 14), (150, 180, 6)):
        image += 220 * disc(column, row, radius)
    image += 60 * (disc(163, 141, 70) - disc(163, 141, 68))
    image[235:, 130:200] = 60
    return image + draw.normal(0, 2, image.shape)


def test_outline_is_found_among_brighter_mirror_images() -> None:
    found = find_circle(scene())
    assert (found.column, found.row, found.radius_px) == pytest.approx((163.4, 141.7, 104.2), abs=0.2)
    assert 0.85 < found.cover < 1
    assert found.error_px < 0.2


def test_the_same_photograph_gives_the_same_circle() -> None:
    assert find_circle(scene(3)) == find_circle(scene(3))


def test_inside_is_the_disc() -> None:
    found = find_circle(scene())
    share = found.inside((300, 340)).sum() / (np.pi * found.radius_px**2)
    assert share == pytest.approx(1, abs=0.005)
    assert found.inside((300, 340), 0.5).sum() == pytest.approx(
        0.25 * found.inside((300, 340)).sum(), rel=0.01
    )


@pytest.mark.parametrize("what", ["nothing", "noise", "chessboard", "half a ball"])
def test_no_circle_is_refused(what: str) -> None:
    draw = np.random.default_rng(2)
    image = {
        "nothing": np.zeros((300, 340)),
        "noise": draw.normal(0, 1, (300, 340)),
        "chessboard": ((COLUMNS // 30 + ROWS // 30) % 2) * 100 + draw.normal(0, 1, (300, 340)),
        "half a ball": np.where(ROWS < 140, scene(), 20.0 + draw.normal(0, 1, (300, 340))),
    }[what]
    with pytest.raises(InputError, match="outline"):
        find_circle(image)


def test_an_image_that_is_none_is_refused() -> None:
    for image in (np.zeros((300, 340, 3)), np.zeros((8, 8)), np.full((300, 340), np.nan)):
        with pytest.raises(InputError, match="image"):
            find_circle(image, source="ball.png")
