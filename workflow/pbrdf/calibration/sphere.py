"""Where the sphere stands, and which pixels show it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pbrdf.calibration.camera import Camera
from pbrdf.errors import InputError
from pbrdf.formats.documents import numbers, positive, read_document

KIND = "sphere/1"


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
        for axis, length, name in ((1, camera.rows, "row"), (0, camera.columns, "column")):
            low, high = _silhouette(self.centre_mm[axis], self.centre_mm[2], self.radius_mm)
            focal, principal = camera.focal_px[axis], camera.principal_px[axis]
            first = int(np.floor(focal * low + principal))
            last = int(np.ceil(focal * high + principal))
            if last < 0 or first >= length:
                raise InputError(
                    "sphere.json", "centre_mm", f"no {name} of the frame shows it", "measure it again"
                )
            slices.append(slice(max(first - margin_px, 0), min(last + margin_px + 1, length)))
        return slices[0], slices[1]


def nominal_sphere(rig: Mapping[str, Any], radius_mm: float) -> dict[str, Any]:
    """Content of ``sphere.json`` copied from a rig's file."""
    return {"source": "nominal", "centre_mm": [0.0, 0.0, rig["distance_mm"]], "radius_mm": radius_mm}


def _silhouette(across: float, along: float, radius: float) -> tuple[float, float]:
    """Tangents of the two lines of sight that graze a circle, in the plane of one image axis and the view."""
    towards = np.arctan2(across, along)
    half = np.arcsin(min(1.0, radius / np.hypot(across, along)))
    return float(np.tan(towards - half)), float(np.tan(towards + half))
