"""Nodes that no photograph shows, filled from what is known of the material."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from pbrdf.formats.table_data import Origin, TableData

MIRROR = np.array([1.0, 1.0, -1.0, -1.0], np.float32)
"""M(−φd) = Q M(φd) Q with Q = diag of this: a mirror-symmetric surface."""
RECIPROCAL = np.array([1.0, 1.0, -1.0, 1.0], np.float32)
"""M(φd ± π) = P M(φd)ᵀ P with P = diag of this: light and camera exchanged."""

LEAST_WEIGHT = 1e-3
"""A node is reached where known nodes weigh this share of the most that they weigh anywhere."""


def fill(table: TableData, sigma_nodes: float) -> TableData:
    """Fill the unseen nodes of a table; measured ones stay as they are.

    Symmetric copies come first. What is left is a normalised Gaussian mean over the known nodes in
    angle space, φd periodic, widened until every possible node is reached.

    Parameters
    ----------
    table : TableData
        With origin, and φd from −π to π with both ends, evenly spaced.
    sigma_nodes : float
        First width of the Gaussian, in nodes of each axis.

    Returns
    -------
    TableData
        The same with fewer unseen nodes; `origin` tells how each was filled.
    """
    assert table.origin is not None
    mueller, origin = table.mueller.copy(), table.origin.copy()
    variance = None if table.variance is None else table.variance.copy()
    for copy in (_mirrored, _reciprocal):
        copy(mueller, variance, origin)
    for band in range(len(table.wavelengths_nm)):
        _inpaint(mueller[band], origin[band], sigma_nodes)
    return dataclasses.replace(table, mueller=mueller, variance=variance, origin=origin)


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


def _mirrored(
    mueller: NDArray[np.float32], variance: NDArray[np.float32] | None, origin: NDArray[np.uint8]
) -> None:
    source = origin[..., ::-1]
    take = (origin == Origin.UNSEEN) & (source == Origin.MEASURED)
    signs = MIRROR[:, None] * MIRROR
    mueller[take] = (mueller[..., ::-1, :, :] * signs)[take]
    if variance is not None:
        variance[take] = variance[..., ::-1, :, :][take]
    origin[take] = Origin.MIRRORED


def _reciprocal(
    mueller: NDArray[np.float32], variance: NDArray[np.float32] | None, origin: NDArray[np.uint8]
) -> None:
    count = origin.shape[-1] - 1
    opposite = (np.arange(count + 1) + count // 2) % count
    if count % 2:
        return  # no node lies opposite another
    source = origin[..., opposite]
    take = (origin == Origin.UNSEEN) & np.isin(source, (Origin.MEASURED, Origin.MIRRORED))
    signs = RECIPROCAL[:, None] * RECIPROCAL
    mueller[take] = np.swapaxes(mueller[..., opposite, :, :], -1, -2)[take] * signs
    if variance is not None:
        variance[take] = np.swapaxes(variance[..., opposite, :, :], -1, -2)[take]
    origin[take] = Origin.RECIPROCAL


def _inpaint(mueller: NDArray[np.float32], origin: NDArray[np.uint8], sigma_nodes: float) -> None:
    """Fill one band (H, D, P, 4, 4) in place."""
    known = np.isfinite(mueller[..., 0, 0])
    if not known.any():
        return
    values = np.where(known[..., None, None], mueller, np.float32(0))
    sigma = sigma_nodes
    open_nodes = origin == Origin.UNSEEN
    # as wide as the longest axis, a Gaussian reaches every node from any other
    while open_nodes.any() and sigma <= 2 * max(origin.shape):
        weight = _smoothed(known.astype(np.float32), sigma)
        reached = open_nodes & (weight > LEAST_WEIGHT * weight.max())
        if reached.any():
            for row in range(4):
                for column in range(4):
                    smooth = _smoothed(values[..., row, column], sigma)
                    mueller[..., row, column][reached] = smooth[reached] / weight[reached]
            origin[reached] = Origin.INPAINTED
            open_nodes &= ~reached
        sigma *= 2.0


def _smoothed(field: NDArray[np.float32], sigma: float) -> NDArray[np.float32]:
    """Gaussian over (θh, θd, φd); φd is periodic with its end stored twice."""
    smooth = gaussian_filter1d(field, sigma, axis=0, mode="constant")
    smooth = gaussian_filter1d(smooth, sigma, axis=1, mode="constant")
    around = gaussian_filter1d(smooth[..., :-1], sigma, axis=2, mode="wrap")
    result: NDArray[np.float32] = np.concatenate([around, around[..., :1]], axis=2)
    return result
