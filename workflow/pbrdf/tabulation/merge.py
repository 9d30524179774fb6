"""From slices to the table: each node between the lights whose θd bracket it."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pbrdf._kernels import merge
from pbrdf.errors import InputError
from pbrdf.formats.table_data import Origin
from pbrdf.settings.plan import HALF_TURN
from pbrdf.tabulation.axes import Axes
from pbrdf.tabulation.band import Band, possible_nodes
from pbrdf.tabulation.slices import SliceFile

_Arrays = tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.uint16], NDArray[np.float64]]


def open_slices(paths: Sequence[str | Path], axes: Axes, source: str) -> list[SliceFile]:
    """Slices of a table by ascending angle of the arm.

    Parameters
    ----------
    paths : sequence of paths
        Slices, in any order.
    axes : Axes
        Nodes of the table.
    source : str
        What the table is called in messages.

    Raises
    ------
    InputError
        If there are fewer than two slices, one is damaged, they differ in bands or nodes, share an angle of
        the arm, or stand beyond half a turn.
    """
    if len(paths) < 2:
        raise InputError(source, "slices", f"there are {len(paths)}", "photograph at least two lights")
    slices = sorted(map(SliceFile, paths), key=lambda part: part.angle_deg)
    nodes = (len(axes.theta_h), len(axes.phi_d))
    for part in slices:
        if part.theta_d.shape != nodes:
            problem = f"has {part.theta_d.shape} nodes of θh and φd where the table has {nodes}"
            raise InputError(part.path, "theta_d", problem, "make the slice again with this config")
    for low, high in pairwise(slices):
        if high.angle_deg == low.angle_deg:
            problem = f"two have the arm at {low.angle_deg:g}°"
            raise InputError(source, "slices", problem, "keep one of them")
        if high.bands_nm != low.bands_nm:
            problem = f"differ in bands: {high.bands_nm} nm at {high.angle_deg:g}°, {low.bands_nm} nm before"
            raise InputError(source, "slices", problem, "make them again with one config")
    if slices[-1].angle_deg > HALF_TURN:
        problem = f"one has the arm at {slices[-1].angle_deg:g}°, beyond {HALF_TURN:g}°"
        raise InputError(source, "slices", problem, "use lights of one side")
    return slices


def merge_band(slices: Sequence[SliceFile], index: int, axes: Axes, widest_gap: float = np.inf) -> Band:
    """One band of a table, light by light: four are in memory at a time.

    Between the two lights whose θd bracket it a node lies on the polynomial through both and, where they
    see it, the light before and the one after: at lights 4° apart the cubic's error is a thirtieth of the
    straight line's.

    Parameters
    ----------
    slices : sequence of SliceFile
        Of `open_slices`.
    index : int
        Of the band.
    axes : Axes
    widest_gap : float
        Widest step of θd between two lights that is interpolated, radians; beyond it nodes stay unseen,
        but for those at exactly the θd of a light.

    Returns
    -------
    Band
        NaN where nothing was measured. The variance is that of a weighted sum of independent lights.

    Raises
    ------
    InputError
        If a slice is damaged.
    """
    mueller = np.full((*axes.shape, 4, 4), np.nan, np.float32)
    variance = np.full_like(mueller, np.nan)
    count = np.zeros(axes.shape, np.uint16)
    window = [_arrays(part, index) for part in slices[:2]]
    for high in range(1, len(slices)):
        if high + 1 < len(slices):
            window.append(_arrays(slices[high + 1], index))
        merge.interpolate(window, min(high - 1, 1), axes.theta_d, widest_gap, mueller, variance, count)
        if high > 1:
            del window[0]
    origin = np.full(axes.shape, Origin.NEVER_VISIBLE, np.uint8)
    origin[possible_nodes(axes)] = Origin.UNSEEN
    origin[count > 0] = Origin.MEASURED
    return Band(axes, mueller, variance, count, origin)


def _arrays(part: SliceFile, index: int) -> _Arrays:
    mueller, variance, count = part.band(index)
    return mueller, variance, count, part.theta_d
