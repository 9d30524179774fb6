"""What a Stokes vector says of its light: how much of it is polarised, and how.

Every function takes Stokes vectors of shape (..., 4) in the conventions of `pbrdf.optics`, in any
unit, and gives numbers of shape (...). What is undefined is NaN: everything where s0 is zero, the
angle where nothing is linearly polarised, the ellipticity where nothing is polarised at all.

The formulas are those of Goldstein, *Polarized Light*, ch. 5; noise may bring a degree above one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float = NDArray[np.float64]


def of_unpolarised_light(mueller: ArrayLike) -> Float:
    """Stokes vectors that Mueller matrices (..., 4, 4) make of unpolarised light, shape (..., 4)."""
    return np.asarray(mueller, dtype=np.float64)[..., :, 0]


def degree_of_polarisation(stokes: ArrayLike) -> Float:
    """DoP = √(s1² + s2² + s3²) / s0."""
    s = np.asarray(stokes, dtype=np.float64)
    return _ratio(np.hypot(_linear(s), s[..., 3]), s[..., 0])


def degree_of_linear_polarisation(stokes: ArrayLike) -> Float:
    """DoLP = √(s1² + s2²) / s0."""
    s = np.asarray(stokes, dtype=np.float64)
    return _ratio(_linear(s), s[..., 0])


def degree_of_circular_polarisation(stokes: ArrayLike) -> Float:
    """DoCP = |s3| / s0."""
    s = np.asarray(stokes, dtype=np.float64)
    return _ratio(np.abs(s[..., 3]), s[..., 0])


def angle_of_linear_polarisation(stokes: ArrayLike) -> Float:
    """AoLP = ½ atan2(s2, s1), radians in [0, π), from the frame's x toward y."""
    s = np.asarray(stokes, dtype=np.float64)
    angle = np.mod(0.5 * np.arctan2(s[..., 2], s[..., 1]), np.pi)
    # a negative angle below rounding comes out as π
    angle = np.where(angle >= np.pi, 0.0, angle)
    return np.where(_linear(s) == 0.0, np.nan, angle)


def ellipticity(stokes: ArrayLike) -> Float:
    """χ = ½ atan2(s3, √(s1² + s2²)), radians in [−π/4, π/4]; positive is right-handed."""
    s = np.asarray(stokes, dtype=np.float64)
    linear = _linear(s)
    angle = 0.5 * np.arctan2(s[..., 3], linear)
    return np.where((linear == 0.0) & (s[..., 3] == 0.0), np.nan, angle)


def type_of_polarisation(stokes: ArrayLike) -> tuple[Float, Float]:
    """Linear and circular share of the polarised part.

    Returns
    -------
    linear, circular : ndarray, shape (...)
        √(s1² + s2²) / √(s1² + s2² + s3²) and |s3| / √(s1² + s2² + s3²): their squares add to one.
        Both zero for unpolarised light, which has neither.

    Notes
    -----
    Wilkie & Weidlich 2010, *A standardised polarisation visualisation for images*.
    """
    s = np.asarray(stokes, dtype=np.float64)
    linear, circular = _linear(s), np.abs(s[..., 3])
    polarised = np.hypot(linear, circular)
    whole = np.where(polarised == 0.0, 1.0, polarised)
    return linear / whole, circular / whole


def _linear(stokes: Float) -> Float:
    length: Float = np.hypot(stokes[..., 1], stokes[..., 2])
    return length


def _ratio(part: Float, whole: Float) -> Float:
    ratio: Float = np.full(np.shape(whole), np.nan)
    return np.divide(part, whole, out=ratio, where=whole != 0.0)
