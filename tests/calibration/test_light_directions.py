"""The mirror law on a ball, by Fermat's principle and by its own inverse."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.light_directions import (
    highlight_pixels,
    highlight_points,
    mirrored_rays,
)
from pbrdf.calibration.sphere import Sphere
from pbrdf.errors import InputError

Float = NDArray[np.float64]
BALL = Sphere((11.0, -7.0, 990.0), 25.0)
CAMERA = Camera((8000.0, 8000.0), (230.3, 229.6), 460, 460, (0.1, -0.05, 0.001, -0.001, 0.0))


def lights() -> Float:
    draw = np.random.default_rng(8)
    directions = draw.normal(size=(40, 3))
    directions[:, 2] -= 1
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    every = BALL.centre_mm + draw.uniform(60, 2000, (40, 1)) * directions
    return every[directions[:, 2] < 0.7]


def test_light_takes_the_shortest_way(shortest_path_point: Callable[[Sphere, Float], Float]) -> None:
    expected = [shortest_path_point(BALL, light) for light in lights()]
    np.testing.assert_allclose(highlight_points(BALL, lights()), expected, atol=1e-4)


def test_the_mirrored_ray_leads_back_to_the_light() -> None:
    columns, rows = highlight_pixels(CAMERA, BALL, lights())
    points, directions = mirrored_rays(CAMERA, BALL, columns, rows)
    to_light = lights() - points
    to_light /= np.linalg.norm(to_light, axis=-1, keepdims=True)
    np.testing.assert_allclose(directions, to_light, atol=1e-9)


def test_a_light_beside_the_camera_is_seen_in_the_middle() -> None:
    centre = np.array(BALL.centre_mm)
    light = 0.3 * centre
    expected = centre * (1 - BALL.radius_mm / np.linalg.norm(centre))
    np.testing.assert_allclose(highlight_points(BALL, light), expected, atol=1e-9)


def test_a_highlight_outside_the_ball_is_refused() -> None:
    with pytest.raises(InputError, match="outside the ball"):
        mirrored_rays(CAMERA, BALL, [300.0, 5.0], [180.0, 5.0])
    with pytest.raises(InputError, match="outside the ball"):
        mirrored_rays(CAMERA, BALL, float("nan"), 3.0)
