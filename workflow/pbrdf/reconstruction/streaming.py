"""The states of a light, read and merged one after the other: the raw frames are never all in memory."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from pbrdf._kernels import exposures
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FramesHeader, FrameStore, band_name
from pbrdf.reconstruction.dark import Darkness

AT_ONCE = 3
"""States read together: the dark frames then come from memory once for all of them. A band of 36 states at
three exposures of 3376 × 2704 pixels is read in 1.0 s into memory used again, in 2.0 s into fresh pages."""

MOST_SATURATED = 0.5
"""Share of a window's pixels: highlights stay far below it, a sphere that is over-exposed fills more."""


@dataclass(frozen=True)
class Workspace:
    """Memory in which a band is worked on, good for the next band: fresh pages cost more than the arithmetic.

    Attributes
    ----------
    planes : ndarray, shape (max(states, 34), pixels), float32
        Rates of the states; then, in the place of the first, sixteen elements, their variances, and the sums
        of squared residuals and what is expected of them.
    used : ndarray, shape (states, pixels), uint8
        How many exposures are behind each rate, from the shortest on.
    raw : ndarray, shape (2, states at once, exposures, rows, columns), type of the camera
        Frames being read and frames being merged.
    """

    planes: NDArray[np.float32]
    used: NDArray[np.uint8]
    raw: NDArray[Any]

    @classmethod
    def of(cls, header: FramesHeader, window: tuple[slice, slice]) -> Workspace:
        """Memory for the window of a band of such frames."""
        states = len(header.states_deg)
        rows, columns = window_shape(header, window)
        pixels = rows * columns
        return cls(
            np.empty((max(states, 34), pixels), np.float32),
            np.empty((states, pixels), np.uint8),
            np.empty((2, min(AT_ONCE, states), len(header.exposures_s), rows, columns), header.dtype),
        )

    def fits(self, header: FramesHeader, window: tuple[slice, slice]) -> bool:
        """Whether it is memory for the window of a band of such frames."""
        states = len(header.states_deg)
        shape = window_shape(header, window)
        return (
            self.used.shape == (states, math.prod(shape))
            and self.raw.shape[2:] == (len(header.exposures_s), *shape)
            and self.raw.dtype == header.dtype
        )


class StatesAhead:
    """The states of a band, the next ones being read while some are worked on.

    Reading begins at once; leaving the context ends it. Without a workspace it takes fresh memory; one that
    does not fit raises `ValueError`.
    """

    def __init__(
        self,
        store: FrameStore,
        band_nm: int,
        window: tuple[slice, slice],
        workspace: Workspace | None = None,
    ) -> None:
        self.store, self.band_nm = store, band_nm
        self.workspace = workspace or Workspace.of(store.header, window)
        if not self.workspace.fits(store.header, window):
            raise ValueError(f"the workspace of {self.workspace.raw.shape} frames is not for {store.path}")
        self._frames = store.read_states(band_nm, *window, list(self.workspace.raw))
        self._reader = ThreadPoolExecutor(1)
        # one into each half of the memory
        self._coming = deque(self._reader.submit(next, self._frames, None) for _ in self.workspace.raw)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._reader.shutdown(cancel_futures=True)

    def __iter__(self) -> Iterator[NDArray[Any]]:
        """Some states (state, exposure, row, column) at a time; raises as `FrameStore.read_states`."""
        while (raw := self._coming.popleft().result()) is not None:
            yield raw
            self._coming.append(self._reader.submit(next, self._frames, None))


def merged_states(ahead: StatesAhead, dark: Darkness, noise: tuple[float, float]) -> Workspace:
    """Merge the exposures of every state.

    Parameters
    ----------
    ahead : StatesAhead
        The raw frames.
    dark : Darkness
        Of the same window.
    noise : tuple of float
        DN per electron and read noise in DN.

    Returns
    -------
    Workspace
        That of the frames. Its first planes hold the states' rates, DN/s; NaN where no exposure can be used.

    Raises
    ------
    InputError
        If a frame cannot be read, or a state is saturated in most of its pixels.
    """
    rate, used = ahead.workspace.planes, ahead.workspace.used
    pixels = dark.usable.size
    hot = int((dark.usable == 0).sum())
    first = 0
    for raw in ahead:
        last = first + len(raw)
        unknown = merge(ahead.store, raw, dark, noise, rate[first:last], used[first:last])
        for state, lost in enumerate(unknown, first):
            field = f"{band_name(ahead.band_nm)}, state {state}"
            _refuse_saturated(ahead.store, field, (lost - hot) / pixels)
        first = last
    return ahead.workspace


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


def window_shape(header: FramesHeader, window: tuple[slice, slice]) -> tuple[int, int]:
    """Rows and columns of the window of a frame."""
    rows, columns = (
        len(range(length)[part]) for length, part in zip((header.rows, header.columns), window, strict=True)
    )
    return rows, columns


def _refuse_saturated(store: FrameStore, field: str, share: float) -> None:
    if share > MOST_SATURATED:
        problem = f"is saturated at every exposure in {100 * share:.0f} % of its pixels"
        raise InputError(store.path, field, problem, "expose it less")
