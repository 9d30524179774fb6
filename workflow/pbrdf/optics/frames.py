"""Stokes frames and the rotations between them.

A frame is given by its x axis; z is the direction of propagation and y = z × x.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf.optics.mueller import rotator

Float = NDArray[np.float64]


def normalised(vectors: ArrayLike) -> Float:
    """Unit vectors along the last axis; a zero vector gives NaN."""
    vectors = np.asarray(vectors, dtype=np.float64)
    with np.errstate(invalid="ignore", divide="ignore"):
        unit: Float = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return unit


def table_axis(to_light: ArrayLike, to_camera: ArrayLike) -> Float:
    """X axis of both table frames, ``norm(L × V)``: perpendicular to the plane of L and V.

    Parameters
    ----------
    to_light, to_camera : array_like, shape (..., 3)
        Unit vectors L and V.

    Returns
    -------
    ndarray, shape (..., 3)
        NaN where L = V: the frame is undefined there.
    """
    return normalised(np.cross(np.asarray(to_light), np.asarray(to_camera)))


def transverse(axis: ArrayLike, propagation: ArrayLike) -> Float:
    """Project `axis` across the beam and normalise: the x axis that a tilted beam sees."""
    axis = np.asarray(axis, dtype=np.float64)
    propagation = np.asarray(propagation, dtype=np.float64)
    along = np.sum(axis * propagation, axis=-1, keepdims=True)
    return normalised(axis - along * propagation)


def angle_between(x_from: ArrayLike, x_to: ArrayLike, propagation: ArrayLike) -> Float:
    """Signed angle between two x axes about the beam, ``atan2(z·(x×x'), x·x')``, radians."""
    old, new = np.asarray(x_from, dtype=np.float64), np.asarray(x_to, dtype=np.float64)
    turned = np.sum(np.asarray(propagation) * np.cross(old, new), axis=-1)
    along = np.sum(old * new, axis=-1)
    angle: Float = np.arctan2(turned, along)
    return angle


def change_frames(mueller: ArrayLike, angle_in: ArrayLike, angle_out: ArrayLike) -> Float:
    """Re-express Mueller matrices in turned frames, ``R(θo) M R(θi)ᵀ``.

    Parameters
    ----------
    mueller : array_like, shape (..., 4, 4)
        Matrices between the old frames.
    angle_in, angle_out : array_like, shape (...)
        Angle from the old x axis to the new one about the incident and the outgoing beam, radians.

    Returns
    -------
    ndarray, shape (..., 4, 4)
        Matrices between the new frames (Mitsuba 3, ``rotate_mueller_basis``).
    """
    r_in = np.swapaxes(rotator(angle_in), -1, -2)
    result: Float = rotator(angle_out) @ np.asarray(mueller, dtype=np.float64) @ r_in
    return result
