"""Which points of a lit sphere a virtual rig's camera sees, and the Mueller image of any material there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf.instruments.virtual_ambient import ball_normals
from pbrdf.instruments.virtual_geometry import UP
from pbrdf.instruments.virtual_view import Float, rays_through
from pbrdf.optics.frames import angle_between, change_frames, normalised, table_axis, transverse

Evaluate = Callable[[Float, Float], Float]
"""From unit vectors to light and camera (n, 3), z the normal, to matrices (n, 4, 4) in table frames, 1/sr."""


@dataclass(frozen=True)
class LitSphere:
    """A sphere, a small lamp and the generator's x axis, in the camera's frame; mm."""

    centre: Float
    radius: float
    light: Float
    generator_x: Float


def traced_image(rig: dict[str, Any], scene: LitSphere, evaluate: Evaluate) -> NDArray[np.float32]:
    """Mueller image of the light path, as the kernel renders it of its own model.

    Parameters
    ----------
    rig : dict
        The rig's file, checked against its schema; its `samples` are rays a pixel along each side.
    scene : LitSphere
    evaluate : Evaluate
        The material.

    Returns
    -------
    ndarray, shape (rows, columns, 16), float32
        Matrices between the modules' frames times cos(θi)/d², 1/(sr m²), mean over each pixel; zero where
        no lit surface is seen, and where the material is NaN.
    """
    samples = rig["samples"]
    rows, columns = np.arange(rig["camera"]["rows"])[:, None], np.arange(rig["camera"]["columns"])
    offsets = (np.arange(samples) + 0.5) / samples - 0.5
    total = np.zeros((rows.size, columns.size, 16))
    for down in offsets:
        for right in offsets:
            rays = normalised(rays_through(rig, columns + right, rows + down))
            lit, light_path = _light_path(rays, scene, evaluate)
            total[lit] += light_path.reshape(-1, 16)
    image: NDArray[np.float32] = (total / samples**2).astype(np.float32)
    return image


def _light_path(rays: Float, scene: LitSphere, evaluate: Evaluate) -> tuple[NDArray[np.bool_], Float]:
    """Which of the unit `rays` (..., 3) meet a lit point, and the matrices (n, 4, 4) of those that do."""
    hit, normal = ball_normals(rays, scene.centre, scene.radius)
    offset = scene.light - (scene.centre + scene.radius * normal)
    to_light = normalised(offset)
    lit = hit & (_dot(normal, to_light) > 0) & (_dot(normal, -rays) > 0)
    normal, to_light, to_camera, offset = normal[lit], to_light[lit], -rays[lit], offset[lit]

    tangent = transverse(_least_along(normal), normal)
    local = np.stack([tangent, np.cross(normal, tangent), normal], axis=-2)
    matrices = evaluate(*(np.einsum("nij,nj->ni", local, side) for side in (to_light, to_camera)))

    s = table_axis(to_light, to_camera)
    # where L = V, the matrix is the same in every frame turned alike at both ends
    s = np.where(np.isnan(s), transverse(UP, to_camera), s)
    turn_in = angle_between(s, transverse(scene.generator_x, -to_light), -to_light)
    turn_out = angle_between(s, transverse(UP, to_camera), to_camera)
    irradiance = _dot(normal, to_light) / (1e-6 * _dot(offset, offset))
    return lit, irradiance[:, None, None] * np.nan_to_num(change_frames(matrices, turn_in, turn_out))


def _least_along(normal: Float) -> Float:
    """For each normal the x or the y axis, whichever is safely across it."""
    return np.where(np.abs(normal[:, :1]) < 0.9, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))


def _dot(a: ArrayLike, b: ArrayLike) -> Float:
    product: Float = np.sum(np.asarray(a) * np.asarray(b), axis=-1)
    return product
