"""The distance of a model from the nodes of a table."""

from __future__ import annotations

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
        Of the whole cost so far, each band counted as its share of one.
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
        weight = np.stack([self.weight(band) for band in range(self.bands)])
        self._cost: NodeCost = model.node_cost(nodes.to_light, nodes.to_camera, nodes.mueller, weight, kind)
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

    def costs(
        self, vector: Float, epsilon: float, *, bands: slice = slice(None), single: bool = False
    ) -> tuple[Float, Float]:
        """Cost of each band, shape (B,), in the unit of `kind`, and its gradient, (B, parameters of a band).

        `epsilon` is relative to the typical norm of a band's matrices; `single`: see `NodeCost`.
        """
        first = len(self.shared)
        own = vector[first:].reshape(self.bands, -1)[bands]
        scale = self.nodes.scale[bands]
        self._band_calls += len(scale)
        return self._cost(vector[:first], own, epsilon * scale, bands=bands, single=single)

    def cost(self, vector: Float, epsilon: float, *, single: bool = False) -> tuple[float, Float]:
        """Sum of the costs of all bands and its gradient by the vector."""
        costs, gradients = self.costs(vector, epsilon, single=single)
        first = len(self.shared)
        return float(costs.sum()), np.concatenate(
            [gradients[:, :first].sum(axis=0), gradients[:, first:].ravel()]
        )

    def band_cost(self, vector: Float, epsilon: float, band: int) -> tuple[float, Float]:
        """Cost of one band and its gradient by the vector, zero where that is of other bands."""
        costs, gradients = self.costs(vector, epsilon, bands=slice(band, band + 1))
        gradient = np.zeros_like(vector)
        gradient[self.band_entries(band)] = gradients[0]
        return float(costs[0]), gradient
