"""Polar decomposition of Mueller matrices, M = M_Δ M_R M_D (Lu & Chipman 1996, JOSA A 13, 1106).

A diattenuator M_D first, then a retarder M_R, then a depolariser M_Δ. Angles are radians, frames
those of the matrices given.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf._kernels import decomposition
from pbrdf.reconstruction.pixels import matrix_list, same_list

Array = NDArray[Any]


class Guard(IntEnum):
    """What stood in the way of the plain formulas at a pixel.

    m' is the 3 × 3 block of M M_D⁻¹. Rounding of M leaves an error of about 8 ε / (1 − D²) in it;
    a singular value below that counts as zero.
    """

    NONE = 0
    SINGULAR = 1
    """One singular value of m' is zero: its vectors complete right-handed bases."""
    RANK_ONE = 2
    """At most one is not: the retarder of least retardance that fits; none if m' is zero."""
    POLARISER = 3
    """D = 1: the retarder of least retardance that takes D to the direction of the polarizance P,
    and a depolariser |P| alike in all directions. The product is M where M is physical."""
    UNDEFINED = 4
    """An element is not finite, M00 is not positive, or D > 1: all factors are NaN."""


@dataclass(frozen=True)
class LuChipman:
    """Factors of Mueller matrices, and what they say.

    Attributes
    ----------
    mueller : ndarray, shape (..., 4, 4)
        The matrices decomposed.
    depolariser, retarder, diattenuator : ndarray, shape (..., 4, 4)
        M_Δ and M_R have 1 in the corner; M_D carries M00.
    guard : ndarray, shape (...), uint8
        A `Guard`.
    """

    mueller: Array
    depolariser: Array
    retarder: Array
    diattenuator: Array
    guard: NDArray[np.uint8]

    @property
    def diattenuation(self) -> Array:
        """D = |M_D's first row| / M00, shape (...)."""
        return _length(self.diattenuator[..., 0, 1:]) / self.diattenuator[..., 0, 0]

    @property
    def polarizance(self) -> Array:
        """P = |M's first column| / M00, shape (...); NaN where there is no decomposition."""
        return self._where_defined(_length(self.mueller[..., 1:, 0]))

    @property
    def retardance(self) -> Array:
        """Angle in [0, π] by which M_R turns the Poincaré sphere, shape (...).

        A mirror, seen in the frames of a reflection, has π.
        """
        m = self.retarder[..., 1:, 1:]
        axis = np.stack(
            [m[..., 1, 2] - m[..., 2, 1], m[..., 2, 0] - m[..., 0, 2], m[..., 0, 1] - m[..., 1, 0]], axis=-1
        )
        # atan2 keeps the digits that acos(tr M_R / 2 − 1) loses near 0 and π
        angle: Array = np.arctan2(_length(axis), np.trace(m, axis1=-2, axis2=-1) - 1)
        return angle

    @property
    def depolarisation_power(self) -> Array:
        """Δ = 1 − |tr m_Δ| / 3, shape (...): 0 for a pure state, 1 for an ideal depolariser."""
        trace = np.trace(self.depolariser[..., 1:, 1:], axis1=-2, axis2=-1)
        power: Array = 1 - np.abs(trace) / 3
        return power

    @property
    def depolarisation_index(self) -> Array:
        """√(Σ M_ij² − M00²) / (√3 M00), shape (...): 1 for a pure state (Gil & Bernabeu 1985)."""
        elements = self.mueller.reshape(*self.mueller.shape[:-2], 16)
        return self._where_defined(_length(elements[..., 1:]) / np.sqrt(elements.dtype.type(3)))

    def _where_defined(self, unnormalised: Array) -> Array:
        """Divide by M00 where there is a decomposition."""
        result: Array = np.full_like(unnormalised, np.nan)
        np.divide(unnormalised, self.mueller[..., 0, 0], out=result, where=self.guard != Guard.UNDEFINED)
        return result


def lu_chipman(mueller: ArrayLike, out: Sequence[Array] | None = None) -> LuChipman:
    """Decompose Mueller matrices.

    Parameters
    ----------
    mueller : array_like, shape (..., 4, 4)
        float32 is decomposed in float32, anything else in float64. The matrices need not be
        physical, but those that are not may have no decomposition (`Guard.UNDEFINED`).
    out : sequence of three ndarray, shape (..., 4, 4), optional
        C-contiguous arrays of that type for depolariser, retarder and diattenuator: pages of fresh
        memory cost more than the arithmetic.

    Returns
    -------
    LuChipman

    Raises
    ------
    ValueError
        If `out` does not fit or does not hold three arrays.

    Notes
    -----
    The retarder is always a rotation, the depolariser carries the sign of det m'. As D nears 1 the
    error of the factors grows as that of M divided by 1 − D².
    """
    matrices, shape = matrix_list(mueller)
    if out is None:
        out = [np.empty((*shape, 4, 4), matrices.dtype) for _ in range(3)]
    depolariser, retarder, diattenuator = out
    guard = np.empty(shape, np.uint8)
    decomposition.lu_chipman(matrices, *(same_list(factor, matrices) for factor in out), guard.reshape(-1))
    return LuChipman(matrices.reshape(*shape, 4, 4), depolariser, retarder, diattenuator, guard)


def _length(vectors: Array) -> Array:
    length: Array = np.linalg.norm(vectors, axis=-1)
    return length
