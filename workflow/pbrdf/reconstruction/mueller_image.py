"""Mueller images of one light: exposures merged, then solved pixel by pixel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf._kernels import solve
from pbrdf.calibration.radiometry import Radiometry
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FrameStore, band_name
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.reconstruction.reduction import data_reduction
from pbrdf.reconstruction.streaming import merged_states


@dataclass(frozen=True)
class MuellerImage:
    """Mueller matrices of the window of a frame.

    Attributes
    ----------
    mueller, variance : ndarray, shape (16, rows, columns), float32
        Row-major elements in DN/s and their variance, from the generator's frame to the analyser's;
        NaN where a state is saturated in every exposure.
    first_row, first_column : int
        Place of the window in the frame, px.
    summary : dict
        ``condition`` of W; ``residual_rms`` over states and pixels, DN/s, not corrected for the
        sixteen elements fitted; ``missing_share`` of the pixels; ``noise``: where the variance is from,
        ``radiometry``, ``residuals`` or ``unknown`` (then it is NaN).
    """

    mueller: NDArray[np.float32]
    variance: NDArray[np.float32]
    first_row: int
    first_column: int
    summary: dict[str, Any]


def reconstruct(
    store: FrameStore,
    band_nm: int,
    polarimeter: Polarimeter,
    radiometry: Radiometry | None,
    window: tuple[slice, slice],
) -> MuellerImage:
    """Mueller image of one band of one light.

    Parameters
    ----------
    store : FrameStore
        The raw frames.
    band_nm : int
        Band centre, nm.
    polarimeter : Polarimeter
        Calibrated elements in that band.
    radiometry : Radiometry or None
        Noise of a raw value. Without it every value counts alike, and the variance is taken from
        the residuals of the whole image; sixteen states leave none, and it is NaN.
    window : tuple of slice
        Rows and columns to work on.

    Raises
    ------
    InputError
        If the states are too few, a state is saturated in most of its pixels, or all is dark.
    """
    solution = data_reduction(polarimeter, store.header.states_deg, store.path)
    noise = (0.0, 1.0) if radiometry is None else (radiometry.dn_per_electron, radiometry.read_noise_dn)
    rate, variance = merged_states(store, band_nm, window, noise, solution.reduction**2)
    states, pixels = rate.shape
    rows, columns = len(range(store.header.rows)[window[0]]), len(range(store.header.columns)[window[1]])

    squares = np.empty(pixels, np.float32)
    solve.apply_reduction(solution.reduction, solution.measurement, rate, rate[:16], squares)
    # the planes behind are given back: of a large frame they fill most of a gigabyte
    rate.resize((16, pixels), refcheck=False)
    mueller = rate
    if not (mueller[0] > 0).any():
        raise InputError(
            store.path, band_name(band_nm), "shows no light in any pixel", "check lamp, filter and shutter"
        )
    known = np.isfinite(mueller[0])
    square_sum = float(squares[known].sum(dtype=np.float64))
    noise_source = "radiometry"
    if radiometry is None:
        # sixteen states fit any noise: their residuals say nothing of it
        freedom = int(known.sum()) * (states - 16)
        noise_source = "residuals" if freedom else "unknown"
        rate_noise = square_sum / freedom if freedom else np.nan
        variance[:] = (rate_noise * (solution.reduction**2).sum(axis=1))[:, None]
        variance[:, ~known] = np.nan
    return MuellerImage(
        mueller.reshape(16, rows, columns),
        variance.reshape(16, rows, columns),
        window[0].start,
        window[1].start,
        {
            "condition": solution.condition,
            "residual_rms": (square_sum / max(int(known.sum()) * states, 1)) ** 0.5,
            "missing_share": float(1.0 - known.mean()),
            "noise": noise_source,
        },
    )
