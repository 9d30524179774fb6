"""Whether a measured polarimeter can be used, and what its residual points at.

Each suspect says how the signal would change; the one whose changes explain most of the residual
is named (Rao's score test of what the model leaves out).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, fdtrc

from pbrdf.calibration.polarimeter import ELEMENTS
from pbrdf.calibration.polarimeter_fit import PolarimeterFit, fit_polarimeter
from pbrdf.calibration.polarimeter_signal import SignalModel
from pbrdf.errors import InputError

Float = NDArray[np.float64]

_CHANCE = 1e-3
"""Chance by noise alone below which a residual, or a suspect, counts as real."""

_EXPLAINED = 0.5
"""Share of the residual's squares that a suspect must explain to be named."""

_FAR, _FAR_RELATIVE = 10.0, 0.01
"""Residual in units of the noise, and of the signal, from which both together make it unusable."""

_WIDE = 3.0
"""Deviations that noise seldom makes."""

_UNUSABLE_RELATIVE, _POOR_RELATIVE = 0.10, 0.02
"""Residual relative to the mean signal. A tenth leaves errors of about 0.05 in elements of a
normalised matrix, more than most materials' own."""

_UNKNOWN_DEG, _VAGUE_DEG = 3.0, 1.0
"""Standard errors of an angle: a degree of retardance changes elements of a normalised matrix by 0.0175,
three by as much as the largest residual that is borne."""

_WEAK = "the modulation is not what pure elements make: take the background off, or fit the extinction"
"""From air alone, light that leaks or is depolarised looks like a constant background."""

_ROUNDING = 1e-9
"""Relative residual that numbers computed without noise leave: no suspect is looked for in it."""

_BACKWARDS = 0.1
"""Fall of χ² that shows that a scale counts the other way."""


@dataclass(frozen=True)
class Verdict:
    """A judgement in words.

    Attributes
    ----------
    usable : bool
    words : str
        One line that begins with good, fair, poor or unusable.
    """

    usable: bool
    words: str


def judge(fit: PolarimeterFit, bands_nm: list[int]) -> Verdict:
    """Judge a fit by its worst band."""
    relative = fit.residual_rms / fit.signal.mean(axis=-1)
    times_noise = np.sqrt(((fit.residual / fit.noise) ** 2).sum(axis=(0, 2)) * fit.model.bands / fit.freedom)
    band = int(np.argmax(times_noise if fit.noise_known else relative.max(axis=0)))
    worst, ratio = float(relative.max()), float(times_noise[band])
    uncertain, name = _least_certain(fit, bands_nm)
    beyond_noise = fit.noise_known and chdtrc(fit.freedom, fit.chi_square) < _CHANCE
    told = f"residual {100 * worst:.2g} % of the signal"
    if fit.noise_known:
        told += f", at {bands_nm[band]} nm {ratio:.1f} times the noise"
    far = beyond_noise and ratio > _FAR and worst > _FAR_RELATIVE
    if worst > _UNUSABLE_RELATIVE or far:
        return Verdict(False, f"unusable: {told}; {_backwards(fit) or _cause(fit) or 'check the states'}")
    if uncertain > _UNKNOWN_DEG:
        return Verdict(False, f"unusable: {name} is known to {uncertain:.2g}° only; take more states")
    suspicious = beyond_noise if fit.noise_known else worst > _ROUNDING
    cause = _cause(fit) if suspicious else None
    if (fit.elements.extinctions < -_WIDE * fit.standard_errors.extinctions).any():
        cause = "the extinction comes out below zero and counts as 0: too much background is taken off"
    if uncertain > _VAGUE_DEG:
        told += f", {name} is known to {uncertain:.2g}° only"
    if uncertain > _VAGUE_DEG or worst > _POOR_RELATIVE or (beyond_noise and ratio > _WIDE):
        level = "poor"
    else:
        level = "fair" if beyond_noise or cause else "good"
    return Verdict(True, f"{level}: {told}" + (f"; {cause}" if cause else ""))


def _least_certain(fit: PolarimeterFit, bands_nm: list[int]) -> tuple[float, str]:
    """Largest standard error of a zero or retardance, degrees, and whose it is."""
    errors = fit.standard_errors
    named = [
        (error, f"the zero of the {e.replace('_', ' ')}")
        for e, error in zip(ELEMENTS, errors.zeros, strict=True)
    ]
    for module, values in (
        ("generator", errors.generator_retardances),
        ("analyser", errors.analyser_retardances),
    ):
        named += [
            (error, f"the {module}'s retardance at {nm} nm")
            for nm, error in zip(bands_nm, values, strict=True)
        ]
    error, name = max(named, key=lambda pair: pair[0])
    return float(np.rad2deg(error)), name


