"""Directional-hemispherical reflectance: how much of a ray's power goes out again, in all directions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pbrdf.models import Model
from pbrdf.models.table import Table

Float = NDArray[np.float64]

_OF_MODEL = (128, 64)
"""Tilts and azimuths of half vectors: reflectances come out to 1e-3 down to a roughness of 0.01."""
_OF_TABLE = (64, 48)
"""A table is linear between its nodes: no more is needed, and its evaluation is slow."""


@dataclass(frozen=True)
class Reflectance:
    """Reflectance for unpolarised light.

    Attributes
    ----------
    value : float
        Reflected over incident power, a pure number.
    known : float
        Share of the reflected hemisphere, weighed with the cosine, over which the integral could be
        taken; below 1 the value is a lower limit.
    """

    value: float
    known: float


def model_reflectance(model: Model, parameters: Mapping[str, float], theta_i: float) -> Reflectance:
    """Integrate a model's M00 cosθo over the hemisphere, for light that comes in at `theta_i` (radians)."""

    def m00(light: Float, camera: Float) -> Float:
        return model.evaluate(light, camera, parameters)[:, 0, 0]

    return _integrate(m00, theta_i, *_OF_MODEL)


def table_reflectance(table: Table, wavelength_nm: float, theta_i: float) -> Reflectance:
    """Integrate a table's M00 cosθo over what it knows of the hemisphere."""

    def m00(light: Float, camera: Float) -> Float:
        return table.evaluate(light, camera, wavelength_nm)[:, 0, 0]

    return _integrate(m00, theta_i, *_OF_TABLE)


def _integrate(
    m00: Callable[[Float, Float], Float], theta_i: float, tilts: int, azimuths: int
) -> Reflectance:
    """Quadrature over half vectors, dω_o = 4 cosθd dω_h, dense where highlights are."""
    light, camera, solid_angle = _half_vector_nodes(theta_i, tilts, azimuths)
    weight = camera[:, 2] * solid_angle
    values = m00(light, camera)
    known = np.isfinite(values)
    return Reflectance(
        float(np.sum(values[known] * weight[known])), float(weight[known].sum() / weight.sum())
    )


def _half_vector_nodes(theta_i: float, tilts: int, azimuths: int) -> tuple[Float, Float, Float]:
    """Directions to light and camera, shape (n, 3), both above the horizon, and solid angles, sr."""
    position, share = np.polynomial.legendre.leggauss(tilts)
    position, share = (position + 1) / 2, share / 2
    # by the cube: a highlight of a hundredth still meets a sixth of the nodes
    tilt, width = np.pi / 2 * position**3, np.pi / 2 * 3 * position**2 * share
    step = 2 * np.pi / azimuths
    theta, phi = np.meshgrid(tilt, (np.arange(azimuths) + 0.5) * step, indexing="ij")
    across = np.sin(theta)
    half = np.stack([across * np.cos(phi), across * np.sin(phi), np.cos(theta)], axis=-1).reshape(-1, 3)
    half_angle = np.repeat(np.sin(tilt) * width, azimuths) * step
    light = np.array([np.sin(theta_i), 0.0, np.cos(theta_i)])
    cos_d = half @ light
    camera = 2 * cos_d[:, None] * half - light
    above = (cos_d > 0) & (camera[:, 2] > 0)
    return np.tile(light, (int(above.sum()), 1)), camera[above], (4 * cos_d * half_angle)[above]
