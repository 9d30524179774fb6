"""Matrices in table frames of single pixels, and between them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pbrdf.optics.frames import change_frames
from pbrdf.tabulation.corners import Corners
from pbrdf.tabulation.surface import SurfacePoints, normal_points
from pbrdf.tabulation.view import BandImage, Viewpoint

Float = NDArray[np.float64]


def pixel_points(view: Viewpoint, columns: Float, rows: Float) -> SurfacePoints:
    """Points of the sphere that places (...) of the frame show; NaN where they show none."""
    centre, radius = np.asarray(view.sphere.centre_mm), view.sphere.radius_mm
    rays = view.camera.rays(columns, rows)
    along = rays @ centre
    with np.errstate(invalid="ignore"):
        depth = along - np.sqrt(along**2 - centre @ centre + radius**2)
    normal = (depth[..., None] * rays - centre) / radius
    return normal_points(view.sphere, view.light_mm, normal)


def between_pixels(view: Viewpoint, image: BandImage, corners: Corners) -> tuple[Float, Float]:
    """Matrices and variances (n, 4, 4) in table frames, 1/sr, at the places that the pixels surround.

    Each pixel is turned into its own table frame and freed of its own irradiance before the four are
    weighed. NaN where one of them lies outside the image, is missing, or shows no lit surface.
    """
    inside, usable = corners.within(image.first, image.mueller.shape[1:])
    row, column = (
        (pixel + first).astype(np.float64)
        for pixel, first in zip((inside.row, inside.column), image.first, strict=True)
    )
    points = pixel_points(view, column, row)
    lit = ((points.cos_light > 0) & (points.cos_camera > 0)).all(axis=0)
    usable[usable] = lit
    angle_in, angle_out = points.frame_angles(view.arm.generator_x(view.angle_deg), view.analyser_axis)
    value, variance = np.full((2, usable.size, 4, 4), np.nan)
    value[usable], variance[usable] = 0.0, 0.0
    for corner, weight in enumerate(inside.weight[:, lit]):
        at = (slice(None), inside.row[corner, lit], inside.column[corner, lit])
        pixel, spread = image.mueller[at].T.astype(np.float64), image.variance[at].T.astype(np.float64)
        turn = angle_in[corner, lit], angle_out[corner, lit]
        distance = points.light_distance_mm[corner, lit] * 1e-3
        gain = weight * distance**2 / (points.cos_light[corner, lit] * image.scale)
        turned = image.noise.turned_variance(pixel, spread, *turn).reshape(-1, 4, 4)
        value[usable] += gain[:, None, None] * change_frames(pixel.reshape(-1, 4, 4), *turn)
        variance[usable] += (gain**2)[:, None, None] * turned
    return value, variance
