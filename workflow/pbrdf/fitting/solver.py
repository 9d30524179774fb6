"""The search for the least cost: SLSQP from several starts, the kink of the norm sharpened in steps.

The gradient of a sum of norms, or of roots, jumps where a residual vanishes. Each search therefore
begins with norms rounded by an ε that makes it nearly a problem of least squares, and is repeated with
ever smaller ε from where it came to: the highlight is fitted first, then what lies around it. All but
the last of these steps are computed in single precision.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import nlopt
import numpy as np
from numpy.typing import NDArray

from pbrdf.fitting.objective import Objective
from pbrdf.fitting.starts import find_starts
from pbrdf.models.interface import CostKind

Float = NDArray[np.float64]
Function = Callable[[Float], tuple[float, Float]]

LAST_EPSILON = 1e-4
"""Relative to the table's scale, as in `Objective.cost`."""
_STEP_OF_EPSILON = 10.0
_STEPS = 200
"""Most evaluations of one search: what has not settled by then moves along a flat valley."""
_TOLERANCE = 1e-10
_ROUGH_TOLERANCE = 1e-7
"""While ε is still to fall, and costs come in single precision."""
_ON_BOUND = 1e-6
"""Distance from a bound, in the coordinates of the search, that it cannot tell from zero."""


@dataclass(frozen=True)
class Solution:
    """Where the search ended.

    Attributes
    ----------
    vector : ndarray
        Parameters, in the layout of `Objective`.
    costs : tuple of float
        Cost that each start came to, with the last ε.
    """

    vector: Float
    costs: tuple[float, ...]


def solve(objective: Objective, starts: int, seed: int) -> Solution:
    """Search from `starts` starts and keep the best; the same seed gives the same bytes."""
    return solve_from(objective, find_starts(objective, starts, seed))


def solve_from(objective: Objective, starts: Sequence[Float]) -> Solution:
    """Search from the given parameter vectors and keep the best."""
    ends = [_search(objective, start) for start in starts]
    vectors, costs = zip(*ends, strict=True)
    best = vectors[int(np.argmin(costs))]
    return Solution(best, tuple(costs))


def _search(objective: Objective, start: Float) -> tuple[Float, float]:
    coordinates = _Coordinates(objective, start)
    every = np.arange(len(start))
    vector = start
    for epsilon in _epsilons(objective):
        rough = epsilon > LAST_EPSILON
        cost = partial(objective.cost, epsilon=epsilon, single=rough)
        tolerance = _ROUGH_TOLERANCE if rough else _TOLERANCE
        vector = _descend(cost, vector, every, coordinates, tolerance)
    # A band that is dim beside the others hardly shows in the sum: with the shared parameters held,
    # each band is a problem of its own, in its own scale.
    for band in range(objective.bands):
        vector = _polish(objective, vector, band, coordinates)
    last = partial(objective.cost, epsilon=LAST_EPSILON)
    vector = coordinates.snapped(_descend(last, vector, every, coordinates))
    return vector, last(vector)[0]


def _epsilons(objective: Objective) -> list[float]:
    """Falling values of ε, the first a tenth of the root mean square of the peakiest band.

    Squares have no kink to round.
    """
    if objective.kind is CostKind.SQUARES:
        return [LAST_EPSILON]
    nodes = objective.nodes
    rms = np.sqrt(np.sum(nodes.weight * nodes.norms**2, axis=1) / nodes.weight.sum(axis=1))
    first = 0.1 * float(np.max(rms / nodes.scale))
    steps = max(int(np.ceil(np.log(first / LAST_EPSILON) / np.log(_STEP_OF_EPSILON))), 0)
    return [LAST_EPSILON * _STEP_OF_EPSILON**step for step in range(steps, -1, -1)]


def _polish(objective: Objective, vector: Float, band: int, coordinates: _Coordinates) -> Float:
    own = objective.band_entries(band)[len(objective.shared) :]
    cost = partial(objective.band_cost, epsilon=LAST_EPSILON, band=band)
    return _descend(cost, vector, own, coordinates)


