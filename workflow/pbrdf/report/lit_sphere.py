"""A sphere of the material under one distant lamp, as our own evaluators of table and models see it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pbrdf.optics.mueller import rotator
from pbrdf.report.figures import Float

SIDE = 150
"""Pixels along the side of a picture."""
LAMP_DEG = 70.0
"""Angle between lamp and camera; θd is half of it on the whole sphere."""

Evaluator = Callable[[Float, Float, int], Float]
"""Mueller matrices (..., 4, 4), 1/sr in the table frames, of a band for vectors to light and camera."""

INCIDENT = {
    "unpolarised light": (1.0, 0.0, 0.0, 0.0),
    "light polarised at 45° to the plane of light and camera": (1.0, 0.0, 1.0, 0.0),
}


@dataclass(frozen=True)
class SphereView:
    """Directions at the pixels of a sphere seen from afar, lamp and camera in the horizontal plane.

    Attributes
    ----------
    on_sphere : ndarray of bool, shape (side, side)
    to_light, to_camera : ndarray, shape (n, 3)
        At the pixels that the lamp reaches, in frames whose z is the normal there.
    lit : ndarray of bool, shape (side, side)
        Which pixels those are.
    cosine : ndarray, shape (n,)
        Of the angle of incidence.
    """

    on_sphere: NDArray[np.bool_]
    to_light: Float
    to_camera: Float
    lit: NDArray[np.bool_]
    cosine: Float


def sphere_view(side: int = SIDE, lamp_deg: float = LAMP_DEG) -> SphereView:
    """Lay pixels over a sphere; the lamp stands `lamp_deg` to the left of the camera."""
    at = (np.arange(side) + 0.5) / side * 2.1 - 1.05
    x, y = np.meshgrid(at, -at)
    inside = x**2 + y**2 < 1
    z = np.sqrt(np.where(inside, 1 - x**2 - y**2, 0))
    normal = np.stack([x, y, z], axis=-1)
    lamp = np.array([-np.sin(np.radians(lamp_deg)), 0.0, np.cos(np.radians(lamp_deg))])
    camera = np.array([0.0, 0.0, 1.0])
    lit = inside & (normal @ lamp > 0) & (z > 0)
    n = normal[lit]
    # any tangents do: the material is isotropic
    tangent = np.cross(np.where(np.abs(n[:, :1]) < 0.9, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]]), n)
    tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
    other = np.cross(n, tangent)
    local = [np.stack([tangent @ d, other @ d, n @ d], axis=-1) for d in (lamp, camera)]
    return SphereView(inside, local[0], local[1], lit, n @ lamp)


def reflected_stokes(view: SphereView, evaluate: Evaluator, band: int, incident: tuple[float, ...]) -> Float:
    """Stokes vectors that the camera sees, per unit of irradiance, shape (side, side, 4).

    In the camera's frame: x to the right, the camera looking into the beam. Zero on the dark side and NaN
    off the sphere and where nothing is known.
    """
    mueller = evaluate(view.to_light, view.to_camera, band)
    stokes = np.full((*view.lit.shape, 4), np.nan)
    stokes[view.on_sphere] = 0.0
    # the frames' x stands across the plane of light and camera, which is horizontal: the image's x lies in it
    seen = (rotator(np.pi / 2) @ mueller @ np.asarray(incident)) * view.cosine[:, None]
    stokes[view.lit] = seen
    return stokes


def photograph(
    view: SphereView, evaluate: Evaluator, wavelengths_nm: Float, incident: tuple[float, ...], white: float
) -> Float:
    """What a camera with three of the bands as red, green and blue shows, shape (side, side, 3), 0 to 1.

    `white` is the radiance that is shown white; sRGB's curve, NaN as in `reflected_stokes`.
    """
    bands = [int(np.abs(wavelengths_nm - nm).argmin()) for nm in (630.0, 550.0, 460.0)]
    radiance = np.stack([reflected_stokes(view, evaluate, b, incident)[..., 0] for b in bands], axis=-1)
    linear = np.clip(radiance / white, 0.0, 1.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def white_level(view: SphereView, evaluators: Mapping[str, Evaluator], wavelengths_nm: Float) -> float:
    """Radiance that all pictures of a material show white: nearly the brightest of the first."""
    first = next(iter(evaluators.values()))
    band = int(np.abs(wavelengths_nm - 550.0).argmin())
    radiance = reflected_stokes(view, first, band, INCIDENT["unpolarised light"])[..., 0]
    known = radiance[np.isfinite(radiance)]
    level = float(np.percentile(known, 99.0)) if known.size else 0.0
    return level if level > 0 else 1.0
