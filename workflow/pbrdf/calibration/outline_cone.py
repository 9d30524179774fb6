"""The cone of lines of sight that graze a sphere.

Unit rays u that graze a sphere about o of radius r hold u · o/|o| = cos γ with sin γ = r/|o|. With
x = o / (|o| cos γ) that is u · x = 1, linear in x (the outline of a quadric; Hartley and Zisserman, Multiple
View Geometry, section 8.3). The outline is an ellipse in the image, and its centre is not the sphere's.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.sphere import Sphere, across

Float = NDArray[np.float64]


def solve_cone(rays: Float) -> Float:
    """The x (..., 3) that fits u · x = 1 best to rays u (..., N, 3); NaN if none does."""
    normal = np.swapaxes(rays, -1, -2) @ rays
    # the rays of a narrow cone are nearly one ray: leave out what has no solution, keep what is only narrow
    sound = np.linalg.cond(normal) < 1e15
    safe = np.where(sound[..., None, None], normal, np.eye(3))
    x: Float = np.linalg.solve(safe, rays.sum(-2)[..., None])[..., 0]
    return np.where(sound[..., None], x, np.nan)


def angles(x: Float, rays: Float) -> Float:
    """Angle (..., N) from the cone's surface to rays (N, 3), rad, positive outside; NaN if x is none."""
    length = np.linalg.norm(x, axis=-1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        half = np.arccos(1 / length)
        off: Float = np.arccos(np.clip((x / length) @ rays.T, -1, 1)) - half
    return off


def sphere_in(x: Float, radius_mm: float) -> Sphere:
    """Sphere of known radius that the cone x, |x| > 1, grazes."""
    length = float(np.linalg.norm(x))
    distance = radius_mm / np.sqrt(1 - 1 / length**2)
    ox, oy, oz = (float(c) for c in x / length * distance)
    return Sphere((ox, oy, oz), radius_mm)


def off_outline(sphere: Sphere, rays: Float) -> tuple[Float, Float]:
    """Angle (N,) from the outline to rays (N, 3), positive outside, and the turn about it, both in rad."""
    centre = np.array(sphere.centre_mm)
    right, down = across(centre)
    distance = np.linalg.norm(centre)
    x, y = rays @ right, rays @ down
    off: Float = np.arctan2(np.hypot(x, y), rays @ (centre / distance)) - np.arcsin(
        sphere.radius_mm / distance
    )
    return off, np.arctan2(y, x)


def off_outline_px(sphere: Sphere, camera: Camera, columns: Float, rows: Float) -> tuple[Float, Float, Float]:
    """Distance (N,) in the image from the outline to places, px, positive outside.

    Returns
    -------
    distance_px, turn, scale : ndarray
        `scale` is the number of pixels a radian at each place, along the outline's normal.
    """
    off, turn = off_outline(sphere, camera.rays(columns, rows))
    along_columns, along_rows = (
        off_outline(sphere, camera.rays(columns + dc, rows + dr))[0]
        - off_outline(sphere, camera.rays(columns - dc, rows - dr))[0]
        for dc, dr in ((0.5, 0.0), (0.0, 0.5))
    )
    scale = 1 / np.hypot(along_columns, along_rows)
    return off * scale, turn, scale


def moved_by_centre(sphere: Sphere, rays: Float) -> Float:
    """Derivative (N, 3) of `off_outline`'s angle by the sphere's centre, rad/mm."""
    centre = np.array(sphere.centre_mm)
    distance = np.linalg.norm(centre)
    toward = centre / distance
    along = rays @ toward
    sideways = rays - along[:, None] * toward
    sine = np.linalg.norm(sideways, axis=1, keepdims=True)
    graze = sphere.radius_mm / distance**2 / np.sqrt(1 - (sphere.radius_mm / distance) ** 2)
    moved: Float = -sideways / (sine * distance) + graze * toward
    return moved
