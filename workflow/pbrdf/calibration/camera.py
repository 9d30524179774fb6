"""The camera's intrinsics: pixels to rays and points to pixels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf.calibration.lens import NO_DISTORTION, Coefficients, distort, undistort
from pbrdf.errors import InputError
from pbrdf.formats.documents import numbers, positive, read_document

KIND = "camera/1"
Float = NDArray[np.float64]


@dataclass(frozen=True)
class Camera:
    """A camera at the origin that looks along z; x right, y down. The first pixel's centre is (0, 0).

    Attributes
    ----------
    focal_px : tuple of float
        Focal lengths along columns and rows, px.
    principal_px : tuple of float
        Column and row of the principal point, px.
    rows, columns : int
        Size of the sensor, px.
    distortion : tuple of float
        OpenCV's k1 k2 p1 p2 k3 (`pbrdf.calibration.lens`); zeros are a pinhole.
    """

    focal_px: tuple[float, float]
    principal_px: tuple[float, float]
    rows: int
    columns: int
    distortion: Coefficients = NO_DISTORTION

    @classmethod
    def read(cls, path: str | Path) -> Camera:
        """Read ``camera.json``; raises `InputError` if a value is missing or no camera has it."""
        content = read_document(path, KIND)
        fx, fy = numbers(path, content, "focal_px", 2)
        cx, cy = numbers(path, content, "principal_px", 2)
        if min(fx, fy) <= 0:
            raise InputError(path, "focal_px", f"is {[fx, fy]}", "give focal lengths above zero")
        rows, columns = (_pixels(path, content, name) for name in ("rows", "columns"))
        distortion = NO_DISTORTION
        if "distortion" in content:
            k1, k2, p1, p2, k3 = numbers(path, content, "distortion", 5)
            distortion = k1, k2, p1, p2, k3
        camera = cls((fx, fy), (cx, cy), rows, columns, distortion)
        if not camera.sees_through_every_pixel():
            problem = "folds the image within the frame"
            raise InputError(path, "distortion", problem, "give coefficients fitted to the whole frame")
        return camera

    def project(self, points: ArrayLike) -> tuple[Float, Float]:
        """Columns and rows, px, of points of shape (..., 3) in mm, z > 0.

        A point beyond the field in which the lens's polynomial holds falls outside the frame.
        """
        x, y, z = np.moveaxis(np.asarray(points, dtype=np.float64), -1, 0)
        u, v = distort(x / z, y / z, self.distortion)
        columns: Float = self.focal_px[0] * u + self.principal_px[0]
        rows: Float = self.focal_px[1] * v + self.principal_px[1]
        return columns, rows

    def rays(self, columns: ArrayLike, rows: ArrayLike) -> Float:
        """Unit vectors (..., 3) from the camera through the places `columns`, `rows`, px, of the image.

        NaN far outside the frame, where the lens's polynomial gives no direction.
        """
        x = (np.asarray(columns, dtype=np.float64) - self.principal_px[0]) / self.focal_px[0]
        y = (np.asarray(rows, dtype=np.float64) - self.principal_px[1]) / self.focal_px[1]
        x, y = np.broadcast_arrays(x, y)
        u, v = undistort(x, y, self.distortion)
        length = np.sqrt(u * u + v * v + 1)
        toward: Float = np.stack([u / length, v / length, 1 / length], -1)
        return toward

    def sees_through_every_pixel(self) -> bool:
        """Whether each pixel of the frame's rim, and so of the frame, has a direction of its own."""
        columns = np.linspace(-0.5, self.columns - 0.5, 101)
        rows = np.linspace(-0.5, self.rows - 0.5, 101)
        rim = (
            self.rays(columns, rows[0]),
            self.rays(columns, rows[-1]),
            self.rays(columns[0], rows),
            self.rays(columns[-1], rows),
        )
        return bool(np.isfinite(np.stack(rim)).all())


def _pixels(path: str | Path, content: Mapping[str, Any], field: str) -> int:
    length = positive(path, content, field)
    if not length.is_integer():
        raise InputError(path, field, f"is {length:g}", "give a whole number of pixels")
    return int(length)
