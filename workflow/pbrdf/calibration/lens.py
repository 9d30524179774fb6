"""Lens distortion: where the image of a direction falls beside its place in a pinhole camera.

The model is Brown's in OpenCV's order of coefficients, k1 k2 p1 p2 k3 (D. C. Brown, "Close-range camera
calibration", Photogrammetric Engineering 37(8), 1971). Coordinates are tangents of angles from the
optical axis: x = X / Z to the right, y = Y / Z down.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Coefficients = tuple[float, float, float, float, float]

NO_DISTORTION: Coefficients = (0.0, 0.0, 0.0, 0.0, 0.0)
_NEWTON_STEPS = 30
_CONVERGED = 1e-12


def distort(x: Float, y: Float, coefficients: Coefficients) -> tuple[Float, Float]:
    """Distorted coordinates of the undistorted `x` and `y`.

    A direction farther out than `turning_radius` is put there, along its own azimuth: the polynomial
    would bring it back into the frame.
    """
    limit = turning_radius(coefficients)
    if np.isfinite(limit):
        shrink = limit / np.maximum(np.hypot(x, y), limit)
        x, y = x * shrink, y * shrink
    return _polynomial(x, y, coefficients)


def undistort(x: Float, y: Float, coefficients: Coefficients) -> tuple[Float, Float]:
    """Undistorted coordinates of the distorted `x` and `y`, to 1e-12; NaN where no direction has that image.

    Notes
    -----
    Newton's method from the distorted place. The radial polynomial rises from the axis to its turning
    radius, so that a root within that radius is the image's direction.
    """
    if not any(coefficients):
        return x, y
    k1, k2, p1, p2, k3 = coefficients
    u, v = x.copy(), y.copy()
    off = np.full(x.shape, np.inf)
    # far outside the frame the steps may run away, and what did not converge is NaN in the end
    with np.errstate(all="ignore"):
        for _ in range(_NEWTON_STEPS):
            image_x, image_y = _polynomial(u, v, coefficients)
            short_x, short_y = x - image_x, y - image_y
            off = np.hypot(short_x, short_y)
            if np.all(off < _CONVERGED):
                break
            r2 = u * u + v * v
            gain = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
            slope = 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3))
            xx = gain + u * u * slope + 2 * p1 * v + 6 * p2 * u
            yy = gain + v * v * slope + 6 * p1 * v + 2 * p2 * u
            xy = u * v * slope + 2 * p1 * u + 2 * p2 * v
            determinant = xx * yy - xy * xy
            u = u + (yy * short_x - xy * short_y) / determinant
            v = v + (xx * short_y - xy * short_x) / determinant
        found = (off < _CONVERGED) & (np.hypot(u, v) <= turning_radius(coefficients))
    return np.where(found, u, np.nan), np.where(found, v, np.nan)


def turning_radius(coefficients: Coefficients) -> float:
    """Undistorted radius at which the radial polynomial stops rising; infinite if it never does."""
    k1, k2, _, _, k3 = coefficients
    # in the inverse square of the radius the leading coefficient is never small
    inverse = np.roots([1.0, 3 * k1, 5 * k2, 7 * k3])
    real = inverse[(np.abs(inverse.imag) < 1e-9 * np.abs(inverse)) & (inverse.real > 0)].real
    return float(1 / np.sqrt(real.max())) if len(real) else np.inf


def _polynomial(x: Float, y: Float, coefficients: Coefficients) -> tuple[Float, Float]:
    k1, k2, p1, p2, k3 = coefficients
    r2 = x * x + y * y
    gain = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return (
        x * gain + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
        y * gain + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
    )
