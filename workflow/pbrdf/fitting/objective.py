"""The distance of a model from the nodes of a table."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pbrdf.fitting.nodes import Nodes
from pbrdf.models import Model
from pbrdf.models.interface import CostKind, NodeCost

Float = NDArray[np.float64]


class Objective:
    """Cost of a model over nodes, as a function of one vector of parameters.

    The vector holds the shared parameters, then for each band its own.

    Parameters
    ----------
    model : Model
        What is fitted.
    nodes : Nodes
        To what; with variances for `CostKind.SQUARES`.
    kind : CostKind
        What is summed over the nodes.

    Attributes
    ----------
    evaluations : int
        Calls of `cost` and `band_cost` so far, each band counted as its share of one.
    """

    def __init__(self, model: Model, nodes: Nodes, kind: CostKind = CostKind.NORMS) -> None:
        self.model = model
        self.nodes = nodes
        self.kind = kind
        self.bands = len(nodes.mueller)
        self.shared = [p for p in model.parameters if p.shared]
        self.own = [p for p in model.parameters if not p.shared]
        self.lower = np.array([p.lower for p in self.shared] + [p.lower for p in self.own] * self.bands)
        self.upper = np.array([p.upper for p in self.shared] + [p.upper for p in self.own] * self.bands)
        geometry = model.node_geometry(nodes.to_light, nodes.to_camera)
        self._costs: list[NodeCost] = [
            model.node_cost(geometry, mueller, self.weight(band), kind)
            for band, mueller in enumerate(nodes.mueller)
        ]
        self._band_calls = 0

    @property
    def evaluations(self) -> int:
        """Evaluations of the whole cost; those of single bands add up."""
        return -(-self._band_calls // self.bands)

    def weight(self, band: int) -> NDArray[np.float32]:
        """Weights of one band's nodes, shape (n,); for squares of its elements, (n, 4, 4), sr²."""
        weight: NDArray[np.float32] = self.nodes.weight[band]
        if self.kind != CostKind.SQUARES:
            return weight
        assert self.nodes.variance is not None
        known, variance = weight[:, None, None], self.nodes.variance[band]
        inverse: NDArray[np.float32] = np.divide(
            known, variance, out=np.zeros_like(variance), where=known > 0
        )
        return inverse

    def band_entries(self, band: int) -> NDArray[np.intp]:
        """Positions in the vector of the parameters of one band, in the order of the model's."""
        first = len(self.shared) + band * len(self.own)
        return np.concatenate([np.arange(len(self.shared)), np.arange(first, first + len(self.own))])

    def band_parameters(self, vector: Float, band: int) -> dict[str, float]:
        """Parameters of one band by name, as `Model.evaluate` takes them."""
        values = vector[self.band_entries(band)]
        return {p.name: float(v) for p, v in zip(self.model.parameters, values, strict=True)}

    def band_cost(self, band: int, parameters: Mapping[str, float], epsilon: float) -> tuple[float, Float]:
        """Cost of one band, in the unit of `kind`, and its gradient by the model's parameters.

        `epsilon` is relative to the typical norm of the band's matrices.
        """
        self._band_calls += 1
        return self._costs[band](parameters, epsilon * float(self.nodes.scale[band]))

    def cost(self, vector: Float, epsilon: float) -> tuple[float, Float]:
        """Sum of the costs of all bands and its gradient by the vector."""
        total = 0.0
        gradient = np.zeros_like(vector)
        for band in range(self.bands):
            value, slope = self.band_cost(band, self.band_parameters(vector, band), epsilon)
            total += value
            gradient[self.band_entries(band)] += slope
        return total, gradient
