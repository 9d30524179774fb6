"""What references leave open about a polarimeter, and what settles it.

Air looks the same when both modules turn together, when fast and slow axes are exchanged in both
retarders (s3 turned over on both sides), and when all scales count backwards. A reference settles
one of these if its matrix changes under it: a polariser of known axis the first, a circular
polariser of known hand or a metal the second.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from pbrdf.calibration.polarimeter_signal import Reference
from pbrdf.errors import InputError
from pbrdf.optics.mueller import rotator

Float = NDArray[np.float64]

_QUARTER = np.pi / 2
_RATE = np.zeros((4, 4))
_RATE[1, 2], _RATE[2, 1] = 2.0, -2.0
"""Derivative of the rotator at angle zero."""

_S3_OVER = np.diag([1.0, 1.0, 1.0, -1.0])
_S2_OVER = np.diag([1.0, 1.0, -1.0, 1.0])
_SAME = 1e-6
"""Relative change of a matrix below which it counts as unchanged: no reference is known better."""


@dataclass(frozen=True)
class Ambiguity:
    """One thing that some references leave open.

    Attributes
    ----------
    settled : bool
        The references of the fit tell it; otherwise it was assumed.
    by : str
        Which references, or which assumption.
    """

    settled: bool
    by: str


@dataclass(frozen=True)
class Exchange:
    """A change of zeros that air does not see: axes of the retarders exchanged, or all turned by 90°.

    Attributes
    ----------
    generator, analyser : bool
        Fast and slow axis exchanged in that module's retarder.
    turned : bool
        Every element turned by 90°.
    """

    generator: bool
    analyser: bool
    turned: bool

    def apply(self, zeros: Float) -> Float:
        """Zeros (4,) after the change, radians."""
        step = np.array([0, self.generator, self.analyser, 0], dtype=float) + self.turned
        changed: Float = zeros + _QUARTER * step
        return changed

    def leaves(self, references: Sequence[Reference]) -> bool:
        """Whether no reference's matrix changes under it."""
        turn = rotator(_QUARTER) if self.turned else np.eye(4)
        before = turn @ (_S3_OVER if self.generator else np.eye(4))
        after = turn @ (_S3_OVER if self.analyser else np.eye(4))
        return all(_unchanged(r.mueller, after @ r.mueller @ before.T) for r in references)


def exchanges(*, free_frame: bool) -> list[Exchange]:
    """All such changes but that of nothing; those that turn the frame only where it is free."""
    flags = product((False, True), (False, True), (False, True) if free_frame else (False,))
    return [Exchange(*flag) for flag in flags if any(flag)]


def free_turn(references: Sequence[Reference], source: str) -> Float | None:
    """Turn of generator and analyser (1, b) that no reference sees; None if every turn is seen.

    Raises
    ------
    InputError
        If generator and analyser can turn each by itself, so that no frame ties them together.
    """
    matrices = [np.asarray(r.mueller) / r.mueller[0, 0] for r in references]
    seen = np.stack(
        [
            np.concatenate([(-m @ _RATE).ravel() for m in matrices]),
            np.concatenate([(_RATE @ m).ravel() for m in matrices]),
        ],
        axis=-1,
    )
    _, strength, turns = np.linalg.svd(seen, full_matrices=False)
    if strength[1] > _SAME:
        return None
    generator, analyser = turns[1]
    if strength[0] <= _SAME or abs(generator) <= _SAME:
        raise InputError(
            source,
            "references",
            "do not tie the analyser's axes to the generator's",
            "add air or a mirror",
        )
    return np.array([1.0, analyser / generator])


def frame_rotation(
    references: Sequence[Reference], turn: Float | None, open_exchanges: Sequence[Exchange], frame_deg: float
) -> Ambiguity:
    """Say what settles the common rotation of the frames."""
    if turn is not None:
        return Ambiguity(
            False, f"generator polariser taken to stand at {frame_deg:g}° where its scale reads 0"
        )
    if any(exchange.turned for exchange in open_exchanges):
        return Ambiguity(False, "known up to a quarter turn; the one nearer to the intended zeros taken")
    alone = [r.name for r in references if _turn_seen(r)]
    return Ambiguity(True, ", ".join(alone) if alone else " with ".join(r.name for r in references))


def s3_sign(references: Sequence[Reference], open_exchanges: Sequence[Exchange]) -> Ambiguity:
    """Say what settles which axes of the retarders are fast, and so the sign of s3."""
    if any(exchange.generator or exchange.analyser for exchange in open_exchanges):
        return Ambiguity(False, "fast axes taken to be those nearer to the retarders' intended zeros")
    telling = [r.name for r in references if not _unchanged(r.mueller, _S3_OVER @ r.mueller @ _S3_OVER)]
    return Ambiguity(True, ", ".join(telling))


def scale_sense(references: Sequence[Reference]) -> Ambiguity:
    """Say what settles that the scales count counter-clockwise for an observer who looks into the beam."""
    telling = [
        r.name
        for r in references
        if not any(_unchanged(r.mueller, over @ r.mueller @ over) for over in (_S2_OVER, _S2_OVER @ _S3_OVER))
    ]
    if telling:
        return Ambiguity(True, ", ".join(telling))
    return Ambiguity(False, "scales taken to count counter-clockwise for an observer who looks into the beam")


def _turn_seen(reference: Reference) -> bool:
    """Whether a reference alone fixes the frames of both modules."""
    matrix = np.asarray(reference.mueller) / reference.mueller[0, 0]
    columns = np.stack([(-matrix @ _RATE).ravel(), (_RATE @ matrix).ravel()], axis=-1)
    return bool(np.linalg.svd(columns, compute_uv=False)[1] > _SAME)


def _unchanged(one: Float, other: Float) -> bool:
    return bool(np.abs(np.asarray(other) - one).max() <= _SAME * abs(one[0, 0]))
