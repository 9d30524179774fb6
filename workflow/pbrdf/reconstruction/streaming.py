"""The states of a light, read and merged one after the other: the raw frames are never all in memory."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from pbrdf._kernels import planes, solve
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FrameStore, band_name

MOST_SATURATED = 0.5
"""Share of a window's pixels: highlights stay far below it, a sphere that is over-exposed fills more."""

GROUP = 9
"""States whose variances are kept until they are added: each addition passes over all sixteen planes."""


def merged_states(
    store: FrameStore,
    band_nm: int,
    window: tuple[slice, slice],
    noise: tuple[float, float],
    weights: NDArray[np.float64],
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Merge the exposures of every state, the next state being read meanwhile.

    Parameters
    ----------
    store : FrameStore
        The raw frames.
    band_nm : int
        Band centre, nm.
    window : tuple of slice
        Rows and columns.
    noise : tuple of float
        DN per electron and read noise in DN.
    weights : ndarray, shape (16, states)
        Squares of the data reduction matrix: what the variance of a state adds to that of an element.

    Returns
    -------
    rate : ndarray, shape (states, pixels), float32
        DN/s; NaN where every exposure is saturated.
    variance : ndarray, shape (16, pixels), float32
        Variance of the Mueller elements; NaN where a state is.

    Raises
    ------
    InputError
        If a frame cannot be read, or a state is saturated in most of its pixels.
    """
    header = store.header
    dark = store.mean_dark(*window)
    exposures, pixels = dark.shape[0], dark[0].size
    flat_dark = dark.reshape(exposures, pixels)
    seconds = np.array(header.exposures_s)
    states = len(header.states_deg)
    rate = np.empty((states, pixels), np.float32)
    variance = np.empty((16, pixels), np.float32)
    group = np.empty((min(GROUP, states), pixels), np.float32)
    frames = store.read_states(band_nm, *window)
    with ThreadPoolExecutor(1) as reader:
        coming = reader.submit(next, frames)
        for state in range(states):
            raw = coming.result()
            if state + 1 < states:
                coming = reader.submit(next, frames)
            first = state - state % GROUP
            missing = solve.merge_exposures(
                np.ascontiguousarray(raw.reshape(exposures, pixels)),
                flat_dark,
                seconds,
                header.saturation,
                *noise,
                rate[state],
                group[state - first],
            )
            if missing > MOST_SATURATED * pixels:
                field = f"{band_name(band_nm)}, state {state}"
                problem = f"is saturated at every exposure in {100 * missing / pixels:.0f} % of its pixels"
                raise InputError(store.path, field, problem, "expose it less")
            if state - first == GROUP - 1 or state == states - 1:
                last = state + 1
                part = np.ascontiguousarray(weights[:, first:last])
                planes.combine(group[: last - first], part, variance, add=first > 0)
    return rate, variance
