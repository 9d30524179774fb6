"""Where the sphere stands, and which pixels show it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf.calibration.camera import Camera
from pbrdf.errors import InputError
from pbrdf.formats.documents import numbers, positive, read_document

Float = NDArray[np.float64]
KIND = "sphere/1"
# so many that the outline's extremes are met to 1e-7 of its radius
_ROUND = np.linspace(0, 2 * np.pi, 7200, endpoint=False)


@dataclass(frozen=True)
class Sphere:
    """Centre in the camera's frame and radius, mm."""

    centre_mm: tuple[float, float, float]
    radius_mm: float

    @classmethod
    def read(cls, path: str | Path) -> Sphere:
        """Read ``sphere.json``; raises `InputError` if a value is missing or the camera cannot see it."""
        content = read_document(path, KIND)
        x, y, z = numbers(path, content, "centre_mm", 3)
        radius = positive(path, content, "radius_mm")
        if z <= radius:
            raise InputError(path, "centre_mm", "puts the sphere on or behind the camera", "measure it again")
        return cls((x, y, z), radius)

    def window(self, camera: Camera, margin_px: int) -> tuple[slice, slice]:
        """Rows and columns that hold the sphere's outline and a margin.

        Raises
        ------
        InputError
            If the outline lies outside the frame.
        """
        slices = []
        columns, rows = camera.project(self.outline())
        for places, length, name in ((rows, camera.rows, "row"), (columns, camera.columns, "column")):
            first, last = int(np.floor(places.min())), int(np.ceil(places.max()))
            if last < 0 or first >= length:
                raise InputError(
                    "sphere.json", "centre_mm", f"no {name} of the frame shows it", "measure it again"
                )
            slices.append(slice(max(first - margin_px, 0), min(last + margin_px + 1, length)))
        return slices[0], slices[1]

    def outline(self, turn: ArrayLike = _ROUND) -> Float:
        """Points (..., 3), mm, where lines of sight graze the sphere, at angles `turn` of shape (...).

        They form a circle across the line to the centre; the angle zero lies toward the image's right, and
        the angles turn toward its bottom.
        """
        centre = np.array(self.centre_mm)
        shrink = 1 - self.radius_mm**2 / (centre @ centre)
        right, down = across(centre)
        angle = np.asarray(turn, dtype=np.float64)[..., None]
        ring = np.cos(angle) * right + np.sin(angle) * down
        points: Float = centre * shrink + self.radius_mm * np.sqrt(shrink) * ring
        return points


def across(toward: Float) -> tuple[Float, Float]:
    """Two unit vectors square to the direction `toward`: to the image's right and to its bottom."""
    down = np.array([0.0, toward[2], -toward[1]]) / np.hypot(toward[1], toward[2])
    return np.cross(down, toward / np.linalg.norm(toward)), down
