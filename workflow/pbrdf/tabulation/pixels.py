"""Matrices in table frames of single pixels, and between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pbrdf.optics.frames import change_frames
from pbrdf.tabulation.surface import SurfacePoints, normal_points
from pbrdf.tabulation.view import BandImage, Viewpoint

Float = NDArray[np.float64]

_STEPS = ((0, 0), (0, 1), (1, 0), (1, 1))


def pixel_points(view: Viewpoint, columns: Float, rows: Float) -> SurfacePoints:
    """Points of the sphere that places (...) of the frame show; NaN where they show none."""
    centre, radius = np.asarray(view.sphere.centre_mm), view.sphere.radius_mm
    rays = view.camera.rays(columns, rows)
    along = rays @ centre
    with np.errstate(invalid="ignore"):
        depth = along - np.sqrt(along**2 - centre @ centre + radius**2)
    normal = (depth[..., None] * rays - centre) / radius
    return normal_points(view.sphere, view.light_mm, normal)


@dataclass(frozen=True)
class Corners:
    """The four pixels around places (n,) of the frame: arrays (4, n).

    Attributes
    ----------
    row, column : ndarray of int
        Px of the frame.
    weight : ndarray
        Bilinear.
    points : SurfacePoints
        What they show.
    """

    row: NDArray[np.intp]
    column: NDArray[np.intp]
    weight: Float
    points: SurfacePoints

    @classmethod
    def around(cls, view: Viewpoint, columns: Float, rows: Float) -> Corners:
        """Pixels around finite places."""
        left, top = np.floor(columns), np.floor(rows)
        right, down = columns - left, rows - top
        weight = [(down if r else 1.0 - down) * (right if c else 1.0 - right) for r, c in _STEPS]
        row = np.stack([top + r for r, _ in _STEPS])
        column = np.stack([left + c for _, c in _STEPS])
        points = pixel_points(view, column, row)
        return cls(row.astype(np.intp), column.astype(np.intp), np.stack(weight), points)


def between_pixels(view: Viewpoint, image: BandImage, corners: Corners) -> tuple[Float, Float]:
    """Matrices and variances (n, 4, 4) in table frames, 1/sr, at the places that the pixels surround.

    Each pixel is turned into its own table frame and freed of its own irradiance before the four are
    weighed. NaN where one of them lies outside the image, is missing, or shows no lit surface.
    """
    _, rows, columns = image.mueller.shape
    row, column, points = corners.row - image.first[0], corners.column - image.first[1], corners.points
    usable = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    usable &= (points.cos_light > 0) & (points.cos_camera > 0)
    usable = usable.all(axis=0)
    angle_in, angle_out = points.frame_angles(view.arm.generator_x(view.angle_deg), view.analyser_axis)
    value, variance = np.full((2, usable.size, 4, 4), np.nan)
    value[usable], variance[usable] = 0.0, 0.0
    for corner, weight in enumerate(corners.weight[:, usable]):
        at = (slice(None), row[corner, usable], column[corner, usable])
        pixel, spread = image.mueller[at].T.astype(np.float64), image.variance[at].T.astype(np.float64)
        turn = angle_in[corner, usable], angle_out[corner, usable]
        distance = points.light_distance_mm[corner, usable] * 1e-3
        gain = weight * distance**2 / (points.cos_light[corner, usable] * image.scale)
        turned = image.noise.turned_variance(pixel, spread, *turn).reshape(-1, 4, 4)
        value[usable] += gain[:, None, None] * change_frames(pixel.reshape(-1, 4, 4), *turn)
        variance[usable] += (gain**2)[:, None, None] * turned
    return value, variance
