"""A Mueller image straight from frames: the quick look, without exposures, masks or noise."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf._kernels import planes
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.reconstruction.reduction import data_reduction


def mueller_of_frames(
    frames: NDArray[Any],
    states_deg: ArrayLike,
    polarimeter: Polarimeter,
    out: NDArray[np.float32] | None = None,
) -> NDArray[np.float32]:
    """Mueller image of frames that were taken one a state, by least squares.

    Parameters
    ----------
    frames : ndarray, shape (states, rows, columns), uint8, uint16 or float32
        C-contiguous; dark level subtracted or negligible, nothing saturated.
    states_deg : array_like, shape (states, 4)
        Scale readings (`Polarimeter.measurement_matrix`), degrees.
    polarimeter : Polarimeter
    out : ndarray, shape (16, rows, columns), float32, optional
        C-contiguous array for the result: pages of fresh memory cost more than the arithmetic.

    Returns
    -------
    ndarray, shape (16, rows, columns), float32
        Row-major elements in the unit of `frames`, from the generator's frame to the analyser's.

    Raises
    ------
    InputError
        If two states are equal, or they do not determine all sixteen elements.
    ValueError
        If the arrays do not fit.
    """
    if frames.ndim != 3 or len(frames) != len(np.asarray(states_deg)):
        raise ValueError(f"frames have shape {frames.shape}, expected (states, rows, columns)")
    shape = (16, *frames.shape[1:])
    if out is None:
        out = np.empty(shape, np.float32)
    elif out.shape != shape or out.dtype != np.float32 or not out.flags.c_contiguous:
        raise ValueError(f"out is {out.dtype} {out.shape}, expected C-contiguous float32 {shape}")
    solution = data_reduction(polarimeter, states_deg, "mueller_of_frames")
    planes.combine(frames.reshape(len(frames), -1), solution.reduction, out.reshape(16, -1))
    return out
