"""Half and difference angles (Rusinkiewicz 1998), with the light as the incident direction.

The surface normal is z = (0, 0, 1). With h the half vector, b = norm(n × h) and t = norm(b × h):
θh = ∠(n, h), θd = ∠(h, L), φd = atan2(b·L, t·L). At φd = 0 the light lies on the far side of h:
θi = θh + θd. These are the angles of Mitsuba's ``measured_polarized`` and of the KAIST tables.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf.optics.frames import normalised

Float = NDArray[np.float64]


def angles(to_light: ArrayLike, to_camera: ArrayLike) -> tuple[Float, Float, Float]:
    """Angles of a pair of directions.

    Parameters
    ----------
    to_light, to_camera : array_like, shape (..., 3)
        Unit vectors L and V in the frame whose z is the surface normal.

    Returns
    -------
    theta_h, theta_d, phi_d : ndarray, shape (...)
        Radians. Where h is the normal, t and b are undefined and are taken as x and y turned so
        that φd is the azimuth of the light: 0 on the +x side.
    """
    light = np.asarray(to_light, dtype=np.float64)
    half = normalised(light + np.asarray(to_camera, dtype=np.float64))
    across = np.hypot(half[..., 0], half[..., 1])
    at_pole = across < 1e-12
    cos_az = np.where(at_pole, 1.0, half[..., 0] / np.where(at_pole, 1.0, across))
    sin_az = np.where(at_pole, 0.0, half[..., 1] / np.where(at_pole, 1.0, across))
    b, t = _tangents(cos_az, sin_az, half[..., 2], across)
    theta_h = np.arctan2(across, half[..., 2])
    # atan2 keeps the digits near θd = 0 that acos(h·L) would lose
    theta_d = np.arctan2(np.linalg.norm(np.cross(half, light), axis=-1), np.sum(half * light, axis=-1))
    phi_d = np.arctan2(np.sum(b * light, axis=-1), np.sum(t * light, axis=-1))
    return theta_h, theta_d, phi_d


def directions(theta_h: ArrayLike, theta_d: ArrayLike, phi_d: ArrayLike) -> tuple[Float, Float]:
    """Directions of given angles, with the half vector in the x-z plane (azimuth 0).

    Parameters
    ----------
    theta_h, theta_d, phi_d : array_like, shapes that broadcast to (...)
        Radians.

    Returns
    -------
    to_light, to_camera : ndarray, shape (..., 3)
        Unit vectors L = cosθd h + sinθd (cosφd t + sinφd b) and V = 2 (L·h) h − L; either may lie
        below the horizon.
    """
    theta_h, theta_d, phi_d = np.broadcast_arrays(
        *(np.asarray(a, dtype=np.float64) for a in (theta_h, theta_d, phi_d))
    )
    cos_h, sin_h = np.cos(theta_h), np.sin(theta_h)
    half = np.stack([sin_h, np.zeros_like(sin_h), cos_h], axis=-1)
    b, t = _tangents(np.ones_like(cos_h), np.zeros_like(cos_h), cos_h, sin_h)
    transversal = np.cos(phi_d)[..., None] * t + np.sin(phi_d)[..., None] * b
    aligned = np.cos(theta_d)[..., None] * half
    difference = np.sin(theta_d)[..., None] * transversal
    return aligned + difference, aligned - difference


def cosines(theta_h: ArrayLike, theta_d: ArrayLike, phi_d: ArrayLike) -> tuple[Float, Float]:
    """Cosines n·L and n·V of given angles (radians), each of the broadcast shape."""
    aligned = np.cos(theta_d) * np.cos(theta_h)
    difference = np.sin(theta_d) * np.cos(phi_d) * np.sin(theta_h)
    return np.asarray(aligned - difference), np.asarray(aligned + difference)


def _tangents(cos_az: Float, sin_az: Float, cos_h: Float, sin_h: Float) -> tuple[Float, Float]:
    """Tangents b = norm(n × h) and t = b × h of a half vector at the given azimuth."""
    b = np.stack([-sin_az, cos_az, np.zeros_like(cos_az)], axis=-1)
    t = np.stack([cos_az * cos_h, sin_az * cos_h, -sin_h], axis=-1)
    return b, t
