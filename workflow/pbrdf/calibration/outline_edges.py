"""Where the edge of a sphere lies in the image, to a small part of a pixel.

The band about a roughly known outline is cut into sectors. In each one the image is modelled as two surfaces
that meet in a step, blurred by lens and pixel: outside a level and a slope; inside a level and a term in the
square root of the depth, for near its outline a sphere turns away like that whatever lights it
(cos θ = √(2 depth / radius)). A model without that term puts the edge too far inside.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.outline_cone import off_outline_px
from pbrdf.calibration.sphere import Sphere

Float = NDArray[np.float64]

_BLURS_PX = (0.4, 0.55, 0.75, 1.0, 1.4, 2.0, 2.8, 4.0)
_SECTORS_FOR_BLUR = 120
_NEAR_STEP_PX = 3.0
_ON_OUTLINE_PX = 1.0
_ARC_PX = 8.0
_FEWEST_PIXELS = 24
_MOST_CLIPPED = 0.05
_GRID_STEP_PX = 0.5
_STEPS = 10
# Tukey's biweight, 95 % efficient for normal noise
_TUKEY = 4.685
_FORM = 0.05
_CLEAR_STEP = 4.0
_CLEAR_PLACE_PX = 0.35


@dataclass(frozen=True)
class Edges:
    """Edge points of one image.

    Attributes
    ----------
    columns, rows : ndarray
        Places (N,), px.
    errors_px : ndarray
        Standard error of each, along the outline's normal.
    turns : ndarray
        Turn of each about the outline, rad.
    arc_deg : float
        How much of the outline a point stands for.
    blur_px : float
        Standard deviation of the blur taken.
    """

    columns: Float
    rows: Float
    errors_px: Float
    turns: Float
    arc_deg: float
    blur_px: float


@dataclass(frozen=True)
class _Band:
    """Pixels (N,) about an outline, sector after sector; `starts` (K,) are the sectors' first pixels."""

    values: Float
    distance_px: Float
    starts: NDArray[np.intp]
    turns: Float
    half_px: float

    def sums(self, values: Float) -> Float:
        return np.add.reduceat(values, self.starts, axis=0)

    def spread_out(self, by_sector: NDArray[Any]) -> NDArray[Any]:
        return np.repeat(by_sector, self.counts, axis=0)

    @property
    def counts(self) -> NDArray[np.intp]:
        return np.diff(np.append(self.starts, len(self.values)))

    def every(self, step: int) -> _Band:
        """A band of each `step`-th sector."""
        chosen = np.arange(len(self.starts)) % step == 0
        pixels = np.repeat(chosen, self.counts)
        starts = np.concatenate([[0], np.cumsum(self.counts[chosen])[:-1]])
        return _Band(self.values[pixels], self.distance_px[pixels], starts, self.turns[chosen], self.half_px)


@dataclass(frozen=True)
class _Fit:
    """Steps of all sectors (K,): place, its error, clear or not, height, residuals' scale; residuals (N,)."""

    place_px: Float
    error_px: Float
    clear: NDArray[np.bool_]
    step: Float
    scale: Float
    left: Float


def without_dead_pixels(image: NDArray[np.float32]) -> NDArray[np.float32]:
    """The image with pixels that differ from all around them replaced by the median of their neighbours.

    The median of 3 × 3 pixels leaves a straight edge where it is.
    """
    median = cv2.medianBlur(image, 3)
    off = np.abs(image - median)
    odd = off > 8 * 1.4826 * np.median(off) + 1e-6 * np.ptp(median)
    whole: NDArray[np.float32] = np.where(odd, median, image).astype(np.float32)
    return whole


