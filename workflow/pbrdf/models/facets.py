"""A model of facets as `pbrdf.models.Model`: one roughness for all bands, the rest for each band.

What the models differ in, lobe and diffuse term, lies in the kernels; their parameters and names lie
in a module for each family.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf._kernels import facet, facet_fit
from pbrdf.models.interface import CostKind, NodeCost, Parameter

Float = NDArray[np.float64]

_OWN = ("eta", "kappa", "specular", "albedo")
"""What the kernels want of each band, and give slopes by after the roughness."""


def facet_parameters(roughness: Parameter, *, complex_index: bool) -> tuple[Parameter, ...]:
    """Parameters of a facet model: roughness; index, specular weight and albedo of each band.

    With a complex index n − ik these are 21 for five bands, with a real one, which has to be above
    1, they are 16.
    """
    index: tuple[Parameter, ...]
    if complex_index:
        index = (
            Parameter("eta", "refractive index n", "1", 0.05, 5.0, False, False, (0.2, 0.7, 1.5, 3.0)),
            Parameter("kappa", "extinction coefficient k", "1", 0.0, 10.0, False, False, (0.05, 2.0, 4.0)),
        )
    else:
        starts = (1.15, 1.3, 1.45, 1.6, 1.8, 2.1, 2.5, 2.9)
        index = (Parameter("eta", "refractive index", "1", 1.05, 3.0, False, False, starts),)
    return (
        roughness,
        *index,
        Parameter("specular", "specular weight", "1", 0.0, np.inf, shared=False, linear=True),
        Parameter("albedo", "diffuse albedo", "1", 0.0, 1.0, shared=False, linear=True),
    )


@dataclass(frozen=True)
class FacetModel:
    """Implements `pbrdf.models.Model`.

    Attributes
    ----------
    name : str
        Key in `pbrdf.models.MODELS`.
    kernel : str
        What the kernels call its lobe and diffuse term.
    m00 : str
        How M00 relates to the parameters.
    parameters : tuple of Parameter
        As `facet_parameters` gives them, the roughness first.
    """

    name: str
    kernel: str
    m00: str
    parameters: tuple[Parameter, ...]

    def evaluate(self, to_light: ArrayLike, to_camera: ArrayLike, parameters: Mapping[str, float]) -> Float:
        """Mueller matrices of one band in the table frames.

        Parameters
        ----------
        to_light, to_camera : array_like, shapes that broadcast to (..., 3)
            Unit vectors L and V with z the surface normal. Where L = V the frame is the limit
            φd → 0.
        parameters : mapping
            A value for each of `parameters`; `kappa` is 0 where it is absent, and may be given to a
            model that has it not.

        Returns
        -------
        ndarray, shape (..., 4, 4), float64
            1/sr, no cosine; zero where either direction is at or below the horizon.

        Raises
        ------
        ValueError
            If roughness or `eta` is not positive, `kappa` is negative, or the roughness is beyond
            where the model is known.
        """
        light, camera = np.broadcast_arrays(
            np.asarray(to_light, dtype=np.float64), np.asarray(to_camera, dtype=np.float64)
        )
        shape = light.shape[:-1]
        mueller = np.empty((*shape, 4, 4))
        facet.evaluate(
            np.ascontiguousarray(light.reshape(-1, 3)),
            np.ascontiguousarray(camera.reshape(-1, 3)),
            model=self.kernel,
            out=mueller.reshape(-1, 16),
            **self._arguments(parameters),
        )
        return mueller

    def node_cost(
        self,
        to_light: Float,
        to_camera: Float,
        mueller: NDArray[np.float32],
        weight: NDArray[np.float32],
        kind: CostKind = CostKind.NORMS,
    ) -> NodeCost:
        """Cost against measured matrices; see `pbrdf.models.Model`."""
        directions = np.ascontiguousarray(to_light), np.ascontiguousarray(to_camera)
        geometry = facet_fit.geometry_float64(*directions), facet_fit.geometry_float32(*directions)
        elements = (16,) if kind == CostKind.SQUARES else ()
        table = facet_fit.pack(
            np.ascontiguousarray(mueller.reshape(*mueller.shape[:2], 16)),
            np.ascontiguousarray(weight.reshape(*weight.shape[:2], *elements)),
            kind,
        )
        names = [p.name for p in self.parameters]
        of = [_OWN.index(name) for name in names[1:]]
        by = [0, *(1 + column for column in of)]

        def cost(
            shared: Float, own: Float, epsilon: Float, *, bands: slice = slice(None), single: bool = False
        ) -> tuple[Float, Float]:
            values = np.zeros((len(own), len(_OWN)))
            values[:, of] = own
            costs, gradients = facet_fit.cost_gradient(
                geometry[single],
                table[bands],
                kind=kind,
                model=self.kernel,
                complex="kappa" in names,
                roughness=shared[0],
                own=values,
                epsilon=epsilon,
            )
            return costs, gradients[:, by]

        return cost

    def _arguments(self, parameters: Mapping[str, float]) -> dict[str, float]:
        """Arguments of the kernels."""
        return {
            "roughness": parameters[self.parameters[0].name],
            "eta": parameters["eta"],
            "kappa": parameters.get("kappa", 0.0),
            "specular": parameters["specular"],
            "albedo": parameters["albedo"],
        }