class _Coordinates:
    """Coordinates in which a unit step means about the same for every parameter.

    Parameters with a positive lower bound go by their logarithm; weights in units of their start, or
    if that is (nearly) zero, of a thousandth of what a weight alone would need to be.
    """

    def __init__(self, objective: Objective, start: Float) -> None:
        self.logarithmic = objective.lower > 0
        self.unit = np.ones_like(start)
        self._bounds = objective.lower, objective.upper
        for band in range(objective.bands):
            entries = objective.band_entries(band)
            for entry, parameter in zip(entries, objective.model.parameters, strict=True):
                if parameter.linear:
                    alone = min(_weight_alone(objective, start, band, parameter.name), parameter.upper)
                    self.unit[entry] = max(start[entry], 1e-3 * alone)
        self.lower = self.inward(objective.lower)
        self.upper = self.inward(objective.upper)

    def inward(self, vector: Float) -> Float:
        """Coordinates of parameters."""
        logarithm = np.log(np.where(self.logarithmic, vector, 1.0))
        return np.where(self.logarithmic, logarithm, vector / self.unit)

    def outward(self, inner: Float) -> Float:
        """Parameters of coordinates."""
        exponential = np.exp(np.where(self.logarithmic, inner, 0.0))
        # exp(log(bound)) may lie beyond the bound by a rounding
        return np.clip(np.where(self.logarithmic, exponential, inner * self.unit), *self._bounds)

    def snapped(self, vector: Float) -> Float:
        """Put parameters that the search cannot tell from a bound onto it."""
        inner = self.inward(vector)
        on_lower, on_upper = inner - self.lower < _ON_BOUND, self.upper - inner < _ON_BOUND
        return np.where(on_lower, self._bounds[0], np.where(on_upper, self._bounds[1], vector))

    def slope(self, vector: Float) -> Float:
        """Differentiate the parameters by the coordinates."""
        return np.where(self.logarithmic, vector, self.unit)


def _weight_alone(objective: Objective, start: Float, band: int, name: str) -> float:
    nodes = objective.nodes
    linear = {p.name: float(p.name == name) for p in objective.own if p.linear}
    parameters = objective.band_parameters(start, band) | linear
    term = objective.model.evaluate(nodes.to_light, nodes.to_camera, parameters)
    typical = np.sqrt(np.average(np.sum(term**2, axis=(-2, -1)), weights=nodes.weight[band]))
    table = np.sqrt(np.average(nodes.norms[band] ** 2, weights=nodes.weight[band]))
    return float(table / typical) if typical > 0 else 1.0


def _descend(
    function: Function,
    vector: Float,
    free: NDArray[np.intp],
    coordinates: _Coordinates,
    tolerance: float = _TOLERANCE,
) -> Float:
    """SLSQP within the bounds over the entries `free`; the best vector that was looked at."""
    lower, upper = coordinates.lower[free], coordinates.upper[free]
    inner = coordinates.inward(vector)
    scale = function(vector)[0]
    best_value, best = scale, vector

    def outward(x: Float) -> Float:
        trial = inner.copy()
        trial[free] = x
        outer = vector.copy()
        outer[free] = coordinates.outward(trial)[free]
        return outer

    def value_and_slope(x: Float, gradient: Float) -> float:
        nonlocal best_value, best
        trial = outward(x)
        value, slope = function(trial)
        if gradient.size:
            gradient[:] = (slope * coordinates.slope(trial))[free] / scale
        if value < best_value:
            best_value, best = value, trial
        return value / scale

    search = nlopt.opt(nlopt.LD_SLSQP, len(free))
    search.set_lower_bounds(lower)
    search.set_upper_bounds(upper)
    search.set_min_objective(value_and_slope)
    search.set_ftol_rel(tolerance)
    search.set_xtol_rel(tolerance)
    search.set_maxeval(_STEPS)
    try:
        search.optimize(np.clip(inner[free], lower, upper))
    except (nlopt.RoundoffLimited, nlopt.runtime_error):
        # The ordinary ends at a kink: no step is small enough to descend further, or the quadratic
        # model of the valley has become singular. What was reached counts.
        return best
    return best
