"""Gain and read noise of a camera from the mean-variance line.

Of light that does not change, the variance of a pixel over repeated frames grows linearly with its mean:
shot noise counts electrons (Janesick, *Photon Transfer*, 2007; EMVA Standard 1288). Frames are compared
with their own repeats only, so that neither vignetting nor uneven pixels count as noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from pbrdf.errors import InputError

Float = NDArray[np.float64]
Mask = NDArray[np.bool_]

NEAR_SATURATION = 0.9
"""Share of saturation from which on a pixel is left out: there the range begins to clip its noise."""

LEAST_SHARE = 0.5
"""Share of a frame's usable pixels that must lie below that for the frame to count."""

LEAST_EXPOSURES = 3
"""A line through fewer says nothing of its own straightness."""

SEEN = 10.0
"""Standard deviations of a dark value by which the brightest frames must be above darkness."""

CHANCE = 1e-3
"""Chance by noise alone below which a scatter about the line counts as real."""

_ROUNDS = 8


@dataclass(frozen=True)
class TransferPoint:
    """Noise of the pixels of frames that were taken alike.

    Attributes
    ----------
    band_nm : int or None
        None for dark frames.
    exposure_s : float
    level_dn, signal_dn : float
        Mean over the pixels: raw, and above the dark level.
    variance_dn2 : float
        Mean over the pixels of the variance over the repeats.
    repeats, pixels : int
    """

    band_nm: int | None
    exposure_s: float
    level_dn: float
    signal_dn: float
    variance_dn2: float
    repeats: int
    pixels: int


@dataclass(frozen=True)
class PhotonTransfer:
    """Line of variance over signal.

    Attributes
    ----------
    dn_per_electron, dn_per_electron_error : float
        Slope and its standard error, DN.
    read_variance, read_variance_error : float
        Variance without signal and its standard error, DN²; the converter's rounding belongs to it.
    points : tuple of TransferPoint
        Those that the line was fitted to.
    residuals : tuple of float
        Variance of each point less the line's, relative to the line's.
    errors : tuple of float
        Standard errors of these residuals.
    """

    dn_per_electron: float
    dn_per_electron_error: float
    read_variance: float
    read_variance_error: float
    points: tuple[TransferPoint, ...]
    residuals: tuple[float, ...]
    errors: tuple[float, ...]

    @property
    def read_noise_dn(self) -> float:
        """Standard deviation of a value without signal, DN; zero where the line meets none."""
        return float(max(self.read_variance, 0.0) ** 0.5)

    @property
    def chi_square_per_freedom(self) -> float:
        """Squares of the residuals in units of their errors, over the degrees of freedom."""
        return self._chi_square() / (len(self.points) - 2)

    @property
    def beyond_noise(self) -> bool:
        """Whether the points scatter about the line more than chance lets them."""
        return bool(chdtrc(len(self.points) - 2, self._chi_square()) < CHANCE)

    def _chi_square(self) -> float:
        return float(sum((r / e) ** 2 for r, e in zip(self.residuals, self.errors, strict=True)))


def dark_points(dark: NDArray[Any], exposures_s: Sequence[float], good: Mask) -> list[TransferPoint]:
    """Noise of dark frames, an exposure a point.

    Parameters
    ----------
    dark : ndarray, shape (exposure, repeat, pixels)
        DN.
    exposures_s : sequence of float
    good : ndarray, shape (pixels,), bool
        Pixels that are not hot.
    """
    points = []
    for exposure_s, frames in zip(exposures_s, dark, strict=True):
        values = frames[:, good].astype(np.float32)
        level = float(values.mean(dtype=np.float64))
        variance = float(values.var(axis=0, ddof=1).mean(dtype=np.float64))
        points.append(TransferPoint(None, exposure_s, level, 0.0, variance, len(values), values.shape[1]))
    return points


