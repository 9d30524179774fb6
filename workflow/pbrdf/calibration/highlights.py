"""The place of a lamp's highlight in a photograph of a chrome ball, to a fraction of a pixel."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

from pbrdf.errors import InputError

Float = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Contrast against the ball's own scatter from which something counts as a highlight, and the noise of a
# pixel below which nothing counts at all.
_CONTRAST = 10.0
_NOISE = 5.0
# Share of the brightest blob's light from which a second one makes the choice arbitrary.
_RIVAL = 0.5
# Share of the ball's picture above which a blob is no lamp's mirror image.
_LARGEST = 0.05
# Pixels at half the peak from which a blob is cut at a level; a smaller one is weighed whole, because
# a level would cut pixels rather than the blob.
_BROAD = 30
# Shares of the contrast at which a blob is cut, and at which it is cut again to see how far the choice
# matters. The top of a clipped blob is the lamp; below lie the streaks and the halo of a worn ball.
_CLIPPED_LEVELS = (0.95, 0.75)
_BROAD_LEVELS = (0.15, 0.45)
_SMALL_LEVELS = (0.02, 0.1)
# No smaller error is claimed, px: sharp rims alias more than the formulas below tell, and the middle of a
# lamp's mirror image is not quite the mirror image of its middle.
_LEAST_ERROR_PX = 0.04


@dataclass(frozen=True)
class Highlight:
    """Where a highlight stands; the first pixel's centre is (0, 0).

    Attributes
    ----------
    column, row : float
        px.
    error_px : float
        Standard error of each of the two: the pixels' noise, the grid, and the shift with the level cut.
    area_px : int
        Pixels of the blob.
    clipped : bool
        Whether pixels of it are saturated, so that its outline alone tells the place.
    """

    column: float
    row: float
    error_px: float
    area_px: int
    clipped: bool


@dataclass(frozen=True)
class _Scene:
    """A photograph above its background; `top` is the highest value that a pixel can have there."""

    values: Float
    inside: Mask
    noise: Float
    peak: float
    top: float

    @property
    def clipped(self) -> bool:
        return self.peak >= self.top


@dataclass(frozen=True)
class _Blob:
    column: float
    row: float
    light: float
    pixels: Mask
    weights: Float


def find_highlight(
    image: ArrayLike,
    inside: ArrayLike,
    saturation: float | None = None,
    noise: ArrayLike | None = None,
    source: str | Path = "photograph",
) -> Highlight:
    """Find the one bright highlight on a ball.

    The brightest connected blob is weighed: a saturated one by its saturated pixels, a broad one above half
    its peak, one of few pixels as a whole. Weaker blobs (the ball's mirror image of other balls, of the
    room) are left out, and so are single hot pixels.

    Parameters
    ----------
    image : array_like, shape (rows, columns)
        Linear photograph, any unit.
    inside : array_like of bool, shape (rows, columns)
        Pixels that show the ball.
    saturation : float, optional
        Value from which a pixel is saturated; without it none is.
    noise : array_like, shape () or (rows, columns), optional
        Standard deviation of a pixel, in the image's unit; by default that of neighbours' differences.
    source : str or Path
        Name of the photograph for errors.

    Raises
    ------
    InputError
        If there is no highlight, several are about equally bright, or the one there is reaches the ball's
        outline or is too large for a lamp's.
    """
    scene = _scene(image, inside, saturation, noise, source)
    level, check = _levels(scene)
    blob, rivals = _brightest(scene, level)
    again, rivals_again = _brightest(scene, check)
    rival = max(rivals / blob.light, rivals_again / again.light)
    if rival > _RIVAL:
        raise InputError(
            source,
            "highlight",
            f"is one of several about equally bright ones (the second has {rival:.0%} of its light)",
            "switch off or cover the other lamps",
        )
    area = int(blob.pixels.sum())
    if area > _LARGEST * scene.inside.sum():
        share = area / scene.inside.sum()
        problem = f"covers {share:.0%} of the ball's picture"
        raise InputError(source, "highlight", problem, "expose less, or take a ball of chrome")
    if bool((ndimage.binary_dilation(blob.pixels) & ~scene.inside).any()) or _on_rim(blob.pixels):
        raise InputError(
            source, "highlight", "reaches the ball's outline or the frame", "leave out this angle of the arm"
        )
    shift = float(np.hypot(again.column - blob.column, again.row - blob.row))
    parts = (_noise_error(scene, blob), _grid_error(scene, blob), shift, _LEAST_ERROR_PX)
    error = float(np.linalg.norm(parts))
    return Highlight(blob.column, blob.row, error, area, scene.clipped)


def _scene(
    image: ArrayLike,
    inside: ArrayLike,
    saturation: float | None,
    noise: ArrayLike | None,
    source: str | Path,
) -> _Scene:
    values = np.array(image, dtype=np.float64)
    ball = np.asarray(inside, dtype=bool)
    if values.ndim != 2 or ball.shape != values.shape:
        problem = f"has shape {values.shape}, the ball's pixels {ball.shape}"
        raise InputError(source, "image", problem, "give two of the same two-dimensional shape")
    if not np.isfinite(values[ball]).all():
        raise InputError(source, "image", "holds values that are not finite", "take the photograph again")
    if not ball.any():
        raise InputError(source, "inside", "holds no pixel", "find the ball's outline first")
    deviation = _neighbours_noise(values, ball) if noise is None else np.asarray(noise, dtype=np.float64)
    deviation = np.broadcast_to(deviation, values.shape)
    top = np.inf if saturation is None else saturation
    background = float(np.median(values[ball]))
    values = np.minimum(values, top) - background
    hot = _hot_pixels(values, deviation)
    values[hot | ~np.isfinite(values)] = 0.0
    peak = float(values[ball].max())
    spread = max(float(np.median(deviation[ball])), _scatter(values[ball]))
    if peak <= _CONTRAST * spread:
        passed_over = f" ({int((hot & ball).sum())} hot pixels passed over)" if (hot & ball).any() else ""
        raise InputError(
            source,
            "highlight",
            f"none is there: the brightest place is {peak:.4g} above a background of {background:.4g} that "
            f"scatters by {spread:.3g}{passed_over}",
            "check that the lamp is on and that the ball mirrors it to the camera, or expose longer",
        )
    return _Scene(values, ball, deviation, peak, top - background)


def _levels(scene: _Scene) -> tuple[float, float]:
    """Level to cut at, and the level to compare with, above the background."""
    if scene.clipped:
        shares = _CLIPPED_LEVELS
    elif _brightest(scene, 0.5 * scene.peak)[0].pixels.sum() >= _BROAD:
        shares = _BROAD_LEVELS
    else:
        shares = _SMALL_LEVELS
    least = _NOISE * float(np.median(scene.noise[scene.inside]))
    return max(shares[0] * scene.peak, least), max(shares[1] * scene.peak, least)


def _brightest(scene: _Scene, level: float) -> tuple[_Blob, float]:
    """Blob above `level` with most light, and the light of the second."""
    labels, count = ndimage.label((scene.values > level) & scene.inside, structure=np.ones((3, 3)))
    # a blob of few pixels needs its dim rim, which is part of the lamp's light
    floor = 0.0 if level < 0.2 * scene.peak else level
    above = np.where(labels > 0, scene.values - floor, 0.0)
    light = ndimage.sum_labels(above, labels, np.arange(1, count + 1))
    order = np.argsort(light)[::-1]
    pixels = labels == order[0] + 1
    weights = np.where(pixels, above, 0.0)
    rows, columns = np.nonzero(pixels)
    share = weights[rows, columns] / light[order[0]]
    second = float(light[order[1]]) if count > 1 else 0.0
    return _Blob(float(share @ columns), float(share @ rows), float(light[order[0]]), pixels, weights), second


def _noise_error(scene: _Scene, blob: _Blob) -> float:
    """Standard error by the pixels' noise, the larger of the two coordinates; clipped pixels have none."""
    rows, columns = np.nonzero(blob.pixels & (scene.values < scene.top))
    variance = scene.noise[rows, columns] ** 2
    along = [
        float(np.sum(variance * (columns - blob.column) ** 2)),
        float(np.sum(variance * (rows - blob.row) ** 2)),
    ]
    return float(np.sqrt(max(along))) / blob.light


