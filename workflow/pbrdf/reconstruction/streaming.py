"""The states of a light, read and merged one after the other: the raw frames are never all in memory."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf._kernels import exposures
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FrameStore, band_name
from pbrdf.reconstruction.dark import Darkness

MOST_SATURATED = 0.5
"""Share of a window's pixels: highlights stay far below it, a sphere that is over-exposed fills more."""


def merged_states(
    store: FrameStore,
    band_nm: int,
    window: tuple[slice, slice],
    dark: Darkness,
    noise: tuple[float, float],
) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    """Merge the exposures of every state, the next state being read meanwhile.

    Parameters
    ----------
    store : FrameStore
        The raw frames.
    band_nm : int
        Band centre, nm.
    window : tuple of slice
        Rows and columns.
    dark : Darkness
        Of the same window.
    noise : tuple of float
        DN per electron and read noise in DN.

    Returns
    -------
    rate : ndarray, shape (states, pixels), float32
        DN/s; NaN where no exposure can be used.
    used : ndarray, shape (states, pixels), uint8
        How many exposures are behind each rate, from the shortest on.

    Raises
    ------
    InputError
        If a frame cannot be read, or a state is saturated in most of its pixels.
    """
    states, pixels = len(store.header.states_deg), dark.usable.size
    rate, used = np.empty((states, pixels), np.float32), np.empty((states, pixels), np.uint8)
    hot = int((dark.usable == 0).sum())
    frames = store.read_states(band_nm, *window)
    with ThreadPoolExecutor(1) as reader:
        coming = reader.submit(next, frames)
        for state in range(states):
            raw = coming.result()
            if state + 1 < states:
                coming = reader.submit(next, frames)
            saturated = merge_state(store, raw, dark, noise, rate[state], used[state]) - hot
            if saturated > MOST_SATURATED * pixels:
                field = f"{band_name(band_nm)}, state {state}"
                problem = f"is saturated at every exposure in {100 * saturated / pixels:.0f} % of its pixels"
                raise InputError(store.path, field, problem, "expose it less")
    return rate, used


def merge_state(
    store: FrameStore,
    raw: NDArray[Any],
    dark: Darkness,
    noise: tuple[float, float],
    rate: NDArray[np.float32],
    used: NDArray[np.uint8],
) -> int:
    """Merge the exposures (exposure, row, column) of one state into `rate` and `used`, each (pixels,).

    Returns the number of pixels in which no exposure can be used.
    """
    flat = np.ascontiguousarray(raw.reshape(len(raw), -1))
    seconds, top = np.array(store.header.exposures_s), store.header.saturation
    return int(exposures.merge(flat, dark.mean, dark.usable, seconds, top, *noise, rate, used))
