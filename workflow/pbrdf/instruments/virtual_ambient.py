"""A ball under ambient light in front of a virtual rig's camera: what its outline is seen from."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf.instruments.virtual_geometry import UP
from pbrdf.instruments.virtual_view import Float, seen_by_pixels, unpolarised

SURROUND, GRADIENT = 0.4, 0.2
"""Radiance of the room around the ball at its height, and how much more there is straight above."""

BACKDROP = 0.004
"""Radiance of the black cloth behind the ball."""

SAMPLES = 8

Reflectance = Callable[[int], tuple[float, float]]
"""By band (nm): diffuse albedo, and reflectance of a mirror."""


class VirtualAmbientBall:
    """A ball before a black cloth in a room that is brighter above (`pbrdf.instruments.virtual_rig.Subject`).

    It is seen by what it scatters and mirrors, ``ρ (a + ⅔ b n·up) + R (a + b r·up)`` with n its normal and
    r the direction that a mirror there would show: a Lambertian ball integrates the same room.

    Parameters
    ----------
    rig : dict
        The rig's file, checked against its schema.
    name : str
        Name of the ball.
    centre_mm, radius_mm : array_like of shape (3,), float
        Where it is.
    reflectance : Reflectance
    """

    def __init__(
        self,
        rig: dict[str, Any],
        name: str,
        centre_mm: ArrayLike,
        radius_mm: float,
        reflectance: Reflectance,
    ) -> None:
        self.name = f"{name} in ambient light"
        self._rig = rig
        self._centre = np.asarray(centre_mm, dtype=np.float64)
        self._radius = radius_mm
        self._reflectance = reflectance

    @property
    def truth(self) -> dict[str, Any]:
        """Place, size and reflectances of the ball, and the room."""
        return {
            "centre_mm": self._centre.tolist(),
            "radius_mm": self._radius,
            "reflectance": {band_nm: self._reflectance(band_nm) for band_nm in self._rig["filters_nm"]},
            "room": [SURROUND, GRADIENT, BACKDROP],
        }

    def mueller_image(self, angle_deg: float, band_nm: int) -> NDArray[np.float32]:
        """Mueller image (rows, columns, 16) of unpolarised light; the arm's angle does not matter."""
        albedo, mirror = self._reflectance(band_nm)

        def radiance(rays: Float) -> Float:
            toward = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
            hit, normal = ball_normals(toward, self._centre, self._radius)
            mirrored = toward - 2 * np.sum(toward * normal, -1, keepdims=True) * normal
            diffuse = albedo * (SURROUND + 2 / 3 * GRADIENT * (normal @ UP))
            return np.where(hit, diffuse + mirror * (SURROUND + GRADIENT * (mirrored @ UP)), BACKDROP)

        return unpolarised(seen_by_pixels(self._rig, radiance, SAMPLES))


def ball_normals(toward: Float, centre: Float, radius: float) -> tuple[NDArray[np.bool_], Float]:
    """Which rays from the camera meet a ball, and its normals (..., 3) there.

    Parameters
    ----------
    toward : ndarray, shape (..., 3)
        Unit vectors.
    centre : ndarray, shape (3,)
    radius : float

    Returns
    -------
    hit : ndarray, shape (...), bool
    normal : ndarray, shape (..., 3)
        Where the ray passes by, that of the point of the outline nearest to it.
    """
    along = toward @ centre
    square = radius**2 - (centre @ centre - along**2)
    distance = along - np.sqrt(np.maximum(square, 0.0))
    outward = distance[..., None] * toward - centre
    return square > 0, outward / np.linalg.norm(outward, axis=-1, keepdims=True)
