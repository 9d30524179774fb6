"""The lamp's power while the states of a band are photographed, told by a state that is repeated."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FrameStore, band_name
from pbrdf.reconstruction.dark import Darkness
from pbrdf.reconstruction.streaming import merge

Float = NDArray[np.float64]


def lamp_power(
    store: FrameStore,
    band_nm: int,
    window: tuple[slice, slice],
    dark: Darkness,
    noise: tuple[float, float],
) -> Float:
    """Power of the lamp at every state relative to the one that is repeated.

    Parameters
    ----------
    store : FrameStore
    band_nm : int
    window : tuple of slice
        Rows and columns.
    dark : Darkness
        Of the same window.
    noise : tuple of float
        DN per electron and read noise in DN.

    Returns
    -------
    ndarray, shape (states,), float64
        One at the reference state itself. Between two of its takings the power changes linearly with the
        number of states taken; before the first and after the last it stays. Ones where no state is
        repeated.

    Raises
    ------
    InputError
        If a frame cannot be read, or the repeated state shows no light.
    """
    header = store.header
    states = np.arange(len(header.states_deg))
    if not header.references:
        return np.ones(len(states))
    own = store.read_state(band_nm, header.reference_state, *window)
    first, first_used = _rate(store, own, dark, noise)
    power = []
    for raw in store.read_references(band_nm, *window):
        again, used = _rate(store, raw, dark, noise)
        alike = (used == first_used) & (used > 0)
        before, now = (float(rate[alike].sum(dtype=np.float64)) for rate in (first, again))
        if not min(before, now) > 0.0:
            raise InputError(
                store.path,
                f"{band_name(band_nm)}, reference",
                "shows no light",
                "repeat a state that does",
            )
        power.append(now / before)
    after = np.asarray(header.references)
    taken_before = states + np.searchsorted(after, states, side="right")
    places = np.append(after + np.arange(len(after)), taken_before[header.reference_state])
    order = np.argsort(places)
    interpolated: Float = np.interp(taken_before, places[order], np.append(power, 1.0)[order])
    return interpolated


def _rate(
    store: FrameStore, raw: NDArray[Any], dark: Darkness, noise: tuple[float, float]
) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    rate, used = np.empty((1, dark.usable.size), np.float32), np.empty((1, dark.usable.size), np.uint8)
    merge(store, raw[None], dark, noise, rate, used)
    return rate[0], used[0]
