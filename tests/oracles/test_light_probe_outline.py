"""Real chrome spheres, out of focus on a stand, against the circles that their photographers clicked."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.outline import fit_outline, measure_sphere

# the limb is blurred over 5 px, and the clicks range over 5.2 and 4.5 px about their circles
CIRCLE_PX = 2.0


@pytest.mark.parametrize("probe", [1, 2])
def test_the_outline_of_a_chrome_sphere_is_the_clicked_circle(real_data: Path, probe: int) -> None:
    folder = real_data / "light-probe" / f"LightProbe-{probe}"
    image = cv2.imread(str(folder / "ref.JPG"), cv2.IMREAD_GRAYSCALE)
    rows, columns = image.shape
    # the lens is not known; from far away an outline is a circle
    camera = Camera((1e5, 1e5), ((columns - 1) / 2, (rows - 1) / 2), rows, columns)
    fit = fit_outline(image, camera, 25.0)
    outline = np.stack(camera.project(fit.sphere.outline()), -1)
    x, y, r = np.loadtxt(folder / "circle_data.txt")
    # theirs counts pixels from one, rows from the bottom
    assert outline.mean(0) == pytest.approx([x - 1, rows - y], abs=CIRCLE_PX)
    assert np.ptp(outline, axis=0).mean() / 2 == pytest.approx(r, abs=CIRCLE_PX)
    assert fit.outline_deg > 300
    assert "px from the outline" in measure_sphere(image, camera, 25.0)["verdict"]
