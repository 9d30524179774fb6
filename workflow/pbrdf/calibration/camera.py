"""The camera's intrinsics: pixels to rays and points to pixels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf.errors import InputError
from pbrdf.formats.documents import numbers, positive, read_document

KIND = "camera/1"
Float = NDArray[np.float64]


@dataclass(frozen=True)
class Camera:
    """A pinhole at the origin that looks along z; x right, y down. The first pixel's centre is (0, 0).

    Attributes
    ----------
    focal_px : tuple of float
        Focal lengths along columns and rows, px.
    principal_px : tuple of float
        Column and row of the principal point, px.
    rows, columns : int
        Size of the sensor, px.
    """

    focal_px: tuple[float, float]
    principal_px: tuple[float, float]
    rows: int
    columns: int

    @classmethod
    def read(cls, path: str | Path) -> Camera:
        """Read ``camera.json``; raises `InputError` if a value is missing or no camera has it."""
        content = read_document(path, KIND)
        fx, fy = numbers(path, content, "focal_px", 2)
        cx, cy = numbers(path, content, "principal_px", 2)
        if min(fx, fy) <= 0:
            raise InputError(path, "focal_px", f"is {[fx, fy]}", "give focal lengths above zero")
        rows, columns = (_pixels(path, content, name) for name in ("rows", "columns"))
        return cls((fx, fy), (cx, cy), rows, columns)

    def project(self, points: ArrayLike) -> tuple[Float, Float]:
        """Columns and rows, px, of points of shape (..., 3) in mm."""
        x, y, z = np.moveaxis(np.asarray(points, dtype=np.float64), -1, 0)
        columns: Float = self.focal_px[0] * x / z + self.principal_px[0]
        rows: Float = self.focal_px[1] * y / z + self.principal_px[1]
        return columns, rows


def nominal_camera(rig: Mapping[str, Any]) -> dict[str, Any]:
    """Content of ``camera.json`` copied from a rig's file."""
    camera = rig["camera"]
    return {
        "source": "nominal",
        "focal_px": [camera["focal_px"], camera["focal_px"]],
        "principal_px": camera["principal_px"],
        "rows": camera["rows"],
        "columns": camera["columns"],
    }


def _pixels(path: str | Path, content: Mapping[str, Any], field: str) -> int:
    length = positive(path, content, field)
    if not length.is_integer():
        raise InputError(path, field, f"is {length:g}", "give a whole number of pixels")
    return int(length)