def find_edges(
    image: NDArray[np.float32],
    camera: Camera,
    sphere: Sphere,
    half_px: float,
    saturation: float,
    blur_px: float,
    measure_blur: bool,
) -> Edges:
    """Edge points within `half_px` of the outline of `sphere`.

    Parameters
    ----------
    image : ndarray
        (rows, columns), without dead pixels.
    camera : Camera
    sphere : Sphere
        Roughly where it stands.
    half_px : float
        Half width of the band that is looked at.
    saturation : float
        Sectors with pixels of this value and above are left out: a clipped edge lies elsewhere.
    blur_px : float
        Standard deviation of the blur.
    measure_blur : bool
        Whether that is a first guess, and the one that explains the image best is taken.
    """
    band, sectors = _band(image, camera, sphere, half_px, saturation)
    arc_deg = 360.0 / sectors
    if not len(band.starts):
        nothing = np.empty(0)
        return Edges(nothing, nothing, nothing, nothing, arc_deg, np.nan)
    if measure_blur:
        blur_px = _blur(band.every(max(1, len(band.starts) // _SECTORS_FOR_BLUR)), blur_px)
    fit = _fit(band, blur_px)
    turns, place = band.turns[fit.clear], fit.place_px[fit.clear]
    columns, rows = _beside_outline(camera, sphere, turns, place)
    return Edges(columns, rows, fit.error_px[fit.clear], turns, arc_deg, blur_px)


def _band(
    image: NDArray[np.float32], camera: Camera, sphere: Sphere, half_px: float, saturation: float
) -> tuple[_Band, int]:
    ring = np.stack(camera.project(sphere.outline()), -1)
    near = np.zeros(image.shape, np.uint8)
    around = int(np.ceil(2 * half_px)) + 3
    # a polygon's places must fit into OpenCV's integers, and those far outside draw nothing
    polygon = np.rint(np.clip(ring, -30_000, 30_000)).astype(np.int32)
    cv2.polylines(near, [polygon[:, None]], isClosed=True, color=1, thickness=around)
    rows, columns = np.nonzero(near)
    distance, turn, _ = off_outline_px(sphere, camera, columns.astype(float), rows.astype(float))
    length = float(np.sum(np.hypot(*np.diff(ring, axis=0).T)))
    sectors = int(np.clip(length / _ARC_PX, 90, 1440))
    values = image[rows, columns].astype(np.float64)
    sector = np.floor((turn / (2 * np.pi)) % 1.0 * sectors).astype(np.intp) % sectors
    used = np.abs(distance) < half_px
    count = np.bincount(sector[used], minlength=sectors)
    clipped = np.bincount(sector[used & (values >= saturation)], minlength=sectors)
    usual = np.median(count[count > 0]) if np.any(count) else 0
    whole = (count >= max(_FEWEST_PIXELS, 0.6 * usual)) & (clipped <= _MOST_CLIPPED * count)
    used &= whole[sector]
    order = np.flatnonzero(used)[np.argsort(sector[used], kind="stable")]
    present, starts = np.unique(sector[order], return_index=True)
    turns = (present + 0.5) * 2 * np.pi / sectors
    return _Band(values[order], distance[order], starts, turns, half_px), sectors


def _fit(band: _Band, blur_px: float) -> _Fit:
    place = _best_on_grid(band, blur_px)
    weights = np.ones(len(band.values))
    levels = _solve(band, _surfaces(band, place, blur_px)[0], weights)[0]
    reach = band.half_px - 1.0
    for _ in range(_STEPS):
        surfaces, slopes = _surfaces(band, place, blur_px)
        moved = -np.sum(slopes * band.spread_out(levels).T, axis=0)
        columns = np.concatenate([surfaces, moved[None]])
        solution, inverse = _solve(band, columns, weights)
        levels = solution[:, :4]
        place = np.clip(place + np.clip(solution[:, 4], -0.5, 0.5), -reach, reach)
        left = band.values - np.sum(columns * band.spread_out(solution).T, axis=0)
        scale = _scale(band, left)
        step = np.abs(levels[:, 0] - levels[:, 2])
        # where there is little noise a blur not quite right must not make outliers of the edge's own pixels
        width = np.maximum(scale, _FORM * step)
        weights = np.clip(1 - (left / (_TUKEY * band.spread_out(width))) ** 2, 0, None) ** 2
    error = scale * np.sqrt(np.clip(inverse[:, 4, 4], 0, None))
    clear = (step > _CLEAR_STEP * scale) & (error < _CLEAR_PLACE_PX) & (np.abs(place) < reach)
    return _Fit(place, error, clear, step, scale, left)


def _blur(band: _Band, guess_px: float) -> float:
    """Blur, px, that explains the pixels near the steps best.

    Only steps on the outline count: things behind the sphere may be out of focus.
    """
    first = _fit(band, guess_px)
    wide = max(1.0, guess_px)
    on = first.clear & (np.abs(first.place_px) < _ON_OUTLINE_PX * wide)
    near = band.spread_out(on) & (np.abs(band.distance_px) < _NEAR_STEP_PX * wide)
    # what no blur explains counts as much for each
    limit = _TUKEY * band.spread_out(np.maximum(first.scale, _FORM * first.step))

    def misfit(blur_px: float) -> float:
        lost = np.minimum(np.abs(_fit(band, blur_px).left / limit), 1.0)[near]
        return float(np.sum(lost**2))

    misfits = [misfit(blur_px) for blur_px in _BLURS_PX]
    lowest = int(np.clip(np.argmin(misfits), 1, len(misfits) - 2))
    blur_px = _lowest(np.array(_BLURS_PX[lowest - 1 : lowest + 2]), misfits[lowest - 1 : lowest + 2])
    for _ in range(2):
        around = blur_px * np.array([0.85, 1.0, 1.15])
        blur_px = _lowest(around, [misfit(blur) for blur in around])
    return blur_px


def _lowest(at: Float, values: Sequence[float]) -> float:
    """Where the parabola through three points is lowest, within them."""
    bend, slope, _ = np.polyfit(at, values, 2)
    return float(np.clip(-slope / (2 * bend), at[0], at[-1])) if bend > 0 else float(at[np.argmin(values)])


def _best_on_grid(band: _Band, blur_px: float) -> Float:
    reach = band.half_px - 2.0
    grid = np.arange(-reach, reach + 1e-9, _GRID_STEP_PX)
    ones = np.ones(len(band.values))
    explained = []
    for at in grid:
        surfaces = _surfaces(band, np.full(len(band.starts), at), blur_px)[0]
        levels = _solve(band, surfaces, ones)[0]
        left = band.values - np.sum(surfaces * band.spread_out(levels).T, axis=0)
        explained.append(-band.sums(left**2))
    best: Float = grid[np.argmax(explained, axis=0)]
    return best


def _surfaces(band: _Band, place: Float, blur_px: float) -> tuple[Float, Float]:
    """The four terms of the image (4, N), and how they change with the distance from the step."""
    x = (band.distance_px - band.spread_out(place)) / blur_px
    outside, density = ndtr(x), np.exp(-0.5 * x * x) / np.sqrt(2 * np.pi)
    root, root_slope = _blurred_root(x)
    deep, far = np.sqrt(blur_px / band.half_px), blur_px / band.half_px
    surfaces: Float = np.stack([1 - outside, deep * root, outside, far * (x * outside + density)])
    slopes: Float = np.stack([-density, deep * root_slope, density, far * outside]) / blur_px
    return surfaces, slopes


def _solve(band: _Band, columns: Float, weights: Float) -> tuple[Float, Float]:
    """Least squares of each sector: solutions (K, C), and the inverse normal matrices (K, C, C)."""
    number = len(columns)
    weighted = columns * weights
    normal = np.empty((len(band.starts), number, number))
    for i in range(number):
        for j in range(i, number):
            normal[:, i, j] = normal[:, j, i] = band.sums(weighted[i] * columns[j])
    # the columns have different units; and of a step at the band's rim one surface is nearly missing
    diagonal = np.einsum("kii->ki", normal)
    unit = 1 / np.sqrt(np.maximum(diagonal, 1e-300))
    scaled = normal * unit[:, :, None] * unit[:, None, :] + 1e-10 * np.eye(number)
    inverse: Float = np.linalg.inv(scaled) * unit[:, :, None] * unit[:, None, :]
    right = np.stack([band.sums(column * band.values) for column in weighted], -1)
    return np.einsum("kij,kj->ki", inverse, right), inverse


def _scale(band: _Band, left: Float) -> Float:
    """Robust standard deviation of each sector's residuals."""
    ends = band.starts + band.counts
    pairs = zip(band.starts, ends, strict=True)
    medians = np.array([np.median(np.abs(left[a:b])) for a, b in pairs])
    # residuals have five degrees of freedom less than pixels
    freedom = np.sqrt(band.counts / (band.counts - 5.0))
    scale: Float = np.maximum(1.4826 * freedom * medians, 1e-9 * np.ptp(band.values) + 1e-300)
    return scale


_ROOT_STEP = 0.01
_ROOT_AT = np.arange(-1200, 601) * _ROOT_STEP


def _tabulated_root() -> Float:
    # the integral over the root itself, in which the integrand is smooth
    root = np.linspace(0.0, 5.0, 1001)[:, None]
    integrand = 2 * root**2 * np.exp(-0.5 * (_ROOT_AT + root**2) ** 2) / np.sqrt(2 * np.pi)
    table: Float = np.trapezoid(integrand, root, axis=0)
    return table


_ROOT = _tabulated_root()
_ROOT_SLOPE = np.gradient(_ROOT, _ROOT_STEP)


def _blurred_root(x: Float) -> tuple[Float, Float]:
    """Mean of √max(0, -(x + z)) over a standard normal z, and its derivative by x."""
    deep = np.sqrt(np.maximum(-x, 1.0))
    at = (np.clip(x, _ROOT_AT[0], _ROOT_AT[-2]) - _ROOT_AT[0]) / _ROOT_STEP
    below = at.astype(np.intp)
    rest = at - below
    far = x < _ROOT_AT[0]
    near = _ROOT[below] + rest * (_ROOT[below + 1] - _ROOT[below])
    value: Float = np.where(far, deep - deep**-3 / 8, near)
    slope: Float = np.where(far, -0.5 / deep, _ROOT_SLOPE[below])
    return value, slope


def _beside_outline(camera: Camera, sphere: Sphere, turns: Float, distance_px: Float) -> tuple[Float, Float]:
    """Places at a distance from the outline, along its normal in the image."""
    step = 1e-4
    columns, rows = camera.project(sphere.outline(turns))
    after, before = (np.stack(camera.project(sphere.outline(turns + s)), -1) for s in (step, -step))
    along = after - before
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    # the outline turns from the right to the bottom, so that outside is to the left of its course
    return columns + distance_px * along[:, 1], rows - distance_px * along[:, 0]
