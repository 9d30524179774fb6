"""Which point of the sphere shows a node of the table under a given light."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf.calibration.sphere import Sphere
from pbrdf.optics.frames import angle_between, normalised, table_axis, transverse

Float = NDArray[np.float64]

SETTLED = 1e-12
"""Length by which a normal may still change in the last round."""
MOST_ROUNDS = 60
"""A round shrinks the error by about radius / (distance · cosθd): it takes many at a grazing light only."""


@dataclass(frozen=True)
class SurfacePoints:
    """Points of the sphere, arrays of one shape (..., 3) or (...).

    Attributes
    ----------
    position_mm : ndarray, shape (..., 3)
    to_light, to_camera : ndarray, shape (..., 3)
        Unit vectors L and V.
    cos_light, cos_camera : ndarray, shape (...)
        Cosines n·L and n·V.
    light_distance_mm : ndarray, shape (...)
    """

    position_mm: Float
    to_light: Float
    to_camera: Float
    cos_light: Float
    cos_camera: Float
    light_distance_mm: Float

    @property
    def theta_d(self) -> Float:
        """Difference angle, radians: half the angle between L and V."""
        half = normalised(self.to_light + self.to_camera)
        across = np.linalg.norm(np.cross(half, self.to_light), axis=-1)
        angle: Float = np.arctan2(across, np.sum(half * self.to_light, axis=-1))
        return angle

    def frame_angles(self, generator_axis: ArrayLike, analyser_axis: ArrayLike) -> tuple[Float, Float]:
        """Angles from the modules' x axes to the table's about the incident and the reflected beam, rad."""
        s = table_axis(self.to_light, self.to_camera)
        beam_in, beam_out = -self.to_light, self.to_camera
        angle_in = angle_between(transverse(generator_axis, beam_in), s, beam_in)
        angle_out = angle_between(transverse(analyser_axis, beam_out), s, beam_out)
        return angle_in, angle_out


def node_points(sphere: Sphere, light_mm: ArrayLike, theta_h: Float, phi_d: Float) -> SurfacePoints:
    """Points whose half vector lies at (θh, φd), at the light's and the camera's actual distances.

    Directions change over the sphere because both are near; a fixed point of "directions at the
    point → normal that makes the node → point" settles them. A node that does not settle has no point: NaN.

    Parameters
    ----------
    sphere : Sphere
    light_mm : array_like, shape (3,)
        Position of the light in the camera's frame.
    theta_h, phi_d : ndarray, broadcastable to one shape (...)
        Nodes, radians.
    """
    theta_h, phi_d = np.broadcast_arrays(theta_h, phi_d)
    centre, light = np.asarray(sphere.centre_mm), np.asarray(light_mm)
    normal = np.zeros((*theta_h.shape, 3))
    position = np.broadcast_to(centre, normal.shape)
    for _ in range(MOST_ROUNDS):
        previous = normal
        to_light, to_camera = normalised(light - position), normalised(-position)
        half = normalised(to_light + to_camera)
        u = transverse(to_light, half)
        w = np.cross(half, u)
        tangent = np.cos(phi_d)[..., None] * u - np.sin(phi_d)[..., None] * w
        normal = np.cos(theta_h)[..., None] * half - np.sin(theta_h)[..., None] * tangent
        position = centre + sphere.radius_mm * normal
        # written so that NaN, where light and camera are opposite, counts as unsettled
        settled = np.linalg.norm(normal - previous, axis=-1) < SETTLED
        if settled.all():
            break
    return normal_points(sphere, light, np.where(settled[..., None], normal, np.nan))


def normal_points(sphere: Sphere, light_mm: ArrayLike, normal: Float) -> SurfacePoints:
    """Points where the sphere has given normals (..., 3); NaN normals give NaN."""
    light = np.asarray(light_mm, dtype=np.float64)
    position = np.asarray(sphere.centre_mm) + sphere.radius_mm * normal
    to_light = normalised(light - position)
    to_camera = normalised(-position)
    return SurfacePoints(
        position,
        to_light,
        to_camera,
        np.sum(normal * to_light, axis=-1),
        np.sum(normal * to_camera, axis=-1),
        np.linalg.norm(light - position, axis=-1),
    )
