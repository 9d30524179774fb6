"""Roughly where an image shows a sphere, without being told.

Edges of the reduced image are taken to the stereographic chart of the camera's directions, in which the
outline of a sphere is a circle wherever it stands and whatever the lens. Pairs of edges whose normals meet
at equal distances vote for a circle (the randomised Hough transform; Xu, Oja and Kultanen, Pattern
Recognition Letters 11, 1990).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, uniform_filter

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.outline_cone import angles, solve_cone

Float = NDArray[np.float64]

_SIZE_PX = 640
_EDGES = 12_000
_PAIRS = 400_000
_CELL_PX = 6.0
_SMALLEST_PX = 12.0
_PEAKS = 16
_ALIGNED = 0.9
# edges of mere noise cover about this share of any circle
_BY_CHANCE = 0.25


@dataclass(frozen=True)
class _Edges:
    """Edges of a reduced image: rays (N, 3); places and unit normals (N, 2) in the chart, in its pixels."""

    rays: Float
    places: Float
    normals: Float
    focal_px: float


def find_cones(image: NDArray[np.float32], camera: Camera) -> list[Float]:
    """Cones (`pbrdf.calibration.outline_cone`) that edges of the image support, the longest outline first.

    Parameters
    ----------
    image : ndarray
        (rows, columns), without dead pixels.
    camera : Camera
    """
    edges = _edges(image, camera)
    if len(edges.rays) < 100:
        return []
    found = []
    for circle in _voted(edges):
        x = _refined(edges, *circle)
        score = _support(edges, x) if x is not None else 0.0
        if x is not None and score > 0:
            found.append((score, x))
    found.sort(key=lambda pair: -pair[0])
    return [x for _, x in found]


def reduction(camera: Camera) -> float:
    """Pixels of the image a pixel of the reduced one, in which the search is made."""
    return max(1.0, max(camera.rows, camera.columns) / _SIZE_PX)


def _edges(image: NDArray[np.float32], camera: Camera) -> _Edges:
    shrink = reduction(camera)
    size = (round(camera.columns / shrink), round(camera.rows / shrink))
    small = cv2.GaussianBlur(cv2.resize(image, size, interpolation=cv2.INTER_AREA), (0, 0), 1.0)
    across, down = cv2.Sobel(small, cv2.CV_32F, 1, 0), cv2.Sobel(small, cv2.CV_32F, 0, 1)
    steep = np.hypot(across, down)
    ridge = _ridges(steep, across, down)
    # a small image has few pixels that are no edge, and the faint ones among them are noise
    count = min(_EDGES, np.count_nonzero(ridge) // 2)
    rows, columns = np.nonzero(ridge)
    strongest = np.argsort(-steep[rows, columns], kind="stable")[:count]
    rows, columns = rows[strongest], columns[strongest]
    normals = np.stack([across[rows, columns], down[rows, columns]], -1).astype(np.float64)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    scale = np.array([camera.columns, camera.rows]) / size
    places = (np.stack([columns, rows], -1) + 0.5) * scale - 0.5
    tangents = np.stack([-normals[:, 1], normals[:, 0]], -1)
    rays = camera.rays(places[:, 0], places[:, 1])
    focal_px = float(np.mean(np.array(camera.focal_px) / scale))
    ahead = camera.rays(places[:, 0] + tangents[:, 0], places[:, 1] + tangents[:, 1])
    here, there = (_chart(r, focal_px) for r in (rays, ahead))
    along = (there - here) / np.linalg.norm(there - here, axis=1, keepdims=True)
    return _Edges(rays, here, np.stack([along[:, 1], -along[:, 0]], -1), focal_px)


def _chart(rays: Float, focal_px: float) -> Float:
    """Stereographic chart: circles of directions become circles, and angles stay as they are."""
    return 2 * focal_px * rays[:, :2] / (1 + rays[:, 2:])


def _ridges(steep: NDArray[Any], across: NDArray[Any], down: NDArray[Any]) -> NDArray[np.bool_]:
    """Pixels whose gradient is the steepest along its own direction, the frame's rim left out."""
    turn = np.round(np.arctan2(down, across) / (np.pi / 4)).astype(np.intp) % 4
    ridge = np.zeros(steep.shape, bool)
    middle = steep[1:-1, 1:-1]
    for index, (dr, dc) in enumerate(((0, 1), (1, 1), (1, 0), (1, -1))):
        rows, columns = steep.shape
        after = steep[1 + dr : rows - 1 + dr, 1 + dc : columns - 1 + dc]
        before = steep[1 - dr : rows - 1 - dr, 1 - dc : columns - 1 - dc]
        ridge[1:-1, 1:-1] |= (turn[1:-1, 1:-1] == index) & (middle > before) & (middle >= after)
    return ridge & (steep > 0)