def flat_points(
    band_nm: int,
    frames: NDArray[Any],
    mean_dark: NDArray[np.float32],
    exposures_s: Sequence[float],
    good: Mask,
    saturation: float,
    source: str | Path,
) -> list[TransferPoint]:
    """Noise of a band's repeated frames of an evenly bright field, an exposure a point.

    The lamp's power changes from frame to frame; each frame is scaled to the mean brightness of its
    repeats first, since its thousands of pixels tell that brightness far better than one tells its noise.

    Parameters
    ----------
    band_nm : int
    frames : ndarray, shape (repeat, exposure, pixels)
        DN.
    mean_dark : ndarray, shape (exposure, pixels), float32
        DN.
    exposures_s : sequence of float
    good : ndarray, shape (pixels,), bool
        Pixels that are not hot.
    saturation : float
        DN from which on a value is saturated.
    source : str or Path
        Where the frames are from, for messages.

    Raises
    ------
    InputError
        If fewer than three exposures are left of those that are not too bright.
    """
    points = []
    for index, exposure_s in enumerate(exposures_s):
        raw = frames[:, index].astype(np.float32)
        level = raw.mean(axis=0)
        counts = good & (level < NEAR_SATURATION * saturation)
        if counts.sum() < LEAST_SHARE * good.sum():
            continue
        signal = raw[:, counts] - mean_dark[index, counts]
        brightness = signal.mean(axis=1, dtype=np.float64)
        mean = float(brightness.mean())
        # what shows no light is refused as such, with all exposures known
        if brightness.min() > 0:
            signal *= (mean / brightness)[:, None].astype(np.float32)
        variance = float(signal.var(axis=0, ddof=1).mean(dtype=np.float64))
        raw_level = float(level[counts].mean(dtype=np.float64))
        size = signal.shape
        points.append(TransferPoint(band_nm, exposure_s, raw_level, mean, variance, size[0], size[1]))
    if len(points) < LEAST_EXPOSURES:
        raise InputError(
            source,
            f"{band_nm}nm",
            f"is near saturation in all but {len(points)} exposures",
            f"expose it less: the noise wants {LEAST_EXPOSURES} exposures",
        )
    return points


def require_light(dark: Sequence[TransferPoint], flat: Sequence[TransferPoint], source: str | Path) -> None:
    """Refuse a band whose brightest frames do not stand out of the dark; raises `InputError`."""
    noise = max(point.variance_dn2 for point in dark) ** 0.5
    brightest = max(flat, key=lambda point: point.signal_dn)
    if not brightest.signal_dn > SEEN * noise:
        raise InputError(
            source,
            f"{brightest.band_nm}nm",
            f"shows no light: {brightest.signal_dn:.3g} DN above the dark level",
            "check lamp, filter and shutter, or expose it longer",
        )


def fit_transfer(points: Sequence[TransferPoint], source: str | Path) -> PhotonTransfer:
    """Fit the line by weighted least squares.

    The weights are the inverse variances of the points' variances, which follow from the line itself:
    2 σ⁴ / (R − 1) + K³ S / R a pixel, of R repeats with gain K and signal S, the second term being the
    fourth cumulant of Poisson's law.

    Parameters
    ----------
    points : sequence of TransferPoint
        Of dark frames and of one or more bands.
    source : str or Path
        Where the frames are from, for messages.

    Raises
    ------
    InputError
        If fewer than three points have a signal, or the frames show no noise at all.
    """
    lit = sum(point.signal_dn > 0 for point in points)
    if lit < LEAST_EXPOSURES:
        problem = f"has {lit} exposures within the range in which the camera is linear"
        raise InputError(source, "exposures_s", problem, "add shorter exposures")
    signal, variance, repeats, pixels = np.array(
        [(p.signal_dn, p.variance_dn2, p.repeats, p.pixels) for p in points], dtype=np.float64
    ).T
    if not variance.any():
        problem = "do not differ in any value"
        raise InputError(source, "repeats", problem, "take every frame anew, do not copy it")
    design = np.stack([signal, np.ones_like(signal)], axis=-1)
    predicted, gain = variance, 0.0
    # a variance that is zero by chance must not weigh without bound
    least = 1e-6 * float(variance.max())
    for _ in range(_ROUNDS):
        predicted = np.maximum(predicted, least)
        shot = max(gain, 0.0) ** 3 * np.maximum(signal, 0.0)
        errors = np.sqrt((2 * predicted**2 / (repeats - 1) + shot / repeats) / pixels)
        weighted = design / errors[:, None]
        covariance = np.linalg.inv(weighted.T @ weighted)
        gain, read_variance = covariance @ (weighted.T @ (variance / errors))
        predicted = design @ [gain, read_variance]
    scale = np.maximum(predicted, least)
    return PhotonTransfer(
        float(gain),
        float(covariance[0, 0] ** 0.5),
        float(read_variance),
        float(covariance[1, 1] ** 0.5),
        tuple(points),
        tuple(((variance - predicted) / scale).tolist()),
        tuple((errors / scale).tolist()),
    )
