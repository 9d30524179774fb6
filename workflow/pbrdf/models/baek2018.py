"""The microfacet pBRDF of Baek et al. 2018 with one roughness for all bands.

Specular: GGX distribution, Smith's separable masking and Fresnel's reflection at the half vector.
Diffuse: Fresnel's transmission into the surface, full depolarisation, transmission out of it. For
five bands these are 16 parameters: the roughness and, per band, the specular weight, the albedo
and the (real) index.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf._kernels import facet
from pbrdf.models.interface import CostKind, NodeCost, Parameter

Float = NDArray[np.float64]

_ROUGHNESS = tuple(float(a) for a in np.geomspace(0.012, 0.9, 14))
_INDEX = (1.15, 1.3, 1.45, 1.6, 1.8, 2.1, 2.5, 2.9)


@dataclass(frozen=True)
class Baek2018:
    """Implements `pbrdf.models.Model`."""

    name: str = "baek2018"
    m00: str = "specular · D G (Rs + Rp) / (8 cosθi cosθo) + albedo/π · T⁺(θo) T⁺(θi)"
    parameters: tuple[Parameter, ...] = (
        Parameter("alpha", "GGX roughness", "1", 0.01, 1.0, shared=True, linear=False, start=_ROUGHNESS),
        Parameter("eta", "refractive index", "1", 1.05, 3.0, shared=False, linear=False, start=_INDEX),
        Parameter("specular", "specular weight", "1", 0.0, np.inf, shared=False, linear=True),
        Parameter("albedo", "diffuse albedo", "1", 0.0, 1.0, shared=False, linear=True),
    )

    def evaluate(self, to_light: ArrayLike, to_camera: ArrayLike, parameters: Mapping[str, float]) -> Float:
        """Mueller matrices of one band in the table frames.

        Parameters
        ----------
        to_light, to_camera : array_like, shapes that broadcast to (..., 3)
            Unit vectors L and V with z the surface normal. Where L = V the frame is the limit
            φd → 0.
        parameters : mapping
            `alpha`, `eta`, `specular` and `albedo`; optionally `kappa`, the extinction coefficient k
            of a metal's index n − ik (0 if absent), which the specular term alone takes.

        Returns
        -------
        ndarray, shape (..., 4, 4), float64
            1/sr, no cosine; zero where either direction is at or below the horizon.

        Raises
        ------
        ValueError
            If `alpha` or `eta` is not positive or `kappa` is negative.
        """
        light, camera = np.broadcast_arrays(
            np.asarray(to_light, dtype=np.float64), np.asarray(to_camera, dtype=np.float64)
        )
        shape = light.shape[:-1]
        mueller = np.empty((*shape, 4, 4))
        facet.evaluate(
            np.ascontiguousarray(light.reshape(-1, 3)),
            np.ascontiguousarray(camera.reshape(-1, 3)),
            alpha=parameters["alpha"],
            eta=parameters["eta"],
            kappa=parameters.get("kappa", 0.0),
            specular=parameters["specular"],
            albedo=parameters["albedo"],
            out=mueller.reshape(-1, 16),
        )
        return mueller

    def node_geometry(self, to_light: Float, to_camera: Float) -> Float:
        """Precompute what `node_cost` needs of directions (n, 3) above the horizon; opaque."""
        geometry: Float = facet.geometry(np.ascontiguousarray(to_light), np.ascontiguousarray(to_camera))
        return geometry

    def node_cost(
        self,
        geometry: Float,
        mueller: NDArray[np.float32],
        weight: NDArray[np.float32],
        kind: CostKind = CostKind.NORMS,
    ) -> NodeCost:
        """Cost against measured matrices (n, 4, 4) of one band; see `Model.node_cost`."""
        if kind is not CostKind.NORMS:
            raise ValueError(f"no kernel sums {kind}")
        table = facet.pack(np.ascontiguousarray(mueller.reshape(-1, 16)), np.ascontiguousarray(weight))

        def cost(parameters: Mapping[str, float], epsilon: float) -> tuple[float, Float]:
            value, gradient = facet.cost_gradient(
                geometry,
                table,
                alpha=parameters["alpha"],
                eta=parameters["eta"],
                specular=parameters["specular"],
                albedo=parameters["albedo"],
                epsilon=epsilon,
            )
            return value, gradient

        return cost


BAEK2018 = Baek2018()
