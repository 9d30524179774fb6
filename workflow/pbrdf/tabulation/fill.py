"""Nodes that no photograph shows, filled from what is known of the material.

Along a line of one θh and one φd, θd goes on through zero to −θd, which is θd at φd ± π: the frames there
are the same but for the sign of their axes. Matrices are smooth along such a line, a highlight included, for
it falls off with θh. So the gap around θd = 0, where the camera hides the light, has two sides, and a local
cubic under a Gaussian (normalised convolution with moments, Knutsson and Westin 1993) bridges it. Nodes
beyond the last known ones, above all at grazing angles, are extrapolated with slopes along θd and θh: of the
logarithm of M00, because lobes and 1/cosθ are products, and of the other elements over M00.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from pbrdf._kernels import gaps
from pbrdf.formats.table_data import Origin, TableData
from pbrdf.optics.frames import change_frames
from pbrdf.tabulation.band import Band, bands_of
from pbrdf.tabulation.symmetry import copy_symmetric, require_circle

AZIMUTH_WIDTHS = (np.radians(1.5), np.radians(4.0))
"""Narrowest and widest Gaussian around the azimuth, rad: over so much of φd frames and lobes hardly turn."""
AZIMUTH_STEPS = 0.75
"""Its width in steps of φd between these."""
FARTHEST = np.radians(30)
"""To a known node on either side of a gap that counts as bridged, rad."""


def fill(table: TableData, sigma_nodes: float) -> TableData:
    """Fill the unseen nodes of a table, symmetric copies first; measured ones stay as they are.

    Parameters
    ----------
    table : TableData
        With origin.
    sigma_nodes : float
        Narrowest width of the Gaussian, in steps of θd.

    Returns
    -------
    TableData
        The same with fewer unseen nodes; `origin` tells how each was filled.

    Raises
    ------
    InputError
        If φd does not run evenly from −π to π.
    """
    filled = []
    for band in bands_of(table):
        require_circle(band.axes, table.source)
        copy_symmetric(band)
        inpaint(band, sigma_nodes)
        filled.append(band)
    arrays: dict[str, Any] = {
        name: np.stack([getattr(band, name) for band in filled]) for name in ("mueller", "origin")
    }
    for name in ("variance", "count"):
        if getattr(table, name) is not None:
            arrays[name] = np.stack([getattr(band, name) for band in filled])
    return dataclasses.replace(table, **arrays)


def inpaint(band: Band, sigma_nodes: float) -> None:
    """Fill the unseen nodes of a band in place, if anything of it is known.

    Their origin becomes inpainted, their variance stays NaN: what is wrong with them is no noise.

    Parameters
    ----------
    band : Band
        With φd even and closed (`require_circle`).
    sigma_nodes : float
        Narrowest width of the Gaussian, in steps of θd.
    """
    target = band.origin == Origin.UNSEEN
    known = np.isfinite(band.mueller[..., 0, 0])
    if not known.any() or not target.any():
        return
    narrowest = sigma_nodes * float(np.ptp(band.axes.theta_d)) / max(len(band.axes.theta_d) - 1, 1)
    azimuth = np.clip(AZIMUTH_STEPS * (band.axes.phi_d[1] - band.axes.phi_d[0]), *AZIMUTH_WIDTHS)
    axes = (band.axes.theta_h, band.axes.theta_d, max(narrowest, 1e-9), azimuth)
    done = np.zeros(target.shape, np.uint8)
    gaps.between(*axes, FARTHEST, band.mueller, known.view(np.uint8), target.view(np.uint8), done)
    _settle_centre(band, target, done)
    _mark(band, target, known, done)
    gaps.beyond(*axes, band.mueller, known.view(np.uint8), target.view(np.uint8), done)
    _mark(band, target, known, done)
    if target.any():
        nearest = _nearest(known)
        band.mueller[target] = band.mueller[tuple(axis[target] for axis in nearest)]
        band.origin[target] = Origin.INPAINTED
    _settle_poles(band)


def measured_only(table: TableData) -> TableData:
    """The same table with NaN wherever nothing was measured: the raw table."""
    if table.origin is None:
        return table
    unmeasured = table.origin != Origin.MEASURED
    mueller = table.mueller.copy()
    mueller[unmeasured] = np.nan
    origin = table.origin.copy()
    origin[unmeasured & (origin != Origin.NEVER_VISIBLE)] = Origin.UNSEEN
    return dataclasses.replace(table, mueller=mueller, origin=origin)


def _mark(band: Band, target: NDArray[np.bool_], known: NDArray[np.bool_], done: NDArray[np.uint8]) -> None:
    """Count what was filled as known."""
    filled = done.view(np.bool_)
    band.origin[filled] = Origin.INPAINTED
    target &= ~filled
    known |= filled
    done[...] = 0


def _settle_centre(band: Band, target: NDArray[np.bool_], done: NDArray[np.uint8]) -> None:
    """Make θd = 0 one matrix in frames that turn with φd, their limit: all azimuths show the same L = V."""
    if band.axes.theta_d[0] != 0.0:
        return
    azimuth = band.axes.phi_d
    for h in np.flatnonzero(target[:, 0].any(axis=-1)):
        known = done[h, 0].view(np.bool_) | (band.origin[h, 0] >= Origin.MEASURED)
        # both ends of the circle are one node
        known[-1] = False
        if not known.any():
            continue
        still = change_frames(band.mueller[h, 0, known], azimuth[known], -azimuth[known]).mean(axis=0)
        filled = target[h, 0]
        band.mueller[h, 0, filled] = change_frames(still, -azimuth[filled], azimuth[filled])
        done[h, 0, filled] = 1


def _settle_poles(band: Band) -> None:
    """Make what was filled of θh = 0 constant in φd."""
    if band.axes.theta_h[0] != 0.0:
        return
    for d in np.flatnonzero((band.origin[0] == Origin.INPAINTED).all(axis=-1)):
        band.mueller[0, d] = band.mueller[0, d, :-1].mean(axis=0, dtype=np.float64)


def _nearest(known: NDArray[np.bool_]) -> tuple[NDArray[np.intp], ...]:
    """Indices of the nearest known node of each, counted in nodes, around the circle of azimuths."""
    around = known.shape[-1] - 1
    wrapped = np.concatenate([known[..., :-1]] * 3, axis=-1)
    found = distance_transform_edt(~wrapped, return_distances=False, return_indices=True)
    h, d, p = (axis[..., around : 2 * around + 1] for axis in found)
    return h, d, p % around
