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

AT_ONCE = 3
"""States read together: the dark frames then come from memory once for all of them."""

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
    rate : ndarray, shape (max(states, 32), pixels), float32
        DN/s; NaN where no exposure can be used. Planes beyond the states hold nothing: where few states
        were taken, they make room for the sixteen elements and variances that take the rates' place.
    used : ndarray, shape (states, pixels), uint8
        How many exposures are behind each rate, from the shortest on.

    Raises
    ------
    InputError
        If a frame cannot be read, or a state is saturated in most of its pixels.
    """
    states, pixels = len(store.header.states_deg), dark.usable.size
    rate, used = np.empty((max(states, 32), pixels), np.float32), np.empty((states, pixels), np.uint8)
    hot = int((dark.usable == 0).sum())
    frames = store.read_states(band_nm, *window, AT_ONCE)
    with ThreadPoolExecutor(1) as reader:
        coming = reader.submit(next, frames)
        for first in range(0, states, AT_ONCE):
            raw = coming.result()
            last = first + len(raw)
            if last < states:
                coming = reader.submit(next, frames)
            unknown = merge(store, raw, dark, noise, rate[first:last], used[first:last])
            for state, lost in enumerate(unknown, first):
                _refuse_saturated(store, f"{band_name(band_nm)}, state {state}", (lost - hot) / pixels)
    return rate, used


def merge(
    store: FrameStore,
    raw: NDArray[Any],
    dark: Darkness,
    noise: tuple[float, float],
    rate: NDArray[np.float32],
    used: NDArray[np.uint8],
) -> list[int]:
    """Merge the exposures of states (state, exposure, row, column) into `rate` and `used` (state, pixel).

    Returns for each state the number of pixels in which no exposure can be used.
    """
    flat = np.ascontiguousarray(raw.reshape(*raw.shape[:2], -1))
    seconds, top = np.array(store.header.exposures_s), store.header.saturation
    unknown: list[int] = exposures.merge(flat, dark.mean, dark.usable, seconds, top, *noise, rate, used)
    return unknown


def _refuse_saturated(store: FrameStore, field: str, share: float) -> None:
    if share > MOST_SATURATED:
        problem = f"is saturated at every exposure in {100 * share:.0f} % of its pixels"
        raise InputError(store.path, field, problem, "expose it less")
