"""Cells that pixels show, against the library's own rays and angles in plain NumPy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from pbrdf._kernels import pixel_cells

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.lens import NO_DISTORTION, Coefficients
from pbrdf.optics.frames import normalised

Float = NDArray[np.float64]

CENTRE, RADIUS = np.array([1.0, -0.5, 500.0]), 25.0
ROWS, COLUMNS = 150, 301
GRID = (91, 360)
LEAST_COSINE = float(np.cos(np.deg2rad(80.0)))
BARREL = (-0.3, 0.1, 2e-3, -1e-3, 0.02)


def light(angle_deg: float) -> Float:
    angle = np.deg2rad(angle_deg)
    return CENTRE + 400.0 * np.array([np.sin(angle), 0.1, -np.cos(angle)])


def camera(distortion: Coefficients = NO_DISTORTION) -> Camera:
    return Camera((1350.0, 1340.0), (151.3, 74.2), ROWS, COLUMNS, distortion)


def located(
    of: Camera, at: Float, first: tuple[int, int] = (0, 0), shape: tuple[int, int] = (ROWS, COLUMNS)
) -> tuple[NDArray[np.int32], Float, Float, Float]:
    cell = np.empty(shape, np.int32)
    theta_h, phi_d, gain = np.empty((3, *shape), np.float32)
    lens = pixel_cells.Lens(of.focal_px, of.principal_px, of.distortion)
    scene = pixel_cells.LitSphere(CENTRE, RADIUS, at)
    pixel_cells.locate(lens, scene, first, LEAST_COSINE, GRID, cell, theta_h, phi_d, gain)
    return cell, theta_h, phi_d, gain


def twin(of: Camera, at: Float) -> tuple[NDArray[np.bool_], Float, Float, Float]:
    """Seen, places on the grid as fractions, and d² / cosθi (rows, columns)."""
    rays = of.rays(*np.meshgrid(np.arange(COLUMNS), np.arange(ROWS)))
    along = rays @ CENTRE
    root = along**2 - CENTRE @ CENTRE + RADIUS**2
    point = (along - np.sqrt(np.maximum(root, 0.0)))[..., None] * rays
    normal = (point - CENTRE) / RADIUS
    to_light, to_camera = normalised(at - point), -rays
    half = normalised(to_light + to_camera)
    cosines = [np.sum(normal * v, axis=-1) for v in (to_light, to_camera)]
    seen = (root > 0) & (cosines[0] > LEAST_COSINE) & (cosines[1] > LEAST_COSINE)
    b = normalised(np.cross(normal, half))
    t = np.cross(b, half)
    theta_h = np.arccos(np.clip(np.sum(normal * half, axis=-1), -1, 1))
    phi_d = np.arctan2(np.sum(b * to_light, axis=-1), np.sum(t * to_light, axis=-1))
    distance = np.linalg.norm(at - point, axis=-1)
    return (
        seen,
        np.sqrt(theta_h / (np.pi / 2)) * (GRID[0] - 1),
        (phi_d + np.pi) / (2 * np.pi) * GRID[1],
        distance**2 * 1e-6 / cosines[0],
    )


@pytest.mark.parametrize("angle_deg", [8.0, 60.0, 120.0])
@pytest.mark.parametrize("distortion", [NO_DISTORTION, BARREL], ids=["pinhole", "barrel"])
def test_cells_and_places_equal_their_twin(angle_deg: float, distortion: Coefficients) -> None:
    of, at = camera(distortion), light(angle_deg)
    cell, x, y, gain = located(of, at)
    seen, j, k, expected_gain = twin(of, at)
    shown = cell != pixel_cells.NO_CELL
    np.testing.assert_array_equal(shown, seen)
    assert 1000 < seen.sum() < 0.6 * seen.size
    np.testing.assert_allclose((cell // GRID[1] + x)[shown], j[shown], atol=2e-4)
    off = (cell % GRID[1] + y - k)[shown]
    np.testing.assert_allclose((off + GRID[1] / 2) % GRID[1] - GRID[1] / 2, 0, atol=2e-3)
    assert np.abs(x[shown]).max() <= 0.5 + 1e-6
    assert np.abs(y[shown]).max() <= 0.5 + 1e-6
    np.testing.assert_allclose(gain[shown], expected_gain[shown], rtol=1e-6)


def test_a_window_shows_what_the_frame_shows_there() -> None:
    whole = located(camera(BARREL), light(60.0))
    part = located(camera(BARREL), light(60.0), (40, 33), (50, 201))
    for a, b in zip(part, whole, strict=True):
        np.testing.assert_array_equal(a, b[40:90, 33:234])


def test_a_light_behind_the_sphere_shows_nothing() -> None:
    assert np.all(located(camera(), light(180.0))[0] == pixel_cells.NO_CELL)


def test_shapes_are_refused() -> None:
    lens = pixel_cells.Lens((1.0, 1.0), (0.0, 0.0), NO_DISTORTION)
    scene = pixel_cells.LitSphere(CENTRE, RADIUS, light(60.0))
    cell, plane = np.empty((4, 5), np.int32), np.empty((4, 5), np.float32)
    with pytest.raises(ValueError, match=r"gain has shape \(5, 4\), expected \(4, 5\)"):
        pixel_cells.locate(lens, scene, (0, 0), 0.1, GRID, cell, plane, plane, np.empty((5, 4), np.float32))
    with pytest.raises(ValueError, match="at least"):
        pixel_cells.locate(lens, scene, (0, 0), 0.1, (1, 360), cell, plane, plane, plane)


BYTES_OF_CELLS = """
import hashlib, numpy as np
from pbrdf._kernels import pixel_cells
cell = np.empty((150, 301), np.int32)
places = np.empty((3, 150, 301), np.float32)
lens = pixel_cells.Lens((1350.0, 1340.0), (151.3, 74.2), (-0.3, 0.1, 2e-3, -1e-3, 0.02))
scene = pixel_cells.LitSphere((1.0, -0.5, 500.0), 25.0, (350.0, 20.0, 300.0))
pixel_cells.locate(lens, scene, (0, 0), 0.1, (91, 360), cell, *places)
print(hashlib.sha256(cell.tobytes() + places.tobytes()).hexdigest())
"""


def test_same_bytes_for_any_number_of_threads(printed_by_threads: Callable[[str], set[str]]) -> None:
    assert len(printed_by_threads(BYTES_OF_CELLS)) == 1
