"""Mueller matrices of ideal elements, in the conventions of `pbrdf.optics`."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float = NDArray[np.float64]


def rotator(angle: ArrayLike) -> Float:
    """Re-express a Stokes vector in a frame turned by `angle` about the beam.

    Parameters
    ----------
    angle : array_like, shape (...)
        Angle from the old x axis to the new one, radians, counter-clockwise as seen looking into the beam.

    Returns
    -------
    ndarray, shape (..., 4, 4)
        Goldstein, *Polarized Light*, eq. 6.43 (there as the rotator of an element).
    """
    doubled = 2.0 * np.asarray(angle, dtype=np.float64)
    c, s = np.cos(doubled), np.sin(doubled)
    matrix = np.zeros((*doubled.shape, 4, 4))
    matrix[..., 0, 0] = matrix[..., 3, 3] = 1.0
    matrix[..., 1, 1] = matrix[..., 2, 2] = c
    matrix[..., 1, 2] = s
    matrix[..., 2, 1] = -s
    return matrix


def turned(element: ArrayLike, angle: ArrayLike) -> Float:
    """Turn an element by `angle` (radians): ``R(θ)ᵀ E R(θ)``, shape (..., 4, 4)."""
    r = rotator(angle)
    result: Float = np.swapaxes(r, -1, -2) @ np.asarray(element, dtype=np.float64) @ r
    return result


def linear_polariser(angle: ArrayLike = 0.0, extinction: float = 0.0) -> Float:
    """Linear polariser with its axis at `angle` (radians), shape (..., 4, 4).

    `extinction` is what it lets through of light that vibrates across its axis, divided by what it
    lets through of light along it; 0 is the ideal polariser (Goldstein, *Polarized Light*, eq. 5.29).
    """
    along_x = np.zeros((4, 4))
    along_x[0, 0] = along_x[1, 1] = 0.5 * (1.0 + extinction)
    along_x[0, 1] = along_x[1, 0] = 0.5 * (1.0 - extinction)
    along_x[2, 2] = along_x[3, 3] = np.sqrt(extinction)
    return turned(along_x, angle)


def linear_retarder(retardance: ArrayLike, angle: ArrayLike = 0.0) -> Float:
    """Ideal linear retarder.

    Parameters
    ----------
    retardance : array_like, shape (...)
        δ in radians; a quarter wave is π/2.
    angle : array_like, shape (...)
        Angle of the fast axis, radians.

    Returns
    -------
    ndarray, shape (..., 4, 4)
    """
    delta, angle = np.broadcast_arrays(
        np.asarray(retardance, dtype=np.float64), np.asarray(angle, dtype=np.float64)
    )
    along_x = np.zeros((*delta.shape, 4, 4))
    along_x[..., 0, 0] = along_x[..., 1, 1] = 1.0
    along_x[..., 2, 2] = along_x[..., 3, 3] = np.cos(delta)
    along_x[..., 2, 3] = np.sin(delta)
    along_x[..., 3, 2] = -np.sin(delta)
    return turned(along_x, angle)


def circular_polariser(*, right: bool) -> Float:
    """Ideal homogeneous circular polariser, shape (4, 4)."""
    matrix = np.zeros((4, 4))
    matrix[0, 0] = matrix[3, 3] = 0.5
    matrix[0, 3] = matrix[3, 0] = 0.5 if right else -0.5
    return matrix
