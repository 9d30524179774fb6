"""Retardances and zeros of a polarimeter in closed form, from its signal of air or of a mirror.

Between ideal elements air gives a constant and five or six waves in combinations of the four
scales (Azzam 1978; Chenault et al. 1992). Their complex amplitudes follow by linear least squares
from any list of states that tells them apart, and the unknowns from ratios and phases of these.
A mirror is air seen with the analyser's angles counted backwards.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

_WAVES = np.array(
    [
        [-2.0, 4.0, 0.0, -2.0],
        [-2.0, 0.0, 4.0, -2.0],
        [2.0, -4.0, 4.0, -2.0],
        [-2.0, 2.0, -2.0, 2.0],
        [-2.0, 2.0, 2.0, -2.0],
        [-2.0, 0.0, 0.0, 2.0],
    ]
)
"""Multiples of generator polariser, generator retarder, analyser retarder and analyser polariser in
each wave: of the generator's retarder, of the analyser's, of both by four, of their difference and
sum by two, and of the two polarisers. The last is part of the constant where these stand still."""

_CONDITION = 1e3
"""Largest condition of the least squares of the waves: above, noise would grow more than a start bears."""


@dataclass(frozen=True)
class ClosedForm:
    """Polarimeter in the frame of its generator's polariser, which stands at scale zero along x.

    Attributes
    ----------
    zeros : ndarray, shape (4,)
        Generator polariser (0), generator retarder, analyser retarder, analyser polariser; radians.
        Both retarders 90° further would give the same signal.
    generator_retardances, analyser_retardances : ndarray, shape (B,)
        Radians, between 0 and π.
    """

    zeros: Float
    generator_retardances: Float
    analyser_retardances: Float


def closed_form(states: Float, signal: Float, *, mirrored: bool = False) -> ClosedForm | None:
    """Solve for the elements from the waves in a signal.

    Parameters
    ----------
    states : ndarray, shape (N, 4)
        Scale readings, radians.
    signal : ndarray, shape (B, N)
        Of air, or of a mirror, in each band; the zeros are shared by all bands.
    mirrored : bool
        The reference is a mirror, diag(1, 1, −1, −1).

    Returns
    -------
    ClosedForm or None
        None where the list of states does not tell the waves apart.
    """
    sense = np.array([1.0, 1.0, -1.0, -1.0]) if mirrored else np.ones(4)
    amplitudes = _wave_amplitudes(states * sense, signal)
    if amplitudes is None:
        return None
    by_generator, by_analyser, by_both = np.abs(amplitudes[:3])
    zeros = _zeros(amplitudes.sum(axis=1))
    return ClosedForm(
        zeros * sense,
        2.0 * np.arctan2(np.sqrt(by_both), np.sqrt(by_analyser)),
        2.0 * np.arctan2(np.sqrt(by_both), np.sqrt(by_generator)),
    )


def _wave_amplitudes(states: Float, signal: Float) -> Complex | None:
    """Complex amplitudes C of ``Re C exp(i wave)``, shape (5, B)."""
    phases = _WAVES @ states.T
    still = np.abs(np.exp(1j * (phases[-1] - phases[-1, 0])) - 1.0).max() < 1e-9
    phases = phases[:5] if still else phases
    design = np.concatenate([np.ones((1, len(states))), np.cos(phases), -np.sin(phases)]).T
    if len(design) < design.shape[1] or np.linalg.cond(design) > _CONDITION:
        return None
    solved = np.linalg.lstsq(design, signal.T, rcond=None)[0]
    real, imaginary = np.split(solved[1:], 2)
    amplitudes: Complex = (real + 1j * imaginary)[:5]
    return amplitudes


def _zeros(amplitudes: Complex) -> Float:
    """Zeros from the phases of the five waves, which all bands share."""
    generator, analyser, both = np.angle(amplitudes[:3])
    doubled = -(generator + both - analyser)
    first, second, polariser = (generator + doubled) / 4, (analyser + doubled) / 4, doubled / 2
    difference = np.exp(1j * (2 * first - 2 * second + 2 * polariser))
    total = np.exp(1j * (2 * first + 2 * second - 2 * polariser))
    # the quarter turns left open by the first three phases: the signs of the other two waves tell
    agreement = (amplitudes[4] * np.conj(total) - amplitudes[3] * np.conj(difference)).real
    return np.array([0.0, first + (np.pi / 2 if agreement < 0 else 0.0), second, polariser])
