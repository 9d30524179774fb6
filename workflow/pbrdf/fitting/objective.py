"""The nodes of a table that a fit looks at, and the distance of a model from them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.formats.table_data import Origin, TableData
from pbrdf.models import Model
from pbrdf.models.interface import NodeCost
from pbrdf.optics.rusinkiewicz import cosines, directions

Float = NDArray[np.float64]

_HORIZON = 1e-9
"""Least cosine of a node that counts as above the horizon: rounding puts θi = 90° at 6e-17."""


@dataclass(frozen=True)
class Nodes:
    """Nodes of a table with a measured value in at least one band.

    Attributes
    ----------
    indices : ndarray, shape (n, 3), intp
        Positions on the axes θh, θd, φd of the table.
    to_light, to_camera : ndarray, shape (n, 3), float64
        Unit vectors with z the normal.
    mueller : ndarray, shape (B, n, 4, 4), float32
        1/sr, table frames; zero where the weight is zero.
    weight : ndarray, shape (B, n), float32
        1 where the band has a measured value, 0 elsewhere.
    """

    indices: NDArray[np.intp]
    to_light: Float
    to_camera: Float
    mueller: NDArray[np.float32]
    weight: NDArray[np.float32]

    @cached_property
    def norms(self) -> Float:
        """Frobenius norm of each matrix, shape (B, n), 1/sr; 0 where the weight is zero."""
        norms: Float = np.linalg.norm(self.mueller.astype(np.float64), axis=(-2, -1))
        return norms

    @cached_property
    def scale(self) -> Float:
        """Typical norm of a matrix in each band, shape (B,), 1/sr: the median, or the mean if that is 0."""
        scale = np.empty(len(self.norms))
        for band, (norms, weight) in enumerate(zip(self.norms, self.weight, strict=True)):
            known = norms[weight > 0]
            scale[band] = np.median(known) or np.mean(known)
        return scale

    def subset(self, chosen: NDArray[np.intp]) -> Nodes:
        """Only the nodes at the positions `chosen`."""
        return Nodes(
            self.indices[chosen],
            self.to_light[chosen],
            self.to_camera[chosen],
            self.mueller[:, chosen],
            self.weight[:, chosen],
        )


def select_nodes(data: TableData, downsample: int) -> Nodes:
    """Take every `downsample`-th node of each direction axis that holds a measured value.

    Left out are nodes at or below the horizon, those with θd = 0 (where the frames are not
    defined), those with a value that is not finite or with zeros alone, and, if the table tells the
    origin of its values, those that are not measured.

    Raises
    ------
    InputError
        If `downsample` is below 1, or a band has no such node or nothing but zeros in M00.
    """
    if downsample < 1:
        raise InputError("fit", "downsample", f"is {downsample}", "give a whole number of at least 1")
    rows = tuple(np.arange(0, len(axis), downsample) for axis in (data.theta_h, data.theta_d, data.phi_d))
    angles = np.meshgrid(
        *(a[r] for a, r in zip((data.theta_h, data.theta_d, data.phi_d), rows, strict=True)), indexing="ij"
    )
    grid = np.ix_(np.arange(len(data.wavelengths_nm)), *rows)
    mueller = data.mueller[grid]
    # a matrix of zeros alone is how a file without NaN says that it knows nothing
    measured = np.isfinite(mueller).all(axis=(-2, -1)) & (mueller != 0).any(axis=(-2, -1))
    if data.origin is not None:
        measured &= data.origin[grid] == Origin.MEASURED
    cos_i, cos_o = cosines(*angles)
    measured &= (cos_i > _HORIZON) & (cos_o > _HORIZON) & (angles[1] > 0)

    used = measured.any(axis=0)
    positions = np.argwhere(used)
    indices = np.stack([row[p] for row, p in zip(rows, positions.T, strict=True)], axis=-1)
    to_light, to_camera = directions(*(a[used] for a in angles))
    weight = measured[:, used].astype(np.float32)
    known = np.where(weight[..., None, None] > 0, mueller[:, used], np.float32(0.0))
    nodes = Nodes(indices, to_light, to_camera, known, weight)
    _check_bands(data, nodes, downsample)
    return nodes


def _check_bands(data: TableData, nodes: Nodes, downsample: int) -> None:
    for wavelength, mueller, weight in zip(data.wavelengths_nm, nodes.mueller, nodes.weight, strict=True):
        band = f"mueller at {wavelength:g} nm"
        if not np.any(weight):
            problem = f"holds nothing but zeros or NaN among its measured nodes (every {downsample}-th)"
            raise InputError(data.source, band, problem, "lower `downsample`, or leave the band out")
        if not np.any(mueller[weight > 0, 0, 0] > 0):
            raise InputError(
                data.source, band, "has no positive M00", "check the table, or leave the band out"
            )


class Objective:
    """Cost of a model over nodes, as a function of one vector of parameters.

    The vector holds the shared parameters, then for each band its own.

    Parameters
    ----------
    model : Model
        What is fitted.
    nodes : Nodes
        To what.

    Attributes
    ----------
    evaluations : int
        Calls of `cost` and `band_cost` so far, each band counted as its share of one.
    """

    def __init__(self, model: Model, nodes: Nodes) -> None:
        self.model = model
        self.nodes = nodes
        self.bands = len(nodes.mueller)
        self.shared = [p for p in model.parameters if p.shared]
        self.own = [p for p in model.parameters if not p.shared]
        self.lower = np.array([p.lower for p in self.shared] + [p.lower for p in self.own] * self.bands)
        self.upper = np.array([p.upper for p in self.shared] + [p.upper for p in self.own] * self.bands)
        geometry = model.node_geometry(nodes.to_light, nodes.to_camera)
        self._costs: list[NodeCost] = [
            model.node_cost(geometry, mueller, weight)
            for mueller, weight in zip(nodes.mueller, nodes.weight, strict=True)
        ]
        self._band_calls = 0

    @property
    def evaluations(self) -> int:
        """Evaluations of the whole cost; those of single bands add up."""
        return -(-self._band_calls // self.bands)

    def band_entries(self, band: int) -> NDArray[np.intp]:
        """Positions in the vector of the parameters of one band, in the order of the model's."""
        first = len(self.shared) + band * len(self.own)
        return np.concatenate([np.arange(len(self.shared)), np.arange(first, first + len(self.own))])

    def band_parameters(self, vector: Float, band: int) -> dict[str, float]:
        """Parameters of one band by name, as `Model.evaluate` takes them."""
        values = vector[self.band_entries(band)]
        return {p.name: float(v) for p, v in zip(self.model.parameters, values, strict=True)}

    def band_cost(self, band: int, parameters: Mapping[str, float], epsilon: float) -> tuple[float, Float]:
        """Cost of one band, 1/sr, and its gradient by the model's parameters.

        `epsilon` is relative to the typical norm of the band's matrices.
        """
        self._band_calls += 1
        return self._costs[band](parameters, epsilon * float(self.nodes.scale[band]))

    def cost(self, vector: Float, epsilon: float) -> tuple[float, Float]:
        """Sum of the costs of all bands, 1/sr, and its gradient by the vector."""
        total = 0.0
        gradient = np.zeros_like(vector)
        for band in range(self.bands):
            value, slope = self.band_cost(band, self.band_parameters(vector, band), epsilon)
            total += value
            gradient[self.band_entries(band)] += slope
        return total, gradient
