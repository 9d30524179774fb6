"""Chrome balls photographed by other people (PSBox, Xiong et al.): circles and directions from images alone.

They stand out of focus on a stand. Rows of the files count from the bottom, pixels from one; their directions
have y up and z toward the camera. The lens is not known: from far away an outline is a circle.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.highlights import Highlight, find_highlight
from pbrdf.calibration.light_directions import mirrored_rays
from pbrdf.calibration.outline import measure_sphere
from pbrdf.calibration.sphere import Sphere

Float = NDArray[np.float64]
LIGHTS = range(1, 13)
BALL_MM, FAR_PX = 25.0, 1e5
# the limb is blurred over 5 px, and the clicks range over 5.2 and 4.5 px about their circles
CIRCLE_PX = 2.0


@dataclass(frozen=True)
class Probe:
    """A ball of which the photographers clicked the circle, and where it was found."""

    folder: Path
    camera: Camera
    content: dict[str, Any]

    @property
    def ball(self) -> Sphere:
        x, y, z = self.content["centre_mm"]
        return Sphere((x, y, z), BALL_MM)

    def circle(self) -> tuple[float, float, float]:
        """Column and row of the outline's middle, and its radius, px."""
        outline = np.stack(self.camera.project(self.ball.outline()), -1)
        column, row = outline.mean(axis=0)
        return float(column), float(row), float(np.ptp(outline, axis=0).mean() / 2)


@pytest.fixture(scope="module", params=[1, 2])
def probe(real_data: Path, request: pytest.FixtureRequest) -> Probe:
    folder = real_data / f"light-probe/LightProbe-{request.param}"
    image = np.asarray(cv2.imread(str(folder / "ref.JPG"), cv2.IMREAD_GRAYSCALE), np.uint8)
    rows, columns = image.shape
    camera = Camera((FAR_PX, FAR_PX), ((columns - 1) / 2, (rows - 1) / 2), rows, columns)
    return Probe(folder, camera, measure_sphere(image, camera, BALL_MM))


def linear(path: Path) -> Float:
    """Mean of the three colours, the camera's gamma undone."""
    image = np.asarray(cv2.imread(str(path)), np.float64)
    mean: Float = ((image / 255.0) ** 2.2).mean(axis=-1)
    return mean


def test_circles_from_the_images_alone(probe: Probe) -> None:
    column, row_up, radius = np.loadtxt(probe.folder / "circle_data.txt")
    expected = column - 1, probe.camera.rows - row_up, radius
    assert probe.circle() == pytest.approx(expected, abs=CIRCLE_PX)
    assert probe.content["outline_deg"] > 300
    assert "px from the outline" in probe.content["verdict"]


def test_directions_from_the_images_alone(probe: Probe) -> None:
    column, row, radius = probe.circle()
    down, right = np.mgrid[: probe.camera.rows, : probe.camera.columns]
    inside = np.hypot(right - column, down - row) < 0.98 * radius
    found: list[Highlight] = []
    for light in LIGHTS:
        path = probe.folder / f"Image_{light:02d}.JPG"
        found.append(find_highlight(linear(path), inside, saturation=1.0, source=path))
    columns, rows = np.array([[one.column, one.row] for one in found]).T
    _, towards = mirrored_rays(probe.camera, probe.ball, columns, rows)
    theirs = np.loadtxt(probe.folder / "light_directions.txt").T * [1, -1, -1]
    theirs /= np.linalg.norm(theirs, axis=-1, keepdims=True)
    apart = np.rad2deg(np.arccos(np.sum(towards * theirs, axis=-1)))
    assert np.median(apart) < 0.5
    assert apart.max() < 1.2
    # the stated errors of places and centre, as angles at the middle of the ball, are of the right size
    centre_px = FAR_PX / probe.ball.centre_mm[2] * probe.content["standard_errors_mm"]["across"]
    errors = np.hypot([one.error_px for one in found], centre_px)
    stated = np.rad2deg(2 * np.sqrt(2) * errors / radius)
    assert 0.25 < np.sqrt(np.mean(apart**2)) / np.sqrt(np.mean(stated**2)) < 2
