"""The states of a light, read and merged one after the other: the raw frames are never all in memory."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Self

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


@dataclass(frozen=True)
class Workspace:
    """Memory in which a band is worked on, good for the next band: fresh pages cost more than the arithmetic.

    Attributes
    ----------
    planes : ndarray, shape (max(states, 32), pixels), float32
        Rates of the states, then sixteen elements and their variances in the place of the first.
    used : ndarray, shape (states, pixels), uint8
        How many exposures are behind each rate, from the shortest on.
    """

    planes: NDArray[np.float32]
    used: NDArray[np.uint8]

    @classmethod
    def of(cls, states: int, pixels: int) -> Workspace:
        """Memory for so many states and pixels."""
        return cls(np.empty((max(states, 32), pixels), np.float32), np.empty((states, pixels), np.uint8))


class StatesAhead:
    """The states of a band, the next ones being read while some are worked on.

    Reading begins at once; leaving the context ends it.
    """

    def __init__(self, store: FrameStore, band_nm: int, window: tuple[slice, slice]) -> None:
        self.store, self.band_nm = store, band_nm
        self._frames = store.read_states(band_nm, *window, AT_ONCE)
        self._reader = ThreadPoolExecutor(1)
        self._coming = self._reader.submit(next, self._frames, None)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._reader.shutdown(cancel_futures=True)

    def __iter__(self) -> Iterator[NDArray[Any]]:
        """Some states (state, exposure, row, column) at a time; raises as `FrameStore.read_states`."""
        while (raw := self._coming.result()) is not None:
            self._coming = self._reader.submit(next, self._frames, None)
            yield raw


def merged_states(
    ahead: StatesAhead, dark: Darkness, noise: tuple[float, float], workspace: Workspace | None = None
) -> Workspace:
    """Merge the exposures of every state.

    Parameters
    ----------
    ahead : StatesAhead
        The raw frames.
    dark : Darkness
        Of the same window.
    noise : tuple of float
        DN per electron and read noise in DN.
    workspace : Workspace, optional
        Where to work; by default fresh memory.

    Returns
    -------
    Workspace
        Its first planes hold the states' rates, DN/s; NaN where no exposure can be used.

    Raises
    ------
    InputError
        If a frame cannot be read, or a state is saturated in most of its pixels.
    ValueError
        If the workspace does not fit.
    """
    states, pixels = len(ahead.store.header.states_deg), dark.usable.size
    workspace = workspace or Workspace.of(states, pixels)
    rate, used = workspace.planes, workspace.used
    if used.shape != (states, pixels) or rate.shape != (max(states, 32), pixels):
        raise ValueError(f"the workspace is for {used.shape} states and pixels, expected {(states, pixels)}")
    hot = int((dark.usable == 0).sum())
    first = 0
    for raw in ahead:
        last = first + len(raw)
        unknown = merge(ahead.store, raw, dark, noise, rate[first:last], used[first:last])
        for state, lost in enumerate(unknown, first):
            field = f"{band_name(ahead.band_nm)}, state {state}"
            _refuse_saturated(ahead.store, field, (lost - hot) / pixels)
        first = last
    return workspace


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
