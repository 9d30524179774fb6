"""A pBRDF table in memory, whatever file it came from."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pbrdf.errors import InputError


class Origin(IntEnum):
    """Where the value of a node comes from."""

    NEVER_VISIBLE = 0
    """Light or camera below the horizon: no capture can ever see it."""
    UNSEEN = 1
    """Possible, but no photograph shows it, and it is not filled."""
    MEASURED = 2
    MIRRORED = 3
    """Copied from −φd: the surface is mirror-symmetric."""
    RECIPROCAL = 4
    """Copied from φd ± π: light and camera may change places."""
    INPAINTED = 5
    """Interpolated from neighbours in angle space."""


@dataclass(frozen=True)
class TableData:
    """Mueller matrices over wavelength and half/difference angles.

    Attributes
    ----------
    source : str
        The file it came from, for messages.
    wavelengths_nm : ndarray, shape (B,), float64
        Ascending, nm.
    theta_h, theta_d, phi_d : ndarray, shapes (H,), (D,), (P,), float64
        Ascending node positions, radians (`pbrdf.optics.rusinkiewicz`).
    mueller : ndarray, shape (B, H, D, P, 4, 4), float32
        1/sr, table frames (`pbrdf.optics`), no cosine; NaN where nothing is known.
    variance : ndarray or None
        Variance of each element, shape of `mueller`, 1/sr²; None where the file does not tell.
    count : ndarray or None, shape (B, H, D, P), uint16
        Pixels behind each node.
    origin : ndarray or None, shape (B, H, D, P), uint8
        `Origin` of each node.

    Raises
    ------
    InputError
        If shapes disagree or an axis is not finite and ascending.
    """

    source: str
    wavelengths_nm: NDArray[np.float64]
    theta_h: NDArray[np.float64]
    theta_d: NDArray[np.float64]
    phi_d: NDArray[np.float64]
    mueller: NDArray[np.float32]
    variance: NDArray[np.float32] | None = None
    count: NDArray[np.uint16] | None = None
    origin: NDArray[np.uint8] | None = None

    def __post_init__(self) -> None:
        axes = ("wavelengths_nm", "theta_h", "theta_d", "phi_d")
        for name in axes:
            check_axis(self.source, name, getattr(self, name))
        grid = tuple(len(getattr(self, name)) for name in axes)
        for name in ("mueller", "variance", "count", "origin"):
            array = getattr(self, name)
            if array is None:
                continue
            expected = (*grid, 4, 4) if name in ("mueller", "variance") else grid
            if array.shape != expected:
                raise InputError(
                    self.source,
                    name,
                    f"has shape {array.shape} where the axes say {expected}",
                    "write the table again from its source",
                )


def check_axis(source: str | Path, name: str, values: NDArray[np.float64]) -> None:
    """Refuse an axis that is not a finite, strictly ascending row of numbers (`InputError`)."""
    remedy = "repair the axis, or give it in a file of axes (column `details`, or --axes FILE.yaml)"
    if values.ndim != 1 or values.size == 0:
        raise InputError(source, name, f"is empty or not one-dimensional (shape {values.shape})", remedy)
    if not np.all(np.isfinite(values)):
        raise InputError(source, name, "holds values that are not finite", remedy)
    if np.any(np.diff(values) <= 0):
        raise InputError(source, name, "does not ascend strictly", remedy)
