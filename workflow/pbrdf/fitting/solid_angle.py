"""How much of all pairs of directions each node of a table stands for."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]


def cell_weights(axes: Sequence[Float], rows: Sequence[NDArray[np.intp]]) -> Float:
    """Integrate 4 sinθh sinθd cosθd dθh dθd dφd over the cell of each node.

    That is the product of the solid angles of light and camera in half and difference angles
    (Rusinkiewicz 1998), for a light of given azimuth. A cell reaches halfway to the neighbours, and at
    the ends to the end of the axis: nodes at θh = 0, where the integrand vanishes, count for
    what lies around them.

    Parameters
    ----------
    axes : three ndarrays, radians
        θh, θd, φd of the whole table, ascending.
    rows : three ndarrays, intp
        Which nodes of each axis are looked at, ascending.

    Returns
    -------
    ndarray, shape (len(rows[0]), len(rows[1]), len(rows[2])), float64
        sr²/rad; sums to 4π over axes that span [0, π/2], [0, π/2], [−π, π].
    """
    antiderivatives: tuple[Callable[[Float], Float], ...] = (
        lambda theta_h: -np.cos(theta_h),
        lambda theta_d: 2.0 * np.sin(theta_d) ** 2,
        lambda phi_d: phi_d,
    )
    along = []
    for axis, row, antiderivative in zip(axes, rows, antiderivatives, strict=True):
        inner = 0.5 * (axis[row][1:] + axis[row][:-1])
        along.append(np.diff(antiderivative(np.concatenate([axis[:1], inner, axis[-1:]]))))
    weights: Float = np.einsum("i,j,k->ijk", *along)
    return weights
