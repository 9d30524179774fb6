"""One band of a table while it is being made."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pbrdf.formats.table_data import TableData
from pbrdf.optics.rusinkiewicz import cosines
from pbrdf.tabulation.axes import Axes

HORIZON = 1e-6
"""Cosine up to which a direction counts as at the horizon: rounding puts exact 90° on either side of 0."""


@dataclass(frozen=True)
class Band:
    """Nodes of one band, C-contiguous, changed in place by the steps that make a table.

    Attributes
    ----------
    axes : Axes
        The nodes.
    mueller, variance : ndarray, shape (H, D, P, 4, 4), float32
        1/sr, table frames; NaN where nothing is known.
    count : ndarray, shape (H, D, P), uint16
        Pixels behind each node.
    origin : ndarray, shape (H, D, P), uint8
        `pbrdf.formats.table_data.Origin`.
    """

    axes: Axes
    mueller: NDArray[np.float32]
    variance: NDArray[np.float32]
    count: NDArray[np.uint16]
    origin: NDArray[np.uint8]


def bands_of(table: TableData) -> Iterator[Band]:
    """Copies of a table's bands; what it does not tell of them is NaN, or 0 pixels. It must tell origins."""
    assert table.origin is not None
    axes = Axes(table.theta_h, table.theta_d, table.phi_d)
    for index in range(len(table.wavelengths_nm)):
        mueller = np.array(table.mueller[index], order="C")
        yield Band(
            axes,
            mueller,
            np.full_like(mueller, np.nan) if table.variance is None else table.variance[index].copy(),
            np.zeros(axes.shape, np.uint16) if table.count is None else table.count[index].copy(),
            table.origin[index].copy(),
        )


def possible_nodes(axes: Axes | TableData) -> NDArray[np.bool_]:
    """Nodes (H, D, P) with light and camera above the horizon."""
    cos_light, cos_camera = cosines(axes.theta_h[:, None, None], axes.theta_d[None, :, None], axes.phi_d)
    possible: NDArray[np.bool_] = (cos_light > HORIZON) & (cos_camera > HORIZON)
    return possible
