"""What the camera sees in the dark, and which pixels cannot be used for it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FrameStore

HOT_SCATTERS = 10.0
"""A pixel whose mean dark value exceeds the median by so many robust standard deviations is hot."""

SAMPLE = 1 << 16
"""Pixels from which the scatter of a dark frame is told."""


@dataclass(frozen=True)
class Darkness:
    """Dark frames of a window.

    Attributes
    ----------
    mean : ndarray, shape (exposures, pixels), float32
        DN; zero where none was taken.
    usable : ndarray, shape (pixels,), uint8
        How many of the shortest exposures a pixel may use: dark current grows with time.
    """

    mean: NDArray[np.float32]
    usable: NDArray[np.uint8]


def darkness(store: FrameStore, window: tuple[slice, slice]) -> Darkness:
    """Mean dark frames of a window, and its hot pixels.

    Raises
    ------
    InputError
        If a dark frame cannot be read, or no pixel can be used.
    """
    header = store.header
    mean = store.mean_dark(*window)
    mean = mean.reshape(len(mean), -1)
    least_step = float(1 << header.shift) if header.dtype.startswith("uint") else 0.0
    still_cold = np.ones(mean.shape[1], np.bool_)
    usable = np.zeros(mean.shape[1], np.uint8)
    for frame in mean:
        still_cold &= _cold(frame, header.saturation, least_step)
        usable += still_cold
    if not usable.any():
        raise InputError(
            store.path, "dark", "saturates every pixel", "take the dark frames again, with the lamp covered"
        )
    return Darkness(mean, usable)


def _cold(frame: NDArray[np.float32], saturation: float, least_step: float) -> NDArray[np.bool_]:
    sample = frame[:: max(1, frame.size // SAMPLE)]
    median = np.median(sample)
    scatter = max(1.4826 * float(np.median(np.abs(sample - median))), least_step)
    cold: NDArray[np.bool_] = (frame <= median + HOT_SCATTERS * scatter) & (frame < saturation)
    return cold
