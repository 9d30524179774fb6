"""The lamp's power in one band, from a tile of known reflectance.

A Lambertian surface of reflectance ρ has M00 = ρ / π, in 1/sr, before the cosine of incidence
(Nicodemus et al., *Geometrical Considerations and Nomenclature for Reflectance*, 1977); Spectralon keeps
to it near its normal. What the camera sees of it falls off with cos θi / d².
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.flat_field import middle
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import band_name
from pbrdf.optics.arm import Arm

Float = NDArray[np.float64]

MIDDLE = 0.5
"""Share of a frame's rows and of its columns, in the middle, in which the tile is measured."""

BLOCKS = 4
"""Blocks along each side of that window, whose means tell how even the tile is."""

_SEEN = 10.0
"""Standard deviations of its noise by which a pixel that shows the tile is above darkness."""

_LIT = 0.5
"""Share of the window's pixels that must show the tile."""

_OUTLIER = 5.0
"""Robust standard deviations beyond which a pixel shows dust rather than the tile."""

_MM_PER_M = 1000.0


@dataclass(frozen=True)
class LampScale:
    """What a band's lamp, filter and camera make of one unit of BRDF.

    Attributes
    ----------
    scale, standard_error : float
        DN/s of 1/sr under a cosine of 1 from a distance of 1 m. The error does not know those of
        the tile's reflectance and of the lights' distance, which the spheres' own distance takes out
        again; nor, of a single light, how the lamp's power wanders between captures.
    unevenness, unevenness_error : float
        Of the blocks' means, the one farthest from the mean: its relative deviation and its error.
    lamp_range : float
        Largest less smallest power of the lamp while the tile was photographed, relative.
    pixels : int
    """

    scale: float
    standard_error: float
    unevenness: float
    unevenness_error: float
    lamp_range: float
    pixels: int


def middle_window(rows: int, columns: int) -> tuple[slice, slice]:
    """Rows and columns in the middle of a frame in which the tile is measured."""
    return middle(rows, MIDDLE), middle(columns, MIDDLE)


def tile_irradiance(camera: Camera, arm: Arm, angle_deg: float, window: tuple[slice, slice]) -> Float:
    """Irradiance cos θi / d² of a tile under the arm's light, 1/m².

    The tile stands at the centre of the arm, its normal pointing at the camera.

    Parameters
    ----------
    camera : Camera
    arm : Arm
    angle_deg : float
        Angle of the arm.
    window : tuple of slice
        Rows and columns of the frame.

    Returns
    -------
    ndarray, shape (rows, columns)
        Not above zero where the light is behind the tile.
    """
    rows, columns = np.mgrid[window].astype(np.float64)
    centre = np.asarray(arm.centre_mm)
    normal = -centre / np.linalg.norm(centre)
    rays = camera.rays(columns, rows)
    points = rays * ((centre @ normal) / (rays @ normal))[..., None]
    toward = arm.light_position(angle_deg) - points
    distance = np.linalg.norm(toward, axis=-1)
    irradiance: Float = (toward @ normal) / distance**3 * _MM_PER_M**2
    return irradiance


def combined(scales: Sequence[LampScale]) -> LampScale:
    """Mean of the scales of one band from several lights.

    The standard error is the larger of the pixels' and that of the scatter between lights, which knows of
    the lamp's wandering and of errors in the lights' places; of everything else the worst is kept.
    """
    count = len(scales)
    values, errors = (np.array([getattr(s, name) for s in scales]) for name in ("scale", "standard_error"))
    of_pixels = float(np.sqrt((errors**2).sum()) / count)
    of_lights = float(values.std(ddof=1) / count**0.5) if count > 1 else 0.0
    worst = max(scales, key=lambda scale: abs(scale.unevenness))
    return LampScale(
        float(values.mean()),
        max(of_pixels, of_lights),
        worst.unevenness,
        worst.unevenness_error,
        max(scale.lamp_range for scale in scales),
        sum(scale.pixels for scale in scales),
    )


def lamp_scale(
    m00: ArrayLike,
    variance: ArrayLike,
    irradiance: Float,
    reflectance: float,
    lamp: tuple[float, float],
    band_nm: int,
    source: str | Path,
) -> LampScale:
    """Scale of a band from the tile's M00.

    Parameters
    ----------
    m00, variance : array_like, shape (rows, columns)
        Of a Mueller image with its flat field divided out, DN/s and its square; NaN where it is missing.
    irradiance : ndarray, shape (rows, columns)
        From `tile_irradiance`, 1/m².
    reflectance : float
        Of the tile, ρ.
    lamp : tuple of float
        Range of the lamp's relative power meanwhile, and the relative error with which the state that is
        repeated tells this power: it is in all pixels alike.
    band_nm : int
        For messages.
    source : str or Path
        Where the photographs are from, for messages.

    Raises
    ------
    InputError
        If the light is behind the tile, or most of the window does not show it.
    """
    if not irradiance.min() > 0:
        raise InputError(source, "angle_deg", "puts the light behind the tile", "turn the arm to the camera")
    bright = np.asarray(m00, dtype=np.float64)
    noise = np.sqrt(np.asarray(variance, dtype=np.float64))
    lit = np.isfinite(bright) & (bright > _SEEN * noise)
    if lit.mean() < _LIT:
        problem = f"shows the lit tile in {100 * lit.mean():.0f} % of its middle"
        raise InputError(
            source, band_name(band_nm), problem, "check tile, arm and shutter, or expose it longer"
        )
    values = np.where(lit, bright * np.pi / (reflectance * irradiance), np.nan)
    median = np.nanmedian(values)
    scatter = 1.4826 * np.nanmedian(np.abs(values - median))
    # even noiseless pixels differ by rounding
    near = np.abs(values - median) <= np.maximum(_OUTLIER * scatter, 1e-6 * median)
    kept = values[near]
    scale = float(kept.mean())
    unevenness, unevenness_error = _unevenness(np.where(near, values / scale - 1, np.nan))
    lamp_range, lamp_error = lamp
    standard_error = float(np.hypot(kept.std(ddof=1) / len(kept) ** 0.5, lamp_error * scale))
    return LampScale(scale, standard_error, unevenness, unevenness_error, lamp_range, len(kept))


def _unevenness(relative: Float) -> tuple[float, float]:
    """Mean of the block that is farthest from zero, and its error."""
    found = [(0.0, 0.0)]
    for band in np.array_split(relative, BLOCKS, axis=0):
        for block in np.array_split(band, BLOCKS, axis=1):
            values = block[np.isfinite(block)]
            # a block that is mostly missing says little of the tile
            if len(values) > 1 and len(values) > block.size / 2:
                found.append((float(values.mean()), float(values.std(ddof=1) / len(values) ** 0.5)))
    return max(found, key=lambda pair: abs(pair[0]))
