"""From slices to the table: each node between the two lights whose θd bracket it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.formats.table_data import Origin, TableData
from pbrdf.optics.rusinkiewicz import cosines
from pbrdf.settings.plan import HALF_TURN
from pbrdf.tabulation.axes import Axes
from pbrdf.tabulation.slices import Slice, read_slice, slice_angle_deg

HORIZON = 1e-6
"""Cosine up to which a direction counts as at the horizon: rounding puts exact 90° on either side of 0."""


def merge_slices(
    paths: Sequence[str | Path], axes: Axes, source: str, widest_gap: float = np.inf
) -> TableData:
    """Table of a material from the slices of its lights.

    Parameters
    ----------
    paths : sequence of paths
        Slices; two are in memory at a time.
    axes : Axes
        Nodes of the table.
    source : str
        What the table is called in messages.
    widest_gap : float
        Widest step of θd between two lights that is interpolated, radians; beyond it nodes stay unseen.

    Returns
    -------
    TableData
        With variance, count and origin; NaN where nothing was measured.

    Raises
    ------
    InputError
        If there are fewer than two slices, one is damaged, they differ in bands or nodes, or share an angle.
    """
    if len(paths) < 2:
        raise InputError(source, "slices", f"there are {len(paths)}", "photograph at least two lights")
    slices = _ascending(paths, axes, source)
    previous = next(slices)
    bands, shape = previous.bands_nm, (len(previous.bands_nm), *axes.shape)
    mueller = np.full((*shape, 4, 4), np.nan, np.float32)
    variance = np.full((*shape, 4, 4), np.nan, np.float32)
    count = np.zeros(shape, np.uint16)
    for part in slices:
        if part.bands_nm != bands:
            problem = f"differ in bands: {part.bands_nm} nm at {part.angle_deg:g}°, {bands} nm before"
            raise InputError(source, "slices", problem, "make them again with one config")
        _interpolate(previous, part, axes, widest_gap, mueller, variance, count)
        previous = part
    return TableData(
        source=source,
        wavelengths_nm=np.array(bands, np.float64),
        theta_h=axes.theta_h,
        theta_d=axes.theta_d,
        phi_d=axes.phi_d,
        mueller=mueller,
        variance=variance,
        count=count,
        origin=_origin(axes, count),
    )


def _ascending(paths: Sequence[str | Path], axes: Axes, source: str) -> Iterator[Slice]:
    """Slices by ascending angle of the arm, each read when it is its turn."""
    angles = [slice_angle_deg(path) for path in paths]
    if len(set(angles)) != len(angles):
        raise InputError(source, "slices", "two have the same angle of the arm", "keep one of them")
    if max(angles) > HALF_TURN:
        problem = f"one has the arm at {max(angles):g}°, beyond {HALF_TURN:g}°"
        raise InputError(source, "slices", problem, "use lights of one side")
    for _, path in sorted(zip(angles, paths, strict=True), key=lambda pair: pair[0]):
        part = read_slice(path)
        nodes = (len(axes.theta_h), len(axes.phi_d))
        if part.theta_d.shape != nodes:
            problem = f"has {part.theta_d.shape} nodes of θh and φd where the table has {nodes}"
            raise InputError(path, "theta_d", problem, "make the slice again with this config")
        yield part


def _interpolate(
    low: Slice,
    high: Slice,
    axes: Axes,
    widest_gap: float,
    mueller: NDArray[np.float32],
    variance: NDArray[np.float32],
    count: NDArray[np.uint16],
) -> None:
    """Fill the nodes whose θd lies between two neighbouring lights and that both show."""
    gap = high.theta_d - low.theta_d
    with np.errstate(invalid="ignore", divide="ignore"):
        for d, theta_d in enumerate(axes.theta_d):
            weight = (theta_d - low.theta_d) / gap
            between = (weight >= 0) & (weight <= 1) & (gap <= widest_gap)
            for b in range(mueller.shape[0]):
                h, p = np.nonzero(between & (low.count[b] > 0) & (high.count[b] > 0))
                w = weight[h, p, None, None]
                mueller[b, h, d, p] = (1 - w) * low.mueller[b, h, p] + w * high.mueller[b, h, p]
                variance[b, h, d, p] = (1 - w) ** 2 * low.variance[b, h, p] + w**2 * high.variance[b, h, p]
                count[b, h, d, p] = low.count[b, h, p] + high.count[b, h, p]


def _origin(axes: Axes, count: NDArray[np.uint16]) -> NDArray[np.uint8]:
    origin = np.full(count.shape, Origin.NEVER_VISIBLE, np.uint8)
    origin[:, possible_nodes(axes)] = Origin.UNSEEN
    origin[count > 0] = Origin.MEASURED
    return origin


def possible_nodes(axes: Axes | TableData) -> NDArray[np.bool_]:
    """Nodes (H, D, P) with light and camera above the horizon."""
    cos_light, cos_camera = cosines(axes.theta_h[:, None, None], axes.theta_d[None, :, None], axes.phi_d)
    possible: NDArray[np.bool_] = (cos_light > HORIZON) & (cos_camera > HORIZON)
    return possible