def _grid_error(scene: _Scene, blob: _Blob) -> float:
    """Standard error by the grid of pixels, which shows little of where a narrow blob lies within a pixel.

    A blob that is not clipped errs by the first alias of its spectrum, taken as a Gaussian's: 1/√12 px for
    one within a pixel, nothing for one that spreads over several. Of a clipped one whole pixels are seen:
    each of the ``2 √(π N)`` pixels of its rim is wrong by 1/√12 of its area, at a lever of ``√(N/2π)``; where
    it is narrow besides, no more is claimed than half its length.
    """
    rows, columns = np.nonzero(blob.pixels)
    weights = blob.weights[rows, columns]
    narrow, long = np.linalg.eigvalsh(np.cov(np.stack([columns, rows]), aweights=weights, ddof=0))
    one_pixel = 1 / 12
    if not scene.clipped:
        return float(np.sqrt(one_pixel) * np.exp(-2 * np.pi**2 * max(narrow - one_pixel, 0.0)))
    if narrow < 1:
        return float(0.5 * np.sqrt(long))
    area = rows.size
    return float(np.sqrt(2 * np.sqrt(np.pi * area) * one_pixel * area / (2 * np.pi)) / area)


def _hot_pixels(values: Float, noise: Float) -> Mask:
    """Pixels whose neighbours see nothing of their light: no lens makes such an image."""
    around = np.ones((3, 3), dtype=bool)
    around[1, 1] = False
    brightest_neighbour = ndimage.maximum_filter(values, footprint=around)
    dark = np.maximum(_NOISE * noise, 0.02 * values)
    hot: Mask = (values > _CONTRAST * noise) & (brightest_neighbour < dark)
    return hot


def _neighbours_noise(values: Float, ball: Mask) -> Float:
    """Standard deviation of a pixel from the differences of neighbours in a row, shape ()."""
    both = ball[:, 1:] & ball[:, :-1]
    differences = (values[:, 1:] - values[:, :-1])[both]
    if differences.size == 0:
        return np.zeros(())
    return np.asarray(_scatter(differences) / np.sqrt(2))


def _scatter(values: Float) -> float:
    """Standard deviation by the median, which a few bright pixels do not move."""
    return 1.4826 * float(np.median(np.abs(values - np.median(values))))


def _on_rim(pixels: Mask) -> bool:
    return bool(pixels[0].any() or pixels[-1].any() or pixels[:, 0].any() or pixels[:, -1].any())
