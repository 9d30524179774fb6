"""How well a table determines the parameters of a fit: covariance and directions without effect.

A minimum of Σ_n ρ_n(θ) over independent nodes is an M-estimate. Its covariance is the sandwich

    A⁻¹ B A⁻¹,   A = Σ_n ∇∇ρ_n,   B = Σ_n ∇ρ_n ∇ρ_nᵀ

(Huber 1967; Stefanski and Boos 2002): the Hessian tells how far a pull moves the minimum, the nodes'
own gradients tell how strongly noise pulls, whatever its distribution. For inverse-variance weighted
squares of the right model and the right variances B = 2A, and 2 A⁻¹ remains, the textbook's result.

In A the second derivatives of the model are left out (Gauss, Newton): they stand beside residuals,
which are noise and average out. With residual r, s = √(‖r‖² + ε²) and Jacobian J of the sixteen
elements of a node:

    norms     ρ = w s            ∇ρ = w Jᵀr / s     ∇∇ρ = w (JᵀJ − Jᵀr rᵀJ / s²) / s
    squares   ρ = Σ w_e r_e²     ∇ρ = 2 JᵀW r       ∇∇ρ = 2 JᵀW J

The sum of roots has neither: its cusp is at every residual of zero, and the variance of its gradient
grows without limit as the cusp sharpens. Nothing is told for it.

Deviations told so are those of noise that differs from node to node. What the model cannot follow is
not in them, and neither is what neighbouring nodes have in common.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pbrdf.fitting.objective import Objective
from pbrdf.models.interface import CostKind

Float = NDArray[np.float64]

_STEP = 1e-5
"""Of the difference quotients, relative to a parameter: error 1e-10 of the curvature, 1e-11 of rounding."""
_CHUNK = 1 << 16
"""Nodes whose Jacobian is held in memory at once."""
_SINGULAR = 1e-10
"""Least eigenvalue, relative to the largest, of a Hessian with a unit diagonal that counts as not zero."""
_TAKES_PART = 0.1
"""Least component of a unit direction for a parameter to belong to it."""


@dataclass(frozen=True)
class Uncertainty:
    """What is known of the parameters' precision.

    Attributes
    ----------
    covariance : ndarray, shape (P, P), float64
        In the layout of `Objective`; NaN in rows and columns of parameters that are held by a bound,
        without effect, or part of a direction along which nothing changes, and everywhere if the
        cost tells none.
    without_effect : ndarray, shape (P,), bool
        Parameters whose change alters nothing at all.
    ambiguous : tuple of tuples of int
        Groups of parameters that can change together while nothing else does.
    """

    covariance: Float
    without_effect: NDArray[np.bool_]
    ambiguous: tuple[tuple[int, ...], ...]

    @property
    def standard_errors(self) -> Float:
        """Standard errors, shape (P,); NaN where none is told."""
        errors: Float = np.sqrt(np.diagonal(self.covariance))
        return errors


def estimate(objective: Objective, vector: Float, epsilon: float) -> Uncertainty:
    """Tell how well the nodes of an objective determine its parameters.

    Parameters
    ----------
    objective : Objective
        Of the fit.
    vector : ndarray, shape (P,)
        Where its search ended, with parameters on a bound exactly there.
    epsilon : float
        Of its cost, relative to the table's scale.
    """
    size = len(vector)
    covariance = np.full((size, size), np.nan)
    if objective.kind is CostKind.ROOTS:
        return Uncertainty(covariance, _without_effect(objective, vector), ())
    hessian, gradients = np.zeros((size, size)), np.zeros((size, size))
    for band in range(objective.bands):
        at = np.ix_(objective.band_entries(band), objective.band_entries(band))
        for part, total in zip(
            _band_sums(objective, vector, band, epsilon), (hessian, gradients), strict=True
        ):
            total[at] += part
    without_effect = np.diagonal(hessian) == 0
    free = np.flatnonzero((vector > objective.lower) & (vector < objective.upper) & ~without_effect)
    ambiguous, determined = _split(hessian[np.ix_(free, free)], free)
    if len(determined):
        inner = np.ix_(determined, determined)
        inverse = _inverse(hessian[inner])
        covariance[inner] = inverse @ gradients[inner] @ inverse
    return Uncertainty(covariance, without_effect, ambiguous)


def jacobian(objective: Objective, vector: Float, band: int, nodes: slice) -> Float:
    """Differentiate the model's matrices by the parameters of one band, shape (n, 16, parameters)."""
    parameters = objective.band_parameters(vector, band)
    light, camera = objective.nodes.to_light[nodes], objective.nodes.to_camera[nodes]
    columns = []
    for parameter in objective.model.parameters:
        value = parameters[parameter.name]
        # a model is linear in a weight: any step is right, and none leads below zero
        step = 1.0 if parameter.linear else _STEP * max(value, _STEP)
        below = 0.0 if parameter.linear else max(value - step, parameter.lower)
        above = 1.0 if parameter.linear else min(value + step, parameter.upper)
        upper, lower = (
            objective.model.evaluate(light, camera, parameters | {parameter.name: x}) for x in (above, below)
        )
        columns.append((upper - lower).reshape(-1, 16) / (above - below))
    return np.stack(columns, axis=-1)


