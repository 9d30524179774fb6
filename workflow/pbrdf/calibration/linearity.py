"""How straight a camera's signal follows the exposure time, and up to which value."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Mask = NDArray[np.bool_]

TOLERANCE = 0.005
"""Relative deviation from which on a camera no longer counts as linear."""

BINS = 64
"""Levels between zero and saturation at which the deviation is told."""

SAMPLE = 1 << 20
"""Pixels from which the deviation is told, evenly spread over the frame."""

LEAST_PIXELS = 100
"""Values in a bin for it to count."""

SURE = 4.0
"""Standard errors by which a deviation must exceed the tolerance."""

_LOWER = 0.5
"""Share of saturation below which a pixel's values tell its own rate."""

_DIM = 0.01
"""Share of saturation below which a signal tells the dark level's errors rather than the camera's."""


@dataclass(frozen=True)
class LevelSums:
    """Sums over values by the raw level that was expected of them; arrays of `BINS` entries.

    Attributes
    ----------
    count : ndarray
        Number of values.
    expected, excess, excess_square : ndarray
        Of the expected signals, and of the signals less these and its square; DN and DN².
    """

    count: Float
    expected: Float
    excess: Float
    excess_square: Float

    def __add__(self, other: LevelSums) -> LevelSums:
        return LevelSums(
            self.count + other.count,
            self.expected + other.expected,
            self.excess + other.excess,
            self.excess_square + other.excess_square,
        )


@dataclass(frozen=True)
class Linearity:
    """Deviation of the signal from proportionality to the exposure time.

    Attributes
    ----------
    level_dn, deviation, deviation_error : ndarray, shape (levels,)
        Raw level in the middle of each bin that has values, the signal's deviation relative to what is
        expected there, and its standard error.
    limit_dn : float or None
        Raw value from which on the deviation is beyond `TOLERANCE`; None if it stays below.
    tested_to_dn : float
        Raw value up to which the exposures reach.
    """

    level_dn: Float
    deviation: Float
    deviation_error: Float
    limit_dn: float | None
    tested_to_dn: float

    @property
    def largest_deviation(self) -> float:
        """Largest relative deviation below the limit, by magnitude; zero if nothing is below it."""
        within = self.level_dn < (np.inf if self.limit_dn is None else self.limit_dn)
        return float(np.abs(self.deviation[within]).max(initial=0.0))


def level_sums(
    frames: NDArray[Any],
    mean_dark: NDArray[np.float32],
    exposures_s: Sequence[float],
    good: Mask,
    saturation: float,
) -> LevelSums:
    """Hold a band's frames against what their pixels' own rates make expected.

    A pixel's rate is that of all its values in the lower half of the range, so that uneven pixels and
    vignetting do not matter. Half of the repeats tell the level that a value belongs to and the other
    half its deviation, then the other way round: levels picked by the same noise would be off by it.

    Parameters
    ----------
    frames : ndarray, shape (repeat, exposure, pixels)
        DN, of light that does not change.
    mean_dark : ndarray, shape (exposure, pixels), float32
        DN.
    exposures_s : sequence of float
    good : ndarray, shape (pixels,), bool
        Pixels that are not hot.
    saturation : float
        DN.
    """
    chosen = np.flatnonzero(good)
    chosen = chosen[:: max(1, len(chosen) // SAMPLE)]
    dark = mean_dark[:, chosen].astype(np.float64)
    seconds = np.asarray(exposures_s, dtype=np.float64)[:, None]
    one, other = (
        _signal_and_expected(frames[half][:, :, chosen], dark, seconds, saturation)
        for half in (slice(0, None, 2), slice(1, None, 2))
    )
    return _binned(dark + one[1], *other, saturation) + _binned(dark + other[1], *one, saturation)


def _signal_and_expected(
    frames: NDArray[Any], dark: Float, seconds: Float, saturation: float
) -> tuple[Float, Float]:
    """Mean signals above dark (exposure, pixels), and what the pixels' rates make of the times."""
    level = frames.mean(axis=0, dtype=np.float64)
    signal = level - dark
    low = level < _LOWER * saturation
    time = (low * seconds).sum(axis=0)
    rate = np.divide((low * signal).sum(axis=0), time, out=np.full(time.shape, np.nan), where=time > 0)
    return signal, rate * seconds


def _binned(level: Float, signal: Float, expected: Float, saturation: float) -> LevelSums:
    counts = np.isfinite(level + expected) & (level >= 0) & (level < saturation)
    counts &= expected >= _DIM * saturation
    index = (level[counts] * (BINS / saturation)).astype(np.intp)
    excess = (signal - expected)[counts]

    def summed(values: Float) -> Float:
        # rounding may put a level just below saturation on the last edge
        return np.bincount(np.minimum(index, BINS - 1), values, minlength=BINS).astype(np.float64)

    return LevelSums(summed(np.ones(len(index))), summed(expected[counts]), summed(excess), summed(excess**2))


def linearity(sums: LevelSums, saturation: float) -> Linearity:
    """Deviation by level, and the level from which on it is too large.

    Parameters
    ----------
    sums : LevelSums
        Of all bands.
    saturation : float
        DN.
    """
    filled = sums.count >= LEAST_PIXELS
    count, expected, excess = sums.count[filled], sums.expected[filled], sums.excess[filled]
    deviation = excess / expected
    scatter = np.maximum(sums.excess_square[filled] - excess**2 / count, 0.0)
    error = np.sqrt(scatter) / expected
    edges = np.arange(BINS + 1) * (saturation / BINS)
    lower, upper = edges[:-1][filled], edges[1:][filled]
    beyond = np.abs(deviation) > TOLERANCE + SURE * error
    return Linearity(
        (lower + upper) / 2,
        deviation,
        error,
        float(lower[beyond][0]) if beyond.any() else None,
        float(upper[-1]) if len(upper) else 0.0,
    )
