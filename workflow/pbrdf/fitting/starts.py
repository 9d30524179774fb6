"""Where a search begins: the linear parameters solved for, the others from a grid.

For given roughness and index the model is linear in its two weights (variable projection, Golub &
Pereyra 1973), so that a coarse grid over the others tells which valley is the deepest.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from pbrdf.fitting.objective import Objective

Float = NDArray[np.float64]

_SUBSET = 4096
"""Nodes that a start is judged by: enough to tell valleys apart, few enough for a thousand trials."""

_ROUNDED = 1e-1
"""ε of the cost by which starts are compared, relative to the table's scale."""


def find_starts(objective: Objective, count: int, seed: int) -> list[Float]:
    """Parameter vectors to start from, the best of the grid first.

    Those after the first keep the weights and indices of other grid values of the shared
    parameters, drawn with odds that fall with their rank and shifted a little.

    Parameters
    ----------
    objective : Objective
        Of the whole fit.
    count : int
        How many.
    seed : int
        Of the nodes looked at and of the draw.

    Returns
    -------
    list of ndarray, each of the length of the objective's vector
    """
    random = np.random.default_rng(seed)
    nodes = objective.nodes
    if len(nodes.indices) > _SUBSET:
        nodes = nodes.subset(np.sort(random.choice(len(nodes.indices), _SUBSET, replace=False)))
    coarse = Objective(objective.model, nodes, objective.kind)
    ranked = _rank_grid(coarse)
    starts = [ranked[0]]
    odds = 0.5 ** np.arange(1, len(ranked))
    while len(starts) < count:
        drawn = ranked[1 + random.choice(len(odds), p=odds / odds.sum())] if len(odds) else ranked[0]
        free = _nonlinear(objective)
        shifted = np.where(free, drawn * random.uniform(0.9, 1.1, len(drawn)), drawn)
        starts.append(np.clip(shifted, objective.lower, objective.upper))
    return starts


def _nonlinear(objective: Objective) -> NDArray[np.bool_]:
    own = [not p.linear for p in objective.own]
    return np.array([not p.linear for p in objective.shared] + own * objective.bands)


def _rank_grid(coarse: Objective) -> list[Float]:
    """Best vector for each grid value of the shared parameters, by ascending cost."""
    candidates: list[tuple[float, Float]] = []
    first = len(coarse.shared)
    for shared in product(*(p.start for p in coarse.shared)):
        best_cost = np.full(coarse.bands, np.inf)
        best = np.clip(np.zeros_like(coarse.lower), coarse.lower, coarse.upper)
        best[:first] = shared
        own_of_best = best[first:].reshape(coarse.bands, -1)
        for own in product(*(p.start for p in coarse.own if not p.linear)):
            trial = np.array([_own_values(coarse, own, w) for w in _solve_weights(coarse, shared, own)])
            costs, _ = coarse.costs(np.concatenate([shared, trial.ravel()]), _ROUNDED)
            better = costs < best_cost
            own_of_best[better], best_cost[better] = trial[better], costs[better]
        candidates.append((float(best_cost.sum()), best))
    candidates.sort(key=lambda candidate: candidate[0])
    return [vector for _, vector in candidates]


def _own_values(coarse: Objective, nonlinear: tuple[float, ...], linear: Float) -> list[float]:
    remaining, weights = iter(nonlinear), iter(linear)
    return [
        float(np.clip(next(weights) if p.linear else next(remaining), p.lower, p.upper)) for p in coarse.own
    ]


def _solve_weights(coarse: Objective, shared: tuple[float, ...], own: tuple[float, ...]) -> Float:
    """Weights of the two linear terms in every band, shape (B, 2), by least squares, none negative.

    Each node counts by the inverse of its norm: a first step toward the sum of norms, in which a
    highlight does not outweigh everything else.
    """
    fixed = iter(own)
    values = dict(zip((p.name for p in coarse.shared), shared, strict=True))
    values |= {p.name: next(fixed) for p in coarse.own if not p.linear}
    linear = [p.name for p in coarse.own if p.linear]
    nodes = coarse.nodes
    first, second = (
        coarse.model.evaluate(
            nodes.to_light, nodes.to_camera, values | {name: float(name == one) for name in linear}
        ).reshape(-1, 16)
        for one in linear
    )
    weight = nodes.weight / (nodes.norms + _ROUNDED * nodes.scale[:, None])
    table = nodes.mueller.reshape(coarse.bands, -1, 16)
    # einsum, not a matrix product: that one's order of summation depends on the number of threads
    aa, ab, bb = (
        np.einsum("bn,n->b", weight, np.einsum("ne,ne->n", x, y))
        for x, y in ((first, first), (first, second), (second, second))
    )
    at, bt = (np.einsum("bn,bn->b", weight, np.einsum("ne,bne->bn", term, table)) for term in (first, second))
    return _nonnegative_pairs(aa, ab, bb, at, bt)


def _nonnegative_pairs(aa: Float, ab: Float, bb: Float, at: Float, bt: Float) -> Float:
    """Minimum of the quadratic form with Gram matrix [[aa, ab], [ab, bb]] over the first quadrant.

    If the free minimum lies outside, the answer lies on an axis: the one that lowers the form more.
    """

    def quotient(a: Float, b: Float) -> Float:
        return np.divide(a, b, out=np.zeros_like(a), where=b > 0)

    determinant = aa * bb - ab * ab
    determinant = np.where(determinant > 1e-12 * aa * bb, determinant, 0.0)
    x, y = quotient(at * bb - bt * ab, determinant), quotient(bt * aa - at * ab, determinant)
    x_alone, y_alone = np.maximum(quotient(at, aa), 0.0), np.maximum(quotient(bt, bb), 0.0)
    inside = (determinant > 0) & (x >= 0) & (y >= 0)
    on_x = x_alone * at >= y_alone * bt
    return np.stack(
        [
            np.where(inside, x, np.where(on_x, x_alone, 0.0)),
            np.where(inside, y, np.where(on_x, 0.0, y_alone)),
        ],
        axis=-1,
    )
