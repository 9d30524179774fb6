"""Chrome balls photographed by other people (PSBox, Xiong et al.): circles and directions from images alone.

Their rows count from the bottom, their pixels from one; their directions have y up and z toward the camera.
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.calibration.highlights import Highlight, find_highlight
from pbrdf.calibration.light_directions import orthographic_directions
from pbrdf.calibration.sphere_circle import Circle, find_circle

Float = NDArray[np.float64]
LIGHTS = range(1, 13)


def probe(real_data: Path, number: int) -> Path:
    return real_data / f"light-probe/LightProbe-{number}"


def outline(folder: Path) -> Circle:
    return find_circle(cv2.imread(str(folder / "ref.JPG"), cv2.IMREAD_GRAYSCALE), source=folder / "ref.JPG")


def linear(path: Path) -> Float:
    """Mean of the three colours, the camera's gamma undone."""
    return np.mean((cv2.imread(str(path)) / 255.0) ** 2.2, axis=-1)


@pytest.mark.parametrize("number", [1, 2])
def test_circles_from_the_images_alone(real_data: Path, number: int) -> None:
    folder = probe(real_data, number)
    column, row_up, radius = np.loadtxt(folder / "circle_data.txt")
    height = cv2.imread(str(folder / "ref.JPG")).shape[0]
    found = outline(folder)
    assert found.column == pytest.approx(column - 1, abs=2)
    assert found.row == pytest.approx(height - row_up, abs=2)
    assert found.radius_px == pytest.approx(radius, abs=2)


@pytest.mark.parametrize("number", [1, 2])
def test_directions_from_the_images_alone(real_data: Path, number: int) -> None:
    folder = probe(real_data, number)
    circle = outline(folder)
    found: list[Highlight] = []
    for light in LIGHTS:
        path = folder / f"Image_{light:02d}.JPG"
        image = linear(path)
        inside = circle.inside((image.shape[0], image.shape[1]), 0.98)
        found.append(find_highlight(image, inside, saturation=1.0, source=path))
    columns, rows = np.array([[one.column, one.row] for one in found]).T
    towards = orthographic_directions(columns, rows, (circle.column, circle.row, circle.radius_px))
    theirs = np.loadtxt(folder / "light_directions.txt").T * [1, -1, -1]
    theirs /= np.linalg.norm(theirs, axis=-1, keepdims=True)
    apart = np.rad2deg(np.arccos(np.sum(towards * theirs, axis=-1)))
    assert np.median(apart) < 0.5
    assert apart.max() < 1.2
    # the stated errors of places and centre, as angles at the middle of the ball, are of the right size
    errors = np.hypot([one.error_px for one in found], circle.error_px)
    stated = np.rad2deg(2 * np.sqrt(2) * errors / circle.radius_px)
    assert 0.25 < np.sqrt(np.mean(apart**2)) / np.sqrt(np.mean(stated**2)) < 2
