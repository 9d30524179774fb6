"""What a model tells of itself: its parameters, its values and its cost against a table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float = NDArray[np.float64]


@dataclass(frozen=True)
class Parameter:
    """One parameter of a model.

    Attributes
    ----------
    name : str
        Key in `Model.evaluate` and in the files of fits.
    meaning : str
        In words, for reports.
    unit : str
        "1" for a pure number.
    lower, upper : float
        Bounds, both allowed; `upper` may be infinite.
    shared : bool
        One value for all bands, or one for each band.
    linear : bool
        Whether the model is linear in it: a weight with a lower bound of zero.
    start : tuple of float
        Values from which a search begins; for a linear parameter none is needed.
    """

    name: str
    meaning: str
    unit: str
    lower: float
    upper: float
    shared: bool
    linear: bool
    start: tuple[float, ...] = ()


class CostKind(StrEnum):
    """How the difference Δ of two matrices becomes a number, before the sum over the nodes."""

    NORMS = "norms"
    """``w √(‖Δ‖² + ε²)`` with the Frobenius norm; 1/sr."""
    ROOTS = "roots"
    """``w Σ_ij (Δ_ij² + ε²)^¼``; 1/√sr."""
    SQUARES = "squares"
    """``Σ_ij w_ij Δ_ij²``; of the unit of the weights over sr². Nothing is rounded by ε."""


class NodeCost(Protocol):
    """Distance of a model from some bands of a table, over nodes whose geometry is precomputed."""

    def __call__(
        self, shared: Float, own: Float, epsilon: Float, *, bands: slice = ..., single: bool = ...
    ) -> tuple[Float, Float]:
        """Sum over the nodes for each band, as the `CostKind` says, and its gradient, in one pass.

        Parameters
        ----------
        shared : ndarray, shape (s,)
            Values of the shared parameters, in the order of `Model.parameters`.
        own : ndarray, shape (B, o)
            Values of the others for each of `bands`.
        epsilon : ndarray, shape (B,)
            Rounds the kinks of norms and roots, 1/sr.
        bands : slice
            Which of the table's; by default all.
        single : bool
            Compute in float32, with sums in float64: nearly twice as fast. A highlight a thousand times
            as bright as the rest is then uncertain by as much as the last ε of a search: good for
            its way, not for its end.

        Returns
        -------
        costs : ndarray, shape (B,)
            Unit: see `CostKind`.
        gradients : ndarray, shape (B, s + o)
            In the order of `Model.parameters`.
        """
        ...


class Model(Protocol):
    """A pBRDF in closed form."""

    @property
    def name(self) -> str:
        """Key in `pbrdf.models.MODELS`."""
        ...

    @property
    def m00(self) -> str:
        """How the table's M00, 1/sr, relates to the parameters: a formula in words, for reports."""
        ...

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The parameters of one band, the shared ones first."""
        ...

    def evaluate(self, to_light: ArrayLike, to_camera: ArrayLike, parameters: Mapping[str, float]) -> Float:
        """Mueller matrices of one band in the table frames.

        Parameters
        ----------
        to_light, to_camera : array_like, shapes that broadcast to (..., 3)
            Unit vectors L and V with z the surface normal.
        parameters : mapping
            A value for each of `parameters`.

        Returns
        -------
        ndarray, shape (..., 4, 4), float64
            1/sr, no cosine; zero where either direction is at or below the horizon.
        """
        ...

    def node_cost(
        self,
        to_light: Float,
        to_camera: Float,
        mueller: NDArray[np.float32],
        weight: NDArray[np.float32],
        kind: CostKind = CostKind.NORMS,
    ) -> NodeCost:
        """Cost against measured matrices.

        Parameters
        ----------
        to_light, to_camera : ndarray, shape (n, 3), float64
            Unit vectors above the horizon with z the normal.
        mueller : ndarray, shape (B, n, 4, 4), float32
            Bands, 1/sr; may hold NaN where the weight is zero.
        weight : ndarray, shape (B, n) or, for `CostKind.SQUARES`, (B, n, 4, 4), float32
            Weight of each node in the sum, or of each element.
        kind : CostKind
            What is summed.
        """
        ...
