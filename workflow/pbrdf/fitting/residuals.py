"""What a fitted model leaves over: by node, and summed up by Mueller element."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pbrdf.fitting.objective import Objective
from pbrdf.models.interface import CostKind

Float = NDArray[np.float64]
Matrix = tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Residuals:
    """Distance of a model from nodes.

    Attributes
    ----------
    nodes : tuple of int
        Nodes with a measured value, for each band.
    cost : float
        Sum of what the `CostKind` says over nodes and bands, nothing rounded.
    rms : tuple of 4×4 tuples
        Root mean square over the nodes of each element of model − table, 1/sr, for each band.
    relative : tuple of 4×4 tuples
        The same divided by the root mean square of the table's M00.
    """

    nodes: tuple[int, ...]
    cost: float
    rms: tuple[Matrix, ...]
    relative: tuple[Matrix, ...]

    @property
    def cost_per_node(self) -> float:
        """The cost divided by the number of matrices in the sum."""
        return self.cost / sum(self.nodes)


def residuals(objective: Objective, vector: Float) -> Residuals:
    """Sum up what the model of an objective leaves over at its nodes."""
    cost, nodes, rms, relative = 0.0, [], [], []
    for band in range(objective.bands):
        difference, table = band_difference(objective, vector, band)
        of_elements = _root_mean_square(difference)
        cost += _cost(objective, difference, band)
        nodes.append(len(difference))
        rms.append(as_matrix(of_elements))
        relative.append(as_matrix(of_elements / _root_mean_square(table[:, 0, 0])))
    return Residuals(tuple(nodes), cost, tuple(rms), tuple(relative))


def band_difference(objective: Objective, vector: Float, band: int) -> tuple[Float, Float]:
    """Model − table and the table, both (n, 4, 4), over the nodes measured in one band."""
    nodes = objective.nodes
    used = nodes.weight[band] > 0
    table = nodes.mueller[band, used].astype(np.float64)
    values = objective.model.evaluate(
        nodes.to_light[used], nodes.to_camera[used], objective.band_parameters(vector, band)
    )
    return values - table, table


def as_matrix(values: Float) -> Matrix:
    """Plain numbers of a 4×4 array."""
    return tuple(tuple(float(v) for v in row) for row in values)


def _cost(objective: Objective, difference: Float, band: int) -> float:
    weight = objective.weight(band)
    weight = weight[objective.nodes.weight[band] > 0].astype(np.float64)
    if objective.kind is CostKind.SQUARES:
        return float(np.sum(weight * difference**2))
    if objective.kind is CostKind.ROOTS:
        return float(np.sum(weight * np.sqrt(np.abs(difference)).sum(axis=(-2, -1))))
    return float(np.sum(weight * np.linalg.norm(difference, axis=(-2, -1))))


def _root_mean_square(values: Float) -> Float:
    rms: Float = np.sqrt(np.mean(values**2, axis=0))
    return rms
