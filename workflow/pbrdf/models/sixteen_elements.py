"""A made-up material whose sixteen elements are all there, for putting a whole chain to the test.

Facet models leave many elements zero, whose sign and frame they therefore cannot prove. This table
adds to one a smooth part in every element that obeys what any isotropic, mirror-symmetric and
reciprocal surface must: ``M(−φd) = Q M(φd) Q`` and ``M(φd + π) = P M(φd)ᵀ P``.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pbrdf.formats.pbsdf import write_pbsdf
from pbrdf.formats.table_data import TableData
from pbrdf.models.baek2018 import BAEK2018_COMPLEX
from pbrdf.optics.rusinkiewicz import directions

Float = NDArray[np.float64]

NODES = (46, 46, 91)
BANDS = (
    (450, {"alpha": 0.35, "eta": 1.5, "kappa": 1.9, "specular": 0.5, "albedo": 0.5}),
    (500, {"alpha": 0.35, "eta": 1.2, "kappa": 2.1, "specular": 0.5, "albedo": 0.45}),
    (550, {"alpha": 0.35, "eta": 0.9, "kappa": 2.4, "specular": 0.5, "albedo": 0.4}),
    (600, {"alpha": 0.35, "eta": 0.7, "kappa": 2.7, "specular": 0.5, "albedo": 0.35}),
    (650, {"alpha": 0.35, "eta": 0.6, "kappa": 3.0, "specular": 0.5, "albedo": 0.3}),
)
"""By wavelength, nm: a metal's facets over a scattering ground."""

POLARISED, AMPLITUDE = 0.75, 0.08
"""What is left of the facets' polarisation, and the part in all other elements, both over M00: together
they leave the matrices physical."""

_MIRROR = np.array([1.0, 1.0, -1.0, -1.0])
_RECIPROCAL = np.array([1.0, 1.0, -1.0, 1.0])


def write_sixteen_elements(path: str | Path) -> None:
    """Write the material as a ``.pbsdf`` of 61 MB; the same bytes every time.

    Raises
    ------
    InputError
        If the disk refuses.
    """
    theta_h = np.linspace(0.0, 1.0, NODES[0]) ** 2 * np.pi / 2
    theta_d = np.linspace(0.0, np.pi / 2, NODES[1])
    phi_d = np.linspace(-np.pi, np.pi, NODES[2])
    grid = np.meshgrid(theta_h, np.maximum(theta_d, 1e-4), phi_d, indexing="ij")
    to_light, to_camera = directions(*grid)
    mueller = np.empty((len(BANDS), *NODES, 4, 4), np.float32)
    for index, (_, facets) in enumerate(BANDS):
        matrices = BAEK2018_COMPLEX.evaluate(to_light, to_camera, facets)
        m00 = matrices[..., 0, 0].copy()
        matrices *= POLARISED
        matrices += (1.0 - 0.1 * index) * AMPLITUDE * m00[..., None, None] * _everywhere(*grid)
        matrices[..., 0, 0] = m00
        mueller[index] = matrices
    wavelengths = np.array([nm for nm, _ in BANDS], np.float64)
    write_pbsdf(path, TableData(str(path), wavelengths, theta_h, theta_d, phi_d, mueller))


def _everywhere(theta_h: Float, theta_d: Float, phi_d: Float) -> Float:
    """Smooth matrices (..., 4, 4) of all elements; nothing at the poles, where φd has no meaning."""
    waves = np.zeros((*theta_h.shape, 4, 4))
    for row in range(4):
        # reciprocity fills the other half
        for column in range(row, 4):
            around = 2 if row == column else 1 + (row + column) % 2
            odd = _MIRROR[row] * _MIRROR[column] < 0
            turning = np.sin(around * phi_d) if odd else np.cos(around * phi_d)
            along = 1.0 + 0.5 * np.cos((1 + 0.2 * row) * theta_h + (1 + 0.3 * column) * theta_d)
            waves[..., row, column] = turning * along
    sin_h, sin_d = np.sin(theta_h), np.sin(theta_d)
    waves *= (sin_h / (sin_h + 0.3) * sin_d / (sin_d + 0.3))[..., None, None]
    count = theta_h.shape[2] - 1
    opposite = (np.arange(count + 1) + count // 2) % count
    back = np.swapaxes(waves[:, :, opposite], -1, -2) * np.outer(_RECIPROCAL, _RECIPROCAL)
    both: Float = (waves + back) / 2
    return both
