"""The data reduction matrix: from intensities to Mueller elements."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf.errors import InputError
from pbrdf.optics.polarimeter import Polarimeter

Float = NDArray[np.float64]

RANK_TOLERANCE = 1e-9
WORST_CONDITION = 1e3
"""Beyond it, noise of a thousandth of the signal drowns the weakest combination of elements."""


@dataclass(frozen=True)
class DataReduction:
    """W and its pseudo-inverse.

    Attributes
    ----------
    measurement : ndarray, shape (states, 16)
        W: intensities of a Mueller matrix in row-major order.
    reduction : ndarray, shape (16, states)
        W⁺, the least-squares solution (Goldstein & Chipman 1990).
    condition : float
        Ratio of the largest to the smallest singular value of W.
    """

    measurement: Float
    reduction: Float
    condition: float


def data_reduction(
    polarimeter: Polarimeter,
    states_deg: ArrayLike,
    source: str | Path,
    field: str = "states_deg",
    power: ArrayLike = 1.0,
) -> DataReduction:
    """Data reduction of a list of states.

    Parameters
    ----------
    polarimeter : Polarimeter
        Calibrated elements in the band.
    states_deg : array_like, shape (states, 4)
        Scale readings (`Polarimeter.measurement_matrix`), degrees.
    source : str or Path
        Where the states come from, for messages.
    field : str
        What they are called there.
    power : array_like, shape (states,), optional
        Power of the lamp at each state, relative.

    Raises
    ------
    InputError
        If two states are equal, or the states do not determine all sixteen elements, or hardly so.
    """
    states = np.asarray(states_deg, dtype=np.float64)
    _refuse_equal(states, source, field)
    lamp = np.broadcast_to(np.asarray(power, dtype=np.float64), len(states))
    w = lamp[:, None] * polarimeter.measurement_matrix(np.deg2rad(states))
    u, singular, vt = np.linalg.svd(w, full_matrices=False)
    rank = int(np.sum(singular > singular[0] * RANK_TOLERANCE))
    condition = float(singular[0] / singular[-1])
    if rank < 16 or condition > WORST_CONDITION:
        problem = f"{len(w)} states are of rank {rank} and condition {condition:.3g}"
        remedy = (
            f"sixteen elements need rank 16 and a condition below {WORST_CONDITION:g}: "
            "add states, or spread them over half a turn of the slow retarder"
        )
        raise InputError(source, field, problem, remedy)
    return DataReduction(w, (vt.T / singular) @ u.T, condition)


def _refuse_equal(states: Float, source: str | Path, field: str) -> None:
    seen: dict[tuple[float, ...], int] = {}
    for index, state in enumerate(np.round(states % 360.0, 6) % 360.0):
        first = seen.setdefault(tuple(state), index)
        if first != index:
            problem = f"is the same as [{first}]: {states[index].tolist()}"
            remedy = "drop one of them; repeats against lamp drift are `references`"
            raise InputError(source, f"{field}[{index}]", problem, remedy)
