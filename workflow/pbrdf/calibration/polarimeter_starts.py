"""Where the search for a polarimeter's parameters begins.

Air and mirrors are solved in closed form where the states allow it; for other references and lists
of states a grid over all zeros tells which valleys are deep.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pbrdf.calibration.air_harmonics import ClosedForm, closed_form
from pbrdf.calibration.polarimeter_signal import Elements, SignalModel, polarised_light

Float = NDArray[np.float64]

_AIR, _MIRROR = np.eye(4), np.diag([1.0, 1.0, -1.0, -1.0])
_KEPT = 8
_TURNS = 12
_RETARDANCES = np.deg2rad([60.0, 90.0, 120.0])
_POLARISERS, _RETARDERS = np.pi / 8 * np.arange(8), np.pi / 16 * np.arange(16)
"""Grids of zeros: the squared signal has periods of 45° in the axes of retarders, 90° in polarisers'."""


def find_starts(model: SignalModel, signal: Float) -> list[Float]:
    """Parameter vectors to search from.

    Parameters
    ----------
    model : SignalModel
    signal : ndarray, shape (R, B, N)

    Returns
    -------
    list of ndarray, each of the model's size
        One from a closed form where the frame is fixed, otherwise the best few of many.
    """
    solved = _from_air(model, signal)
    candidates = _grid(model, signal) if solved is None else _turned(model, solved)
    vectors = [_with_amplitudes(model, signal, candidate) for candidate in candidates]
    kept = 1 if solved is not None and not model.free_frame else _KEPT
    return sorted(vectors, key=lambda vector: _misfit(model, signal, vector))[:kept]


def _from_air(model: SignalModel, signal: Float) -> ClosedForm | None:
    """Elements from the first reference that is air or a mirror, in the model's frame."""
    for reference, seen in zip(model.references, signal, strict=True):
        for matrix, mirrored in ((_AIR, False), (_MIRROR, True)):
            if np.allclose(reference.mueller / reference.mueller[0, 0], matrix, atol=1e-9):
                solved = closed_form(model.states, seen, mirrored=mirrored)
                return None if solved is None else _turned_by(solved, model.frame, mirrored)
    return None


def _turned_by(solved: ClosedForm, angle: float, mirrored: bool) -> ClosedForm:
    """Turn everything by an angle as the reference allows: the analyser with air, against with a mirror."""
    other = -angle if mirrored else angle
    return ClosedForm(
        solved.zeros + np.array([angle, angle, other, other]),
        solved.generator_retardances,
        solved.analyser_retardances,
    )


def _turned(model: SignalModel, solved: ClosedForm) -> Iterator[ClosedForm]:
    """Both signs of s3 of a closed form, in every frame if the frame is free."""
    mirrored = not any(np.allclose(r.mueller / r.mueller[0, 0], _AIR, atol=1e-9) for r in model.references)
    exchanged = np.array([0.0, np.pi / 2, np.pi / 2, 0.0])
    for angle in np.pi / _TURNS * np.arange(_TURNS if model.free_frame else 1):
        turned = _turned_by(solved, angle, mirrored)
        yield turned
        yield ClosedForm(turned.zeros + exchanged, turned.generator_retardances, turned.analyser_retardances)


def _grid(model: SignalModel, signal: Float) -> Iterator[ClosedForm]:
    """Best nodes of a grid over the zeros, for a few retardances that all elements share."""
    matrices = np.stack([r.mueller for r in model.references])
    seen = (signal / np.abs(signal).mean(axis=-1, keepdims=True)).mean(axis=1)
    first = _POLARISERS if model.free_frame else np.array([model.frame])
    generators = np.stack(np.meshgrid(first, _RETARDERS, indexing="ij"), axis=-1).reshape(-1, 2)
    analysers = np.stack(np.meshgrid(_POLARISERS, _RETARDERS, indexing="ij"), axis=-1).reshape(-1, 2)
    found: list[tuple[float, ClosedForm]] = []
    for retardance in _RETARDANCES:
        g = _vectors(model.states[:, :2], generators, retardance)
        a = _vectors(model.states[:, :1:-1], analysers, retardance) * np.array([1.0, 1.0, 1.0, -1.0])
        misfits = np.sum([_misfits(a, m, g, y) for m, y in zip(matrices, seen, strict=True)], axis=0)
        for index in np.argsort(misfits, axis=None)[:_KEPT]:
            i, j = np.unravel_index(index, misfits.shape)
            zeros = np.concatenate([generators[j], analysers[i][::-1]])
            every = np.full(model.bands, retardance)
            found.append((float(misfits[i, j]), ClosedForm(zeros, every, every)))
    return (candidate for _, candidate in found)


def _vectors(readings: Float, zeros: Float, retardance: float) -> Float:
    """Stokes vectors behind polariser and retarder for every pair of zeros, shape (pairs, N, 4)."""
    delta, leak = np.array([retardance]), np.zeros(1)
    return np.stack(
        [polarised_light(readings[:, 0] + p, readings[:, 1] + r, delta, leak)[0][0] for p, r in zeros]
    )


def _misfits(a: Float, matrix: Float, g: Float, seen: Float) -> Float:
    """Squared misfit with the best amplitude for all pairs of analyser and generator."""
    analysed = a @ matrix
    with_seen = np.einsum("ank,n,gnk->ag", analysed, seen, g, optimize=True)
    squares = np.einsum(
        "ankl,gnkl->ag",
        analysed[..., :, None] * analysed[..., None, :],
        g[..., :, None] * g[..., None, :],
        optimize=True,
    )
    misfits: Float = seen @ seen - with_seen**2 / np.maximum(squares, np.finfo(float).tiny)
    return misfits


def _with_amplitudes(model: SignalModel, signal: Float, solved: ClosedForm) -> Float:
    """Parameter vector of a start, with the amplitudes that fit best."""
    shape = signal.shape[:2]
    elements = Elements(
        zeros=solved.zeros,
        generator_retardances=solved.generator_retardances,
        analyser_retardances=solved.analyser_retardances,
        extinctions=np.zeros(model.bands),
        amplitudes=np.ones(shape),
        drifts=np.zeros((*shape, model.lamp_freedom)),
    )
    unit = model.signal(elements)
    power = np.maximum((unit**2).sum(axis=-1), np.finfo(float).tiny)
    amplitudes = (unit * signal).sum(axis=-1) / power
    return model.pack(replace(elements, amplitudes=amplitudes))


def _misfit(model: SignalModel, signal: Float, vector: Float) -> float:
    scale = np.abs(signal).mean(axis=-1, keepdims=True)
    return float((((model.signal(model.unpack(vector)) - signal) / scale) ** 2).sum())
