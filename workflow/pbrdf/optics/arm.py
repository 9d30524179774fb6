"""The turning arm that carries the light and the generator."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Vector = tuple[float, float, float]


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
    """

    centre_mm: Vector
    axis: Vector
    start: Vector
    radius_mm: float
    generator_axis: Vector

    def light_position(self, angle_deg: float) -> Float:
        """Where the light stands, shape (3,), mm."""
        position: Float = np.asarray(self.centre_mm) + self.radius_mm * self._turned(self.start, angle_deg)
        return position

    def generator_x(self, angle_deg: float) -> Float:
        """X axis of the generator's frame, shape (3,): it turns with the arm."""
        return self._turned(self.generator_axis, angle_deg)

    def _turned(self, vector: Vector, angle_deg: float) -> Float:
        """Rodrigues' rotation formula."""
        axis, across = np.asarray(self.axis), np.asarray(vector)
        c, s = np.cos(np.deg2rad(angle_deg)), np.sin(np.deg2rad(angle_deg))
        turned: Float = c * across + s * np.cross(axis, across) + (1 - c) * (axis @ across) * axis
        return turned
