"""The turning arm that carries the light and the generator."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float = NDArray[np.float64]
Vector = tuple[float, float, float]


def angle_key(angle_deg: float) -> float:
    """Angle of the arm to a hundredth of a degree, as the lights are named."""
    return round(float(angle_deg), 2) + 0.0


def turned(vector: ArrayLike, axis: ArrayLike, angle_deg: ArrayLike) -> Float:
    """Turn a vector right-handed about an axis by Rodrigues' rotation formula.

    Parameters
    ----------
    vector : array_like, shape (3,)
    axis : array_like, shape (3,)
        Unit vector.
    angle_deg : array_like, shape (...)

    Returns
    -------
    ndarray, shape (..., 3)
    """
    across, about = np.asarray(vector, dtype=np.float64), np.asarray(axis, dtype=np.float64)
    angle = np.deg2rad(np.asarray(angle_deg, dtype=np.float64))[..., np.newaxis]
    c, s = np.cos(angle), np.sin(angle)
    result: Float = c * across + s * np.cross(about, across) + (1 - c) * (about @ across) * about
    return result


@dataclass(frozen=True)
class Arm:
    """A circle in the camera's frame (x right, y down, z along the view); lengths in mm.

    Attributes
    ----------
    centre_mm : Vector
        Centre of the circle.
    axis : Vector
        Unit vector; angles are right-handed about it.
    start : Vector
        Unit vector from the centre to the light at angle zero, across the axis.
    radius_mm : float
    generator_axis : Vector
        x axis of the generator's frame at angle zero.
    offsets_mm : mapping of float to Vector
        By the arm's angle, degrees to two decimals: how far the light stands from the circle there.
    """

    centre_mm: Vector
    axis: Vector
    start: Vector
    radius_mm: float
    generator_axis: Vector
    offsets_mm: Mapping[float, Vector] = field(default_factory=dict)

    def light_position(self, angle_deg: float) -> Float:
        """Where the light stands, shape (3,), mm."""
        spoke = self.radius_mm * turned(self.start, self.axis, angle_deg)
        position: Float = np.asarray(self.centre_mm) + spoke
        return position + self.offsets_mm.get(angle_key(angle_deg), (0.0, 0.0, 0.0))

    def generator_x(self, angle_deg: float) -> Float:
        """X axis of the generator's frame, shape (3,): it turns with the arm."""
        return turned(self.generator_axis, self.axis, angle_deg)


def generator_axis_at_zero(x_axis: ArrayLike, angle_deg: float, arm_axis: ArrayLike) -> Vector:
    """Carry the x axis of the generator's frame, known at one angle of the arm, back to angle zero.

    Parameters
    ----------
    x_axis : array_like, shape (3,)
        Unit vector in the camera's frame at `angle_deg`: from a calibration in the straight line through
        the instrument, 180°.
    angle_deg : float
    arm_axis : array_like, shape (3,)
        Unit vector: the calibrated axis of the arm.
    """
    x, y, z = (float(part) for part in turned(x_axis, arm_axis, -angle_deg))
    return x, y, z
