"""The four pixels around a place of the frame, and how much each counts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]

_STEPS = ((0, 0), (0, 1), (1, 0), (1, 1))


@dataclass(frozen=True)
class Corners:
    """The four pixels around places (n,): arrays (4, n).

    Attributes
    ----------
    row, column : ndarray of int
        Px of the frame, or of an image's window after `within`.
    weight : ndarray
        Bilinear.
    """

    row: NDArray[np.intp]
    column: NDArray[np.intp]
    weight: Float

    @classmethod
    def around(cls, columns: Float, rows: Float) -> Corners:
        """Pixels around finite places (n,)."""
        left, top = np.floor(columns), np.floor(rows)
        right, down = columns - left, rows - top
        weight = [(down if r else 1.0 - down) * (right if c else 1.0 - right) for r, c in _STEPS]
        row = np.stack([top + r for r, _ in _STEPS]).astype(np.intp)
        column = np.stack([left + c for _, c in _STEPS]).astype(np.intp)
        return cls(row, column, np.stack(weight))

    def within(self, first: tuple[int, int], shape: tuple[int, ...]) -> tuple[Corners, NDArray[np.bool_]]:
        """Those of which an image (rows, columns) from pixel `first` on holds all four; and which (n,)."""
        row, column = self.row - first[0], self.column - first[1]
        held: NDArray[np.bool_] = np.all(
            (row >= 0) & (row < shape[0]) & (column >= 0) & (column < shape[1]), axis=0
        )
        return Corners(row[:, held], column[:, held], self.weight[:, held]), held