def _cause(fit: PolarimeterFit) -> str | None:
    """Name the suspect that explains most of the residual, if one does."""
    residual = (fit.residual / fit.noise).ravel()
    square = float(residual @ residual)
    jacobian = (fit.model.jacobian(fit.elements) / fit.noise[..., None]).reshape(len(residual), -1)
    known = np.linalg.qr(jacobian / np.linalg.norm(jacobian, axis=0))[0]
    best, words = _EXPLAINED, None
    for suspicion, columns in _suspects(fit):
        changes = columns.reshape(len(residual), -1) / fit.noise.reshape(-1, 1)
        left = changes - known @ (known.T @ changes)
        basis = _basis(left, np.linalg.norm(changes, axis=0).max())
        count = basis.shape[1]
        rest = fit.freedom - count
        if count == 0 or rest < 1:
            continue
        explained = float(((basis.T @ residual) ** 2).sum()) / square
        chance = fdtrc(count, rest, explained / count / (max(1.0 - explained, _ROUNDING) / rest))
        adjusted = explained - (1.0 - explained) * count / rest
        if chance < _CHANCE and adjusted > best:
            best, words = adjusted, suspicion
    return words


def _suspects(fit: PolarimeterFit) -> list[tuple[str, Float]]:
    """What may be wrong, and how the signals (R, B, N) would change, on the last axis."""
    model, predicted = fit.model, fit.signal - fit.residual
    cells, bands = _each(len(model.references) * model.bands, predicted.shape), _each_band(predicted.shape)
    time = np.linspace(-0.5, 0.5, len(model.states))
    suspects = []
    for index, name in enumerate(ELEMENTS):
        angle = model.states[:, index]
        if np.ptp(angle) > 0:
            once = np.stack([np.cos(angle), np.sin(angle), np.cos(2 * angle), np.sin(2 * angle)], axis=-1)
            turning = f"the residual turns with the {name.replace('_', ' ')}"
            words = f"{turning}: check its mount for tilt, wedge and dust"
            suspects.append((words, predicted[..., None] * once))
    beyond = time ** (model.lamp_freedom + 1)
    suspects.append((_drift_words(model), (predicted * beyond)[..., None] * cells))
    if not model.extinction:
        suspects.append((_WEAK, _leak(fit)))
    if model.bands > 1:
        zeros = model.jacobian(fit.elements)[..., model.parts["zeros"]]
        for name, change in (("generator", zeros[..., -3]), ("analyser", zeros[..., -2])):
            words = f"the axis of the {name}'s retarder turns with the wavelength"
            suspects.append((words, change[..., None] * bands))
    worst = int(((fit.residual / fit.noise) ** 2).sum(axis=(0, 1)).argmax())
    one = np.zeros(predicted.shape)
    one[..., worst] = 1.0
    suspects.append((f"state {worst} of the list stands out: take it again", one[..., None] * cells))
    return suspects


def _drift_words(model: SignalModel) -> str:
    """What is said of a lamp whose power moves in another way than the model lets it."""
    if model.drift is True:
        return "the lamp does not drift evenly: repeat a state within the run, or let it warm up"
    if model.drift:
        return "the lamp drifts faster than its state is repeated: repeat it more often, or let it warm up"
    return "the lamp drifts: fit the drift, or let it warm up"


def _each(count: int, shape: tuple[int, ...]) -> Float:
    """Columns (R, B, N, R·B) that are 1 in one cell each."""
    columns = np.zeros((count, shape[-1], count))
    columns[np.arange(count), :, np.arange(count)] = 1.0
    return columns.reshape(*shape, count)


def _each_band(shape: tuple[int, ...]) -> Float:
    """Columns (R, B, N, B) that are 1 in one band each."""
    columns = np.zeros((*shape, shape[1]))
    for band in range(shape[1]):
        columns[:, band, :, band] = 1.0
    return columns


def _leak(fit: PolarimeterFit) -> Float:
    """Change of the signals with the extinction of each band, shape (R, B, N, B)."""
    model = fit.model
    leaking = SignalModel(
        model.states,
        model.references,
        model.bands,
        free_frame=model.free_frame,
        frame=model.frame,
        extinction=True,
        drift=model.drift,
    )
    return leaking.jacobian(fit.elements)[..., leaking.parts["extinctions"]]


def _basis(columns: Float, scale: float) -> Float:
    """Orthonormal basis of what is left of the columns after the parameters took their part."""
    left, strength, _ = np.linalg.svd(columns, full_matrices=False)
    basis: Float = left[:, strength > 1e-6 * scale]
    return basis


def _backwards(fit: PolarimeterFit) -> str | None:
    """Name the scale that counts the other way, if the signal fits so."""
    for index, name in enumerate(ELEMENTS):
        if np.ptp(fit.model.states[:, index]) == 0:
            continue
        states = fit.model.states.copy()
        states[:, index] *= -1.0
        try:
            other = fit_polarimeter(np.rad2deg(states), fit.signal, fit.model.references, noise=fit.noise)
        except InputError:
            continue
        if other.chi_square < _BACKWARDS * fit.chi_square:
            return f"it fits where the scale of the {name.replace('_', ' ')} counts the other way"
    return None
