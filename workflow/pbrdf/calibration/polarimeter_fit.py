"""Zeros, retardances and amplitudes of a polarimeter from its signals of known references.

Levenberg-Marquardt over all bands and references together, on residuals weighted by their noise,
from a closed form where there is one. The axes are shared by all bands, since the retarders are
achromatic; the amplitude of each reference in each band is free.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares
from scipy.special import chdtrc

from pbrdf.calibration.polarimeter_ambiguity import (
    Ambiguity,
    Exchange,
    exchanges,
    frame_rotation,
    free_turn,
    s3_sign,
    scale_sense,
)
from pbrdf.calibration.polarimeter_signal import (
    Amplitude,
    Drift,
    Elements,
    Reference,
    SignalModel,
    checked_references,
)
from pbrdf.calibration.polarimeter_starts import find_starts
from pbrdf.errors import InputError
from pbrdf.optics.polarimeter import Polarimeter

Float = NDArray[np.float64]

_TOLERANCE = 1e-12
_SINGULAR = 1e-7
"""Smallest singular value of the Jacobian with columns of length 1: below, a parameter is not determined."""

_TOLD_APART = 25.0
"""Rise of χ² (five standard deviations) from which one of two solutions is ruled out."""

_EVALUATIONS, _TRIAL = 1000, 40
"""Most evaluations of a search, and of one that only asks whether an exchange is as good: from there
a true solution is reached in ten, and anything else wanders."""

_CHANCE = 1e-3
"""Chance of a χ² by noise alone below which the standard errors are widened to the residual."""

_FLOOR = 1e-12
"""Least noise relative to the mean signal: numbers computed without noise have rounding only."""


class _Solution(NamedTuple):
    """Where a search ended: parameter vector and χ²."""

    vector: Float
    square: float
    converged: bool


@dataclass(frozen=True)
class PolarimeterFit:
    """A polarimeter as its references show it.

    Attributes
    ----------
    model : SignalModel
        States, references and which parameters are free.
    elements, standard_errors : Elements
        Values and their standard errors; radians, those of parameters that are not free are 0.
    covariance : ndarray, shape (parameters, parameters)
        In the order of the model's parameter vector.
    signal, residual : ndarray, shape (R, B, N)
        What was seen, and that minus the prediction; in the signal's unit.
    noise : ndarray, shape (R, B, N)
        Standard deviation that each signal was weighted by.
    noise_known : bool
        It was given; otherwise it is the residual's own.
    chi_square : float
        Sum of (residual / noise)².
    freedom : int
        Number of signals less that of parameters.
    frame_rotation, s3_sign, scale_sense : Ambiguity
        What the references tell of the frames, and what had to be assumed.
    """

    model: SignalModel
    elements: Elements
    standard_errors: Elements
    covariance: Float
    signal: Float
    residual: Float
    noise: Float
    noise_known: bool
    chi_square: float
    freedom: int
    frame_rotation: Ambiguity
    s3_sign: Ambiguity
    scale_sense: Ambiguity

    @property
    def residual_rms(self) -> Float:
        """Root mean square of the residual over the states, shape (R, B)."""
        rms: Float = np.sqrt((self.residual**2).mean(axis=-1))
        return rms

    def polarimeters(self) -> list[Polarimeter]:
        """Polarimeter of each band; a negative extinction, which only noise can give, counts as 0."""
        first, second, third, fourth = self.elements.zeros.tolist()
        e = self.elements
        return [
            Polarimeter(float(g), float(a), (first, second, third, fourth), max(float(leak), 0.0))
            for g, a, leak in zip(e.generator_retardances, e.analyser_retardances, e.extinctions, strict=True)
        ]


def fit_polarimeter(
    states_deg: ArrayLike,
    signal: ArrayLike,
    references: Sequence[Reference],
    *,
    noise: ArrayLike | None = None,
    intended_zeros_deg: Sequence[float] = (0.0, 0.0, 0.0, 0.0),
    extinction: bool = False,
    drift: Drift = False,
    amplitude: Amplitude = "free",
    source: str = "polarimeter targets",
) -> PolarimeterFit:
    """Fit a polarimeter to its signals of known references.

    Parameters
    ----------
    states_deg : array_like, shape (N, 4)
        Scale readings of generator polariser, generator retarder, analyser retarder and analyser
        polariser, degrees, in the order of the run.
    signal : array_like, shape (R, B, N)
        Of each reference in each band, in any unit; the background is taken off already.
    references : sequence of Reference, length R
    noise : array_like, shape (R, B, N), optional
        Standard deviation of each signal; without it that of the residual counts.
    intended_zeros_deg : sequence of four float
        Zeros as the rig was set up: the generator polariser's is kept where no reference tells it,
        and among solutions that look the same the nearest to these is taken.
    extinction : bool
        Fit a common extinction of both polarisers in each band.
    drift : bool or tuple of int
        Fit the lamp's drift during each reference in each band: linear, or a spline through places of
        the run (`pbrdf.calibration.polarimeter_signal.lamp_functions`).
    amplitude : {"free", "maximum"}
        "maximum" scales the prediction to the largest signal instead of fitting its amplitude:
        it rests on one frame and biases the retardances, and is there to compare with others.
    source : str
        What messages call the input.

    Raises
    ------
    InputError
        If an array has another shape, a signal or its noise is not finite, the states are too few
        or do not determine every parameter, or the search does not converge.
    """
    checked_references(references, source)
    states, seen, weights = _checked(states_deg, signal, noise, len(references), source)
    turn = free_turn(references, source)
    model = SignalModel(
        states,
        references,
        seen.shape[1],
        free_frame=turn is None,
        frame=float(np.deg2rad(intended_zeros_deg[0])),
        extinction=extinction,
        drift=drift,
        peaks=seen.max(axis=-1) if amplitude == "maximum" else None,
    )
    freedom = seen.size - model.size
    if freedom < 1:
        problem = f"are {len(states)}, which give {seen.size} signals for {model.size} parameters"
        raise InputError(source, "states", problem, "take more states, or fit fewer parameters")

    scale = np.abs(seen).mean(axis=-1, keepdims=True)
    sigma = np.broadcast_to(scale, seen.shape) if weights is None else weights
    found = [_search(model, seen, sigma, start, _EVALUATIONS) for start in find_starts(model, seen)]
    best = min(found, key=lambda solution: solution.square)
    if weights is None:
        residual = seen - model.signal(model.unpack(best.vector))
        rms = np.sqrt((residual**2).sum(axis=-1, keepdims=True) * residual.size / freedom / len(states))
        sigma = np.broadcast_to(np.maximum(rms, _FLOOR * scale), seen.shape)
        best = _search(model, seen, sigma, best.vector, _EVALUATIONS)
    if not best.converged:
        raise InputError(source, "signal", "lets the search for the elements run on", "check the states")
    best, still_open = _choose(model, seen, sigma, best, np.deg2rad(intended_zeros_deg))
    covariance = _covariance(model, sigma, best.vector, source)
    if chdtrc(freedom, best.square) < _CHANCE:
        covariance = covariance * (best.square / freedom)
    elements = model.unpack(best.vector)
    return PolarimeterFit(
        model=model,
        elements=elements,
        standard_errors=model.split(np.sqrt(np.diag(covariance)), frame=0.0, amplitude=0.0),
        covariance=covariance,
        signal=seen,
        residual=seen - model.signal(elements),
        noise=np.array(sigma),
        noise_known=weights is not None,
        chi_square=best.square,
        freedom=freedom,
        frame_rotation=frame_rotation(references, turn, still_open, float(intended_zeros_deg[0])),
        s3_sign=s3_sign(references, still_open),
        scale_sense=scale_sense(references),
    )


def _checked(
    states_deg: ArrayLike, signal: ArrayLike, noise: ArrayLike | None, references: int, source: str
) -> tuple[Float, Float, Float | None]:
    """States in radians, signals and their noise, or `InputError`."""
    states = np.deg2rad(np.asarray(states_deg, dtype=np.float64))
    seen = np.asarray(signal, dtype=np.float64)
    if states.ndim != 2 or states.shape[1] != 4 or not np.isfinite(states).all():
        raise InputError(source, "states_deg", f"has shape {states.shape}", "give N × 4 finite angles")
    if seen.ndim != 3 or seen.shape[0] != references or seen.shape[2] != len(states) or not seen.size:
        problem = f"has shape {seen.shape} for {references} references and {len(states)} states"
        raise InputError(source, "signal", problem, "give an array (references, bands, states)")
    if not np.isfinite(seen).all():
        reference, band, state = np.argwhere(~np.isfinite(seen))[0]
        problem = f"is not finite at reference {reference}, band {band}, state {state}"
        raise InputError(source, "signal", problem, "take that frame again, or leave the state out")
    if (seen.mean(axis=-1) <= 0).any():
        reference, band = np.argwhere(seen.mean(axis=-1) <= 0)[0]
        problem = f"is dark at reference {reference}, band {band}"
        raise InputError(source, "signal", problem, "check lamp, shutter and exposure")
    if noise is None:
        return states, seen, None
    sigma = np.asarray(noise, dtype=np.float64)
    if sigma.shape != seen.shape or not np.isfinite(sigma).all() or (sigma <= 0).any():
        raise InputError(source, "noise", "is not a deviation above zero a signal", "give the signal's shape")
    return states, seen, sigma


def _search(model: SignalModel, seen: Float, sigma: Float, start: Float, evaluations: int) -> _Solution:
    """Least squares from a start, after at most so many evaluations."""

    def residual(vector: Float) -> Float:
        return ((model.signal(model.unpack(vector)) - seen) / sigma).ravel()

    def jacobian(vector: Float) -> Float:
        return (model.jacobian(model.unpack(vector)) / sigma[..., None]).reshape(-1, model.size)

    result = least_squares(
        residual,
        start,
        jac=jacobian,
        method="lm",
        x_scale="jac",
        ftol=_TOLERANCE,
        xtol=_TOLERANCE,
        gtol=_TOLERANCE,
        max_nfev=evaluations,
    )
    vector = _retardances_made_positive(model, result.x)
    return _Solution(vector, float(2.0 * result.cost), converged=result.status > 0)


def _retardances_made_positive(model: SignalModel, vector: Float) -> Float:
    """Write a retarder of negative retardance as the same one with its axes exchanged."""
    elements = model.unpack(vector)
    zeros = elements.zeros.copy()
    changed = []
    for index, retardances in ((1, elements.generator_retardances), (2, elements.analyser_retardances)):
        wrapped = (retardances + np.pi) % (2 * np.pi) - np.pi
        if np.median(wrapped) < 0:
            wrapped = -wrapped
            zeros[index] += np.pi / 2
        changed.append(wrapped)
    return model.pack(
        replace(elements, zeros=zeros, generator_retardances=changed[0], analyser_retardances=changed[1])
    )


def _choose(
    model: SignalModel, seen: Float, sigma: Float, best: _Solution, intended: Float
) -> tuple[_Solution, list[Exchange]]:
    """Of all solutions that the references do not tell apart, the one nearest to the intended zeros."""
    solutions, still_open = [best], []
    elements = model.unpack(best.vector)
    for exchange in exchanges(free_frame=model.free_frame):
        aimed = exchange.apply(elements.zeros)
        other = best._replace(vector=model.pack(replace(elements, zeros=aimed)))
        if not exchange.leaves(model.references):
            other = _search(model, seen, sigma, other.vector, _TRIAL)
            astray = np.abs(_within_quarter(model.unpack(other.vector).zeros - aimed)).max() > np.pi / 4
            if astray or other.square - best.square > _TOLD_APART:
                continue
        solutions.append(other)
        still_open.append(exchange)

    def distance(solution: _Solution) -> float:
        off = _within_quarter(model.unpack(solution.vector).zeros - intended)
        return float(off @ off)

    nearest = min(solutions, key=distance)
    elements = model.unpack(nearest.vector)
    zeros = intended + _within_quarter(elements.zeros - intended)
    return nearest._replace(vector=model.pack(replace(elements, zeros=zeros))), still_open


def _within_quarter(angle: Float) -> Float:
    """Axes' angles between −90° and 90°."""
    wrapped: Float = (angle + np.pi / 2) % np.pi - np.pi / 2
    return wrapped


def _covariance(model: SignalModel, sigma: Float, vector: Float, source: str) -> Float:
    """Inverse of the information matrix; raises `InputError` where a parameter is not determined."""
    jacobian = (model.jacobian(model.unpack(vector)) / sigma[..., None]).reshape(-1, model.size)
    length = np.linalg.norm(jacobian, axis=0)
    length = np.where(length > 0, length, 1.0)
    _, strength, directions = np.linalg.svd(jacobian / length, full_matrices=False)
    if strength[-1] < _SINGULAR * strength[0]:
        names = [name for part in model.parts for name in model.of_parameters(part)]
        largest = np.argsort(-np.abs(directions[-1]))[:3]
        concerned = dict.fromkeys(names[i] for i in largest if abs(directions[-1][i]) > 0.1)
        raise InputError(
            source, "states", f"do not determine {', '.join(concerned)}", "take other or more states"
        )
    inverse = directions / strength[:, None]
    covariance: Float = inverse.T @ inverse / np.outer(length, length)
    return covariance