def _band_sums(objective: Objective, vector: Float, band: int, epsilon: float) -> tuple[Float, Float]:
    """Contributions of one band to Hessian and sum of squared gradients."""
    count = len(objective.model.parameters)
    hessian, gradients = np.zeros((count, count)), np.zeros((count, count))
    used = objective.nodes.weight[band] > 0
    parameters = objective.band_parameters(vector, band)
    rounding = epsilon * float(objective.nodes.scale[band])
    for start in range(0, len(used), _CHUNK):
        nodes = slice(start, start + _CHUNK)
        at = used[nodes]
        model = objective.model.evaluate(
            objective.nodes.to_light[nodes], objective.nodes.to_camera[nodes], parameters
        )
        residual = (model - objective.nodes.mueller[band, nodes]).reshape(-1, 16)[at]
        slope = jacobian(objective, vector, band, nodes)[at]
        weight = objective.weight(band)[nodes][at].astype(np.float64)
        # einsum without `optimize`, not matrix products: the order of its sums is fixed
        if objective.kind is CostKind.SQUARES:
            weighted = 2.0 * weight.reshape(-1, 16, 1) * slope
            pull = np.einsum("nek,ne->nk", weighted, residual)
            hessian += np.einsum("nek,nel->kl", weighted, slope)
        else:
            length = np.sqrt(np.sum(residual**2, axis=1) + rounding**2)
            across = np.einsum("nek,ne->nk", slope, residual / length[:, None])
            pull = weight[:, None] * across
            share = weight / length
            hessian += np.einsum("nek,nel->kl", slope * share[:, None, None], slope)
            hessian -= np.einsum("nk,nl->kl", across * share[:, None], across)
        gradients += np.einsum("nk,nl->kl", pull, pull)
    return hessian, gradients


def _without_effect(objective: Objective, vector: Float) -> NDArray[np.bool_]:
    found = np.ones(len(vector), np.bool_)
    for band in range(objective.bands):
        slope = jacobian(objective, vector, band, slice(None))[objective.nodes.weight[band] > 0]
        entries = objective.band_entries(band)
        found[entries] &= ~np.any(slope != 0, axis=(0, 1))
    return found


def _unit_diagonal(hessian: Float) -> tuple[Float, Float]:
    scale = 1.0 / np.sqrt(np.diagonal(hessian))
    return hessian * scale[:, None] * scale, scale


def _inverse(hessian: Float) -> Float:
    scaled, scale = _unit_diagonal(hessian)
    return np.asarray(np.linalg.inv(scaled) * scale[:, None] * scale)


def _split(hessian: Float, free: NDArray[np.intp]) -> tuple[tuple[tuple[int, ...], ...], NDArray[np.intp]]:
    """Groups of parameters along whose directions the Hessian vanishes, and the parameters in none."""
    if not len(free):
        return (), free
    values, directions = np.linalg.eigh(_unit_diagonal(hessian)[0])
    flat = directions[:, values < _SINGULAR * values[-1]].T
    groups = tuple(tuple(int(p) for p in free[np.abs(one) > _TAKES_PART]) for one in flat)
    taken = {position for group in groups for position in group}
    return groups, np.array([p for p in free if p not in taken], dtype=np.intp)


def correlations(covariance: Float) -> Mapping[int, tuple[int, float]]:
    """For each parameter with a variance, the other that it is most correlated with, and how much."""
    errors = np.sqrt(np.diagonal(covariance))
    found = {}
    for position in np.flatnonzero(errors > 0):
        others = np.flatnonzero((errors > 0) & (np.arange(len(errors)) != position))
        if len(others):
            values = covariance[position, others] / (errors[position] * errors[others])
            strongest = int(np.abs(values).argmax())
            found[int(position)] = int(others[strongest]), float(values[strongest])
    return found
