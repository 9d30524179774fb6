"""From a bin of the table to the light and the point of the sphere that show it: the supplement's way.

SUPP §3 asks of each bin at which angle θt, between light and camera about the sphere's centre, it is
seen, takes the calibrated light nearest to that, and intersects the circle of points seen at θo with
the circle of points lit at θi. Its text has three slips, each of which can be reproduced.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf.calibration.sphere import Sphere
from pbrdf.optics.frames import normalised
from pbrdf.optics.rusinkiewicz import directions
from pbrdf.tabulation.axes import Axes, table_axes

Float = NDArray[np.float64]

Slip = Literal["theta_h", "camera", "light"]
"""``theta_h``: nodes at (j / n)² · 90° for n of them, where the published tables have (j / (n − 1))².
``camera``: c_tbn without the −r that leads from the surface point to the sphere's centre.
``light``: l_tbn at ‖l‖ from the surface point, which is the light's distance from the sphere's centre
(the printed ratio of two lengths of one vector is 1 and cannot be meant)."""

ROUNDING = 1e-12
"""What rounding takes from the square of a height above the plane through light, centre and camera."""


def paper_axes(nodes: tuple[int, int, int], slips: Collection[Slip] = ()) -> Axes:
    """Nodes of the table; with the slip ``theta_h`` those of θh at (j / n)² · 90°, which end below 90°."""
    axes = table_axes(*nodes)
    if "theta_h" not in slips:
        return axes
    return replace(axes, theta_h=(np.arange(nodes[0]) / nodes[0]) ** 2 * np.pi / 2)


def turn_angle(
    sphere: Sphere,
    light_distance_mm: ArrayLike,
    bins: tuple[ArrayLike, ArrayLike, ArrayLike],
    slips: Collection[Slip] = (),
) -> Float:
    """θt at which a light shows a bin, radians: its angle with the camera about the sphere's centre.

    Parameters
    ----------
    sphere : Sphere
    light_distance_mm : array_like, shape (...)
        Of the light from the sphere's centre.
    bins : tuple of array_like, shapes that broadcast with it to (...)
        θh, θd, φd, radians, with light and camera above the horizon.
    slips : collection of Slip
        Those of the supplement to reproduce.

    Returns
    -------
    ndarray, shape (...)
    """
    to_light, to_camera = directions(*bins)
    radius, far = sphere.radius_mm, np.linalg.norm(sphere.centre_mm)
    distance = np.asarray(light_distance_mm, dtype=np.float64)
    # from the sphere's centre, which lies at −r below the surface point, in its tangent frame
    sin_camera = np.hypot(to_camera[..., 0], to_camera[..., 1])
    lean = np.arctan2(sin_camera, to_camera[..., 2]) - np.arcsin(radius * sin_camera / far)
    azimuth = np.arctan2(to_camera[..., 1], to_camera[..., 0])
    camera = far * np.stack(
        [np.sin(lean) * np.cos(azimuth), np.sin(lean) * np.sin(azimuth), np.cos(lean)], axis=-1
    )
    if "camera" in slips:
        camera[..., 2] += radius
    cos_light = to_light[..., 2]
    along = distance
    if "light" not in slips:
        along = np.sqrt(distance**2 - radius**2 * (1 - cos_light**2)) - radius * cos_light
    light = along[..., None] * to_light
    light[..., 2] += radius
    across = np.linalg.norm(np.cross(camera, light), axis=-1)
    angle: Float = np.arctan2(across, np.sum(camera * light, axis=-1))
    return angle


def turn_angles_of(sphere: Sphere, lights_mm: ArrayLike) -> tuple[Float, Float]:
    """θt (radians) and distance (mm) from the sphere's centre of lights of shape (n, 3)."""
    centre = np.asarray(sphere.centre_mm)
    offset = np.asarray(lights_mm, dtype=np.float64) - centre
    angle: Float = np.arctan2(np.linalg.norm(np.cross(-centre, offset), axis=-1), -(offset @ centre))
    return angle, np.linalg.norm(offset, axis=-1)


def nearest_light(
    sphere: Sphere,
    lights_mm: ArrayLike,
    bins: tuple[Float, Float, Float],
    slips: Collection[Slip] = (),
) -> tuple[NDArray[np.intp], Float]:
    """Light with the θt nearest to that at which a bin is seen, and how far off it is.

    Parameters
    ----------
    sphere : Sphere
    lights_mm : array_like, shape (n, 3)
    bins : tuple of ndarray, shapes that broadcast to (...)
    slips : collection of Slip
        As for `turn_angle`.

    Returns
    -------
    index : ndarray, shape (...)
        Of the first of the nearest lights.
    off : ndarray, shape (...)
        Difference of θt, radians.
    """
    theirs, distances = turn_angles_of(sphere, lights_mm)
    shape = np.broadcast_shapes(*(part.shape for part in bins))
    index, off = np.zeros(shape, np.intp), np.full(shape, np.inf)
    wanted = {distance: turn_angle(sphere, distance, bins, slips) for distance in set(np.round(distances, 9))}
    for light, (angle, distance) in enumerate(zip(theirs, np.round(distances, 9), strict=True)):
        difference = np.abs(wanted[distance] - angle)
        nearer = difference < off
        index[nearer], off[nearer] = light, difference[nearer]
    return index, off


def circle_crossing(
    sphere: Sphere, light_mm: ArrayLike, bins: tuple[ArrayLike, ArrayLike, ArrayLike]
) -> Float:
    """Normals of the sphere where light and camera stand at a bin's θi and θo.

    Parameters
    ----------
    sphere : Sphere
    light_mm : array_like, shape (3,)
    bins : tuple of array_like, shapes that broadcast to (...)
        θh, θd, φd, radians; the sign of φd chooses between the two crossings.

    Returns
    -------
    ndarray, shape (..., 3)
        Unit vectors; NaN where the circles do not meet.
    """
    to_light, to_camera = directions(*bins)
    centre = np.asarray(sphere.centre_mm)
    offset = np.asarray(light_mm, dtype=np.float64) - centre
    to_c, to_l = normalised(-centre), normalised(offset)
    cos_camera = _at_centre(to_camera[..., 2], sphere.radius_mm / float(np.linalg.norm(centre)))
    cos_light = _at_centre(to_light[..., 2], sphere.radius_mm / float(np.linalg.norm(offset)))
    kappa = to_c @ to_l
    flat = 1.0 - kappa**2
    a = (cos_camera - kappa * cos_light) / flat
    b = (cos_light - kappa * cos_camera) / flat
    square = (1.0 - a**2 - b**2 - 2.0 * a * b * kappa) / flat
    square[(square < 0) & (square > -ROUNDING)] = 0.0
    with np.errstate(invalid="ignore"):
        height = np.copysign(np.sqrt(square), np.asarray(bins[2]))
    normal: Float = a[..., None] * to_c + b[..., None] * to_l + height[..., None] * np.cross(to_c, to_l)
    return normal


def _at_centre(cosine: Float, share: float) -> Float:
    """Cosine of β = θ − asin(r/l · sinθ), an angle at the sphere's centre, from cosθ at the surface."""
    sine = np.sqrt(np.maximum(1.0 - cosine**2, 0.0))
    turned: Float = cosine * np.sqrt(1.0 - (share * sine) ** 2) + share * sine**2
    return turned
