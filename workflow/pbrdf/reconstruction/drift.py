"""The lamp's power while the states of a band are photographed, told by a state that is repeated."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FrameStore, band_name
from pbrdf.reconstruction.dark import Darkness
from pbrdf.reconstruction.streaming import merge

Float = NDArray[np.float64]

BRIGHT = 0.05
"""Share of the brightest pixels' light: what is darker tells more of noise than of the lamp."""


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
        One at the reference state itself. Between its takings the power follows the cubic spline
        through them over the number of states taken (a straight line through two, a parabola
        through three); before the first and after the last it stays. Ones where no state is repeated.

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
    takings = [_rate(store, raw, dark, noise) for raw in (own, *store.read_references(band_nm, *window))]
    bright = _bright([rate for rate, _ in takings])
    first, first_used = takings[0]
    power = []
    for again, used in takings[1:]:
        alike = bright & (used == first_used) & (used > 0)
        before, now = (float(rate[alike].sum(dtype=np.float64)) for rate in (first, again))
        if not min(before, now) > 0.0:
            raise InputError(
                store.path, f"{band_name(band_nm)}, reference", "shows no light", "repeat a state that does"
            )
        power.append(now / before)
    after = np.asarray(header.references)
    taken_before = states + np.searchsorted(after, states, side="right")
    places = np.append(after + np.arange(len(after)), taken_before[header.reference_state])
    order = np.argsort(places)
    spline = CubicSpline(places[order], np.append(power, 1.0)[order])
    between: Float = spline(np.clip(taken_before, places[order][0], places[order][-1]))
    return between


def _bright(rates: list[NDArray[np.float32]]) -> NDArray[np.bool_]:
    """Pixels that are bright on average over the takings; darkness would add its noise alone."""
    mean = np.mean(rates, axis=0)
    known = np.nan_to_num(mean)
    bright: NDArray[np.bool_] = known > BRIGHT * np.quantile(known, 0.999)
    return bright


def _rate(
    store: FrameStore, raw: NDArray[Any], dark: Darkness, noise: tuple[float, float]
) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    rate, used = np.empty((1, dark.usable.size), np.float32), np.empty((1, dark.usable.size), np.uint8)
    merge(store, raw[None], dark, noise, rate, used)
    return rate[0], used[0]
