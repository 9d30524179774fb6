"""Mirror law on a ball: from a highlight to the light's direction, and from a light to its highlight."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.sphere import Sphere
from pbrdf.errors import InputError

Float = NDArray[np.float64]


def mirrored_rays(
    camera: Camera,
    ball: Sphere,
    columns: ArrayLike,
    rows: ArrayLike,
    source: str | Path = "highlights",
) -> tuple[Float, Float]:
    """Rays from the ball toward the lights whose highlights are seen in the given places.

    Parameters
    ----------
    camera : Camera
    ball : Sphere
        In the camera's frame.
    columns, rows : array_like, shape (...)
        Places of the highlights, px.
    source : str or Path
        Name of the highlights for errors.

    Returns
    -------
    points : ndarray, shape (..., 3)
        Where the line of sight meets the ball, mm.
    directions : ndarray, shape (..., 3)
        Unit vectors from there toward the light: ``2 (n·v) n − v`` with the normal n and v toward the camera.

    Raises
    ------
    InputError
        If a place is not on the ball.
    """
    sight = camera.rays(columns, rows)
    centre = np.asarray(ball.centre_mm)
    middle = sight @ centre
    beyond = ball.radius_mm**2 - (centre @ centre - middle**2)
    # a place that the lens gives no direction for is not on the ball either
    missed = ~(beyond >= 0)
    if missed.any():
        column = float(np.broadcast_to(columns, missed.shape)[missed][0])
        row = float(np.broadcast_to(rows, missed.shape)[missed][0])
        problem = f"lies outside the ball (column {column:.1f}, row {row:.1f})"
        raise InputError(source, "highlight", problem, "find the ball's outline again, or leave it out")
    points: Float = (middle - np.sqrt(beyond))[..., np.newaxis] * sight
    normals = (points - centre) / ball.radius_mm
    directions: Float = sight - 2 * np.sum(sight * normals, axis=-1, keepdims=True) * normals
    return points, directions


def highlight_points(ball: Sphere, lights: ArrayLike) -> Float:
    """Points of a ball at which the camera sees the mirror images of lights (Alhazen's problem).

    In the plane of camera, centre and light the normal's angle ψ from the camera's side makes both angles of
    incidence equal: ``atan2(a sin ψ, a cos ψ − r) = atan2(b sin(θ−ψ), b cos(θ−ψ) − r)``, with the distances
    a, b from the centre and θ between them. The left side grows with ψ and the right side falls, so there
    is one root; Newton's steps find it, held between its bounds.

    Parameters
    ----------
    ball : Sphere
        In the camera's frame; the camera is at its origin.
    lights : array_like, shape (..., 3)
        Positions, mm.

    Returns
    -------
    ndarray, shape (..., 3)
        mm. For a light that the ball hides these are points beyond its limb.
    """
    centre = np.asarray(ball.centre_mm)
    spokes = np.asarray(lights, dtype=np.float64) - centre
    a, b = float(np.linalg.norm(centre)), np.linalg.norm(spokes, axis=-1)
    to_camera = -centre / a
    along = spokes @ to_camera
    across = spokes - along[..., np.newaxis] * to_camera
    height = np.linalg.norm(across, axis=-1)
    theta = np.arctan2(height, along)
    low, high = np.zeros_like(theta), theta
    psi = 0.5 * theta
    for _ in range(60):
        difference = _incidence(a, ball.radius_mm, psi) - _incidence(b, ball.radius_mm, theta - psi)
        low, high = np.where(difference < 0, psi, low), np.where(difference < 0, high, psi)
        slope = _slope(a, ball.radius_mm, psi) + _slope(b, ball.radius_mm, theta - psi)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = psi - difference / slope
        stepped = np.where((step >= low) & (step <= high), step, 0.5 * (low + high))
        settled = np.max(np.abs(stepped - psi), initial=0.0) < 1e-14
        psi = stepped
        if settled:
            break
    with np.errstate(divide="ignore", invalid="ignore"):
        sideways = np.where(height[..., np.newaxis] > 0, across / height[..., np.newaxis], 0.0)
    normals = np.cos(psi)[..., np.newaxis] * to_camera + np.sin(psi)[..., np.newaxis] * sideways
    points: Float = centre + ball.radius_mm * normals
    return points


def highlight_pixels(camera: Camera, ball: Sphere, lights: ArrayLike) -> tuple[Float, Float]:
    """Columns and rows, px, of the highlights of lights of shape (..., 3), mm."""
    return camera.project(highlight_points(ball, lights))


def _incidence(distance: float | Float, radius: float, angle: Float) -> Float:
    """Angle between the normal at polar angle `angle` and the line to a point on the polar axis."""
    result: Float = np.arctan2(distance * np.sin(angle), distance * np.cos(angle) - radius)
    return result


def _slope(distance: float | Float, radius: float, angle: Float) -> Float:
    c = np.cos(angle)
    result: Float = (distance**2 - distance * radius * c) / (
        distance**2 + radius**2 - 2 * distance * radius * c
    )
    return result