def _voted(edges: _Edges) -> list[tuple[Float, float]]:
    """Centres and radii, in the chart's pixels, on which most pairs of edges agree."""
    random = np.random.default_rng(0)
    i, j = random.integers(0, len(edges.places), (2, _PAIRS))
    between = edges.places[j] - edges.places[i]
    ni, nj = edges.normals[i], edges.normals[j]
    sine = ni[:, 0] * nj[:, 1] - ni[:, 1] * nj[:, 0]
    meets = np.abs(sine) > 0.3
    i, between, ni, nj, sine = (values[meets] for values in (i, between, ni, nj, sine))
    ri = (between[:, 0] * nj[:, 1] - between[:, 1] * nj[:, 0]) / sine
    rj = (between[:, 0] * ni[:, 1] - between[:, 1] * ni[:, 0]) / sine
    radius = (np.abs(ri) + np.abs(rj)) / 2
    first, last = edges.places.min(0), edges.places.max(0)
    centre = edges.places[i] + ri[:, None] * ni
    agree = np.abs(np.abs(ri) - np.abs(rj)) < np.maximum(0.06 * radius, 2.0)
    agree &= (radius > _SMALLEST_PX) & (radius < 0.75 * np.max(last - first))
    agree &= np.all((centre > first) & (centre < last), axis=1)
    votes = np.column_stack([centre[agree] - first, radius[agree]])
    cells = (votes / _CELL_PX).astype(np.intp)
    if not len(cells):
        return []
    shape = tuple(cells.max(0) + 1)
    count = np.bincount(np.ravel_multi_index(cells.T, shape), minlength=int(np.prod(shape))).reshape(shape)
    smooth = 27 * uniform_filter(count.astype(np.float64), 3, mode="constant")
    peaks = np.argwhere((smooth == maximum_filter(smooth, 3)) & (smooth > 0))
    best = peaks[np.argsort(-smooth[tuple(peaks.T)], kind="stable")[:_PEAKS]]
    near = [np.all(np.abs(cells - peak) <= 1, axis=1) for peak in best]
    middles = [np.median(votes[of_peak], axis=0) for of_peak in near]
    return [(middle[:2] + first, float(middle[2])) for middle in middles]


def _refined(edges: _Edges, centre: Float, radius: float) -> Float | None:
    """Cone through the edges near a circle of the chart."""
    from_centre = edges.places - centre
    distance = np.linalg.norm(from_centre, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        aligned = np.abs(np.sum(from_centre * edges.normals, axis=1)) > _ALIGNED * distance
    near = aligned & (np.abs(distance - radius) < max(0.06 * radius, 4.0))
    for tolerance_px in (8.0, 4.0, 2.0, 2.0, 2.0):
        if np.count_nonzero(near) < 20:
            return None
        x = solve_cone(edges.rays[near])
        if not np.linalg.norm(x) > 1:
            return None
        near = aligned & (np.abs(angles(x, edges.rays)) * edges.focal_px < tolerance_px)
    return x


def _support(edges: _Edges, x: Float) -> float:
    """Length of the outline that edges show beyond what chance would, in the chart's pixels."""
    near = np.abs(angles(x, edges.rays)) * edges.focal_px < 1.5
    circle = edges.places[near]
    if len(circle) < 20:
        return 0.0
    centre = _chart(x[None] / np.linalg.norm(x), edges.focal_px)[0]
    outward = circle - centre
    distance = np.linalg.norm(outward, axis=1)
    near_aligned = np.abs(np.sum(outward * edges.normals[near], axis=1)) > _ALIGNED * distance
    radius = float(np.median(distance))
    bins = max(20, round(np.pi * radius))
    turn = np.arctan2(outward[:, 1], outward[:, 0])[near_aligned]
    seen = len(np.unique(((turn / (2 * np.pi)) % 1.0 * bins).astype(np.intp)))
    return (seen / bins - _BY_CHANCE) * radius
