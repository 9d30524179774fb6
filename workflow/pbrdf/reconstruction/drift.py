"""The lamp's power while the states of a band are photographed, told by a state that is repeated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FramesHeader, FrameStore, band_name
from pbrdf.reconstruction.dark import Darkness
from pbrdf.reconstruction.streaming import merge

Float = NDArray[np.float64]

_ONE_POLYNOMIAL = 4
"""Points up to which SciPy's spline ("not a knot") is the polynomial through them."""

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
    if not store.header.references:
        return np.ones(len(store.header.states_deg))
    takings = _takings(store, band_nm, window, dark, noise)
    return _over_states(store.header, np.append(_powers(store, band_nm, takings), 1.0))


def lamp_power_errors(
    store: FrameStore,
    band_nm: int,
    window: tuple[slice, slice],
    dark: Darkness,
    noise: tuple[float, float],
) -> Float:
    """What the noise of each taking of the repeated state does to `lamp_power`, with the same parameters.

    The noise is that of the sum over the bright pixels, told by their scatter about what all takings
    show together.

    Returns
    -------
    ndarray, shape (states, takings), float64
        Error of the power at each state for one standard deviation of each taking; takings are
        independent. No columns where no state is repeated.

    Raises
    ------
    InputError
        As `lamp_power`.
    """
    header = store.header
    if not header.references:
        return np.zeros((len(header.states_deg), 0))
    takings = _takings(store, band_nm, window, dark, noise)
    powers = np.append(1.0, _powers(store, band_nm, takings))
    known = takings.bright & (takings.used > 0).all(axis=0)
    level = takings.rates[:, known].astype(np.float64) / powers[:, None]
    mean = level.mean(axis=0)
    # each taking is part of the mean: that makes its scatter about it smaller
    freed = len(level) / (len(level) - 1)
    relative = np.sqrt(freed * ((level - mean) ** 2).sum(axis=1)) / mean.sum()
    # the state's own taking comes last, and is what all others are divided by
    moved = np.diag(np.append(powers[1:] * relative[1:], 0.0))
    moved[:-1, -1] = -powers[1:] * relative[0]
    return _over_states(header, moved)


@dataclass(frozen=True)
class _Takings:
    """Takings of the repeated state, its own first.

    Attributes
    ----------
    rates : ndarray, shape (takings, pixels), float32
        DN/s; NaN where no exposure can be used.
    used : ndarray, shape (takings, pixels), uint8
        How many exposures each rate is from.
    bright : ndarray, shape (pixels,), bool
    """

    rates: NDArray[np.float32]
    used: NDArray[np.uint8]
    bright: NDArray[np.bool_]


def _takings(
    store: FrameStore,
    band_nm: int,
    window: tuple[slice, slice],
    dark: Darkness,
    noise: tuple[float, float],
) -> _Takings:
    own = store.read_state(band_nm, store.header.reference_state, *window)
    takings = [_rate(store, raw, dark, noise) for raw in (own, *store.read_references(band_nm, *window))]
    rates = np.stack([rate for rate, _ in takings])
    return _Takings(rates, np.stack([used for _, used in takings]), _bright(rates))


def _powers(store: FrameStore, band_nm: int, takings: _Takings) -> Float:
    """Power of each repeat relative to the state's own taking."""
    first, first_used = takings.rates[0], takings.used[0]
    power = []
    for again, used in zip(takings.rates[1:], takings.used[1:], strict=True):
        alike = takings.bright & (used == first_used) & (used > 0)
        before, now = (float(rate[alike].sum(dtype=np.float64)) for rate in (first, again))
        if not min(before, now) > 0.0:
            raise InputError(
                store.path, f"{band_name(band_nm)}, reference", "shows no light", "repeat a state that does"
            )
        power.append(now / before)
    return np.array(power)


def _over_states(header: FramesHeader, at_takings: Float) -> Float:
    """Values (takings, …), repeats first and the state's own taking last, carried to all states."""
    states = np.arange(len(header.states_deg))
    after = np.asarray(header.references)
    taken_before = states + np.searchsorted(after, states, side="right")
    places = np.append(after + np.arange(len(after)), taken_before[header.reference_state])
    order = np.argsort(places)
    known, values = places[order], at_takings[order]
    return _through(known, values, np.clip(taken_before, known[0], known[-1]))


def _through(places: NDArray[np.intp], values: Float, at: NDArray[np.intp]) -> Float:
    """Cubic spline through values (places, …) at other places; it is one polynomial through up to four."""
    between: Float
    if len(places) > _ONE_POLYNOMIAL:
        # its import takes as long as the rest of a small light
        from scipy.interpolate import CubicSpline

        between = CubicSpline(places, values)(at)
        return between
    # Lagrange's weights, which are exactly one and zero at the places themselves
    own = np.eye(len(places), dtype=bool)
    factors = (at[:, None, None] - places) / np.where(own, 1, places[:, None] - places)
    between = np.where(own, 1.0, factors).prod(axis=-1) @ values
    return between


def _bright(rates: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Pixels that are bright on average over the takings; darkness would add its noise alone."""
    mean = rates.mean(axis=0)
    known = np.nan_to_num(mean)
    bright: NDArray[np.bool_] = known > BRIGHT * np.quantile(known, 0.999)
    return bright


def _rate(
    store: FrameStore, raw: NDArray[Any], dark: Darkness, noise: tuple[float, float]
) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    rate, used = np.empty((1, dark.usable.size), np.float32), np.empty((1, dark.usable.size), np.uint8)
    merge(store, raw[None], dark, noise, rate, used)
    return rate[0], used[0]
