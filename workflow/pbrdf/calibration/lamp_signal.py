"""What the lamp's disc shows of each state: one signal a state, averaged over its pixels."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf.calibration.lamp_disc import lamp_pixels
from pbrdf.capture.frames import in_order
from pbrdf.formats.capture_store import FramesHeader, FrameStore, band_name

Float = NDArray[np.float64]
Mask = NDArray[np.bool_]
WHOLE = (slice(None), slice(None))

LOST = 0.01
"""Share of the disc's pixels that may saturate in an exposure, and then count in no state."""


@dataclass(frozen=True)
class LampSignal:
    """Signals of a band in the order in which they were taken, repeats among them.

    Attributes
    ----------
    states_deg : ndarray, shape (N, 4)
        Scale readings.
    signal, noise : ndarray, shape (N,)
        Mean over the disc above the dark level, and its standard deviation, DN/s.
    exposure_s : float
        Exposure that they are from: the longest in which no state saturates.
    pixels : int
    """

    states_deg: Float
    signal: Float
    noise: Float
    exposure_s: float
    pixels: int


def lamp_signal(store: FrameStore, band_nm: int) -> LampSignal:
    """Average the lamp's disc over its pixels, state by state.

    The noise of a mean is told by the scatter of the pixels about what the disc shows in all states
    together, so that it holds whatever the disc's own shape is.

    Parameters
    ----------
    store : FrameStore
        Photographs of the lamp through an element.
    band_nm : int

    Raises
    ------
    InputError
        If a frame cannot be read, the lamp is not there, or it saturates at every exposure.
    """
    header = store.header
    dark = store.mean_dark(*WHOLE)
    mean, saturates = _over_states(store, band_nm)
    brightness = np.where(saturates[0], np.nan, mean[0] - dark[0])
    variance = np.full(brightness.shape, _dark_noise(dark[0], header) ** 2)
    disc = lamp_pixels(brightness, variance, store.path, band_name(band_nm))
    exposure = max(e for e, frame in enumerate(saturates) if e == 0 or frame[disc].mean() <= LOST)
    disc &= ~saturates[exposure]
    shape = (mean[exposure] - dark[exposure])[disc].astype(np.float64)
    seconds = header.exposures_s[exposure]
    signal, noise = [], []
    for frames in _taken(store, band_nm):
        values = frames[exposure][disc] - dark[exposure][disc].astype(np.float64)
        signal.append(values.mean())
        scatter = values - shape * (signal[-1] / shape.mean())
        noise.append(np.sqrt(scatter @ scatter / values.size**2))
    # of values that all fall on one step of the converter
    least = _step(header) / np.sqrt(12.0 * shape.size)
    states = [
        header.states_deg[header.reference_state if repeat else state] for state, repeat in in_order(header)
    ]
    return LampSignal(
        np.array(states),
        np.array(signal) / seconds,
        np.maximum(noise, least) / seconds,
        seconds,
        shape.size,
    )


def _over_states(store: FrameStore, band_nm: int) -> tuple[Float, Mask]:
    """Mean frame and pixels that saturate in any state, of each exposure: (exposure, row, column)."""
    header = store.header
    total = np.zeros((len(header.exposures_s), header.rows, header.columns))
    saturates = np.zeros(total.shape, np.bool_)
    for (frames,) in store.read_states(band_nm, *WHOLE):
        total += frames
        saturates |= frames >= header.saturation
    return total / len(header.states_deg), saturates


def _taken(store: FrameStore, band_nm: int) -> Iterator[NDArray[Any]]:
    """Frames (exposure, row, column) of states and repeats in the order of the run."""
    states, repeats = store.read_states(band_nm, *WHOLE), store.read_references(band_nm, *WHOLE)
    for _, repeat in in_order(store.header):
        yield next(repeats) if repeat else next(states)[0]


def _dark_noise(dark: NDArray[np.float32], header: FramesHeader) -> float:
    """Standard deviation of a pixel of the mean over states, from the pixels of the mean dark frame."""
    scatter = 1.4826 * float(np.median(np.abs(dark - np.median(dark))))
    averaged = math.sqrt(1.0 + header.darks / len(header.states_deg))
    return max(scatter * averaged, _step(header))


def _step(header: FramesHeader) -> float:
    """Step of the converter, DN; 0 for frames of real numbers."""
    return float(1 << header.shift) if header.dtype.startswith("uint") else 0.0
