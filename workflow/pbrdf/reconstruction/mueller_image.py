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
from pbrdf.formats.mueller_exr import Missing
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.reconstruction.dark import Darkness, darkness
from pbrdf.reconstruction.drift import lamp_power
from pbrdf.reconstruction.reduction import DataReduction, data_reduction
from pbrdf.reconstruction.streaming import StatesAhead, Workspace, merged_states, window_shape

Plane = NDArray[np.float32]


@dataclass(frozen=True)
class MuellerImage:
    """Mueller matrices of the window of a frame.

    Attributes
    ----------
    mueller, variance : ndarray, shape (16, rows, columns), float32
        Row-major elements in DN/s and their variance, from the generator's frame to the analyser's;
        NaN where `missing` says why.
    missing : ndarray, shape (rows, columns), uint8
        A `Missing` a pixel.
    first_row, first_column : int
        Place of the window in the frame, px.
    summary : dict
        ``condition`` of W; ``residual_rms`` over states and pixels, DN/s, and
        ``predicted_residual_rms``, what a radiometry makes of it, or None; ``missing``, shares of
        the pixels by reason; ``weighted_share`` of the pixels whose states differ in exposures;
        ``drift``, the range of the lamp's relative power; ``noise``: where the variance is from,
        ``radiometry``, ``residuals`` or ``unknown`` (then it is NaN).
    """

    mueller: Plane
    variance: Plane
    missing: NDArray[np.uint8]
    first_row: int
    first_column: int
    summary: dict[str, Any]


def reconstruct(
    store: FrameStore,
    band_nm: int,
    polarimeter: Polarimeter,
    radiometry: Radiometry | None,
    window: tuple[slice, slice],
    flat: Plane | None = None,
    workspace: Workspace | None = None,
    dark: Darkness | None = None,
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
        Noise and range of raw values. Without it every value counts alike, and the variance is taken from
        the residuals of the whole image; sixteen states leave none, and it is NaN.
    window : tuple of slice
        Rows and columns to work on.
    flat : ndarray, shape (rows, columns), optional
        What the pixels of the window make of equal light, relative.
    workspace : Workspace, optional
        Memory to work in, for the states and pixels of the window: the image lies in it, until it is
        used again. By default fresh memory.
    dark : Darkness, optional
        Of the frames, with the radiometry's saturation, in the window: bands of a light share it. By
        default it is made anew.

    Raises
    ------
    InputError
        If the states are too few, a frame cannot be read, a state is saturated in most of its
        pixels, all pixels are masked, or all is dark.
    ValueError
        If the workspace is for other frames.
    """
    data_reduction(polarimeter, store.header.states_deg, store.path)
    if radiometry is not None:
        store = store.saturating_at(radiometry.saturation_dn)
    noise = (0.0, 1.0) if radiometry is None else (radiometry.dn_per_electron, radiometry.read_noise_dn)
    with StatesAhead(store, band_nm, window, workspace) as ahead:
        dark = dark or darkness(store, window)
        inverse_flat = None if flat is None else _inverse(store, flat.reshape(-1), dark)
        power = lamp_power(store, band_nm, window, dark, noise)
        solution = data_reduction(polarimeter, store.header.states_deg, store.path, power=power)
        workspace = merged_states(ahead, dark, noise)
    used = workspace.used
    weighted_share = _differing(used)
    mueller, variance, residual, expected = _solved(store, solution, noise, workspace, inverse_flat)
    if not (mueller[0] > 0).any():
        raise InputError(
            store.path, band_name(band_nm), "shows no light in any pixel", "check lamp, filter and shutter"
        )
    known = np.isfinite(mueller[0])
    # sixteen states leave no residual to expect, but for rounding that may fall below zero
    square_sum, expected_sum = (
        max(float(squares.sum(dtype=np.float64, where=known)), 0.0) for squares in (residual, expected)
    )
    noise_source = "radiometry"
    if radiometry is None:
        # sixteen states fit any noise: their residuals say nothing of it
        noise_source = "residuals" if len(used) > 16 else "unknown"
        variance *= np.float32(square_sum / expected_sum if len(used) > 16 else np.nan)
    missing = _reasons(known, dark, inverse_flat)
    values = max(int(known.sum()) * len(used), 1)
    shape = window_shape(store.header, window)
    return MuellerImage(
        mueller.reshape(16, *shape),
        variance.reshape(16, *shape),
        missing.reshape(shape),
        window[0].start,
        window[1].start,
        {
            "condition": solution.condition,
            "residual_rms": (square_sum / values) ** 0.5,
            "predicted_residual_rms": (expected_sum / values) ** 0.5 if radiometry else None,
            "missing": {
                reason.name.lower(): float((missing == reason).mean()) for reason in Missing if reason
            },
            "weighted_share": weighted_share,
            "drift": [float(power.min()), float(power.max())],
            "noise": noise_source,
        },
    )


def _solved(
    store: FrameStore,
    solution: DataReduction,
    noise: tuple[float, float],
    workspace: Workspace,
    inverse_flat: Plane | None,
) -> tuple[Plane, Plane, Plane, Plane]:
    """Matrices and variances (16, pixels), sums of squared residuals and their expectation (pixels,)."""
    planes, states = workspace.planes, len(workspace.used)
    mueller, variance, residual, expected = planes[:16], planes[16:32], planes[32], planes[33]
    darks = store.header.darks
    solve.solve(
        solution.reduction,
        solution.measurement,
        np.array(store.header.exposures_s),
        *noise,
        noise[1] ** 2 / darks if darks else 0.0,
        planes[:states],
        workspace.used,
        inverse_flat,
        mueller,
        variance,
        residual,
        expected,
    )
    return mueller, variance, residual, expected


def _inverse(store: FrameStore, flat: Plane, dark: Darkness) -> Plane:
    """Reciprocal of a flat field, NaN where it has none."""
    inverse = np.full(flat.shape, np.nan, np.float32)
    np.divide(np.float32(1.0), flat, out=inverse, where=np.isfinite(flat) & (flat > 0))
    if not np.any(np.isfinite(inverse) & (dark.usable > 0)):
        raise InputError(
            store.path, "all pixels", "are hot or without flat field", "check dark frames and flat field"
        )
    return inverse


def _differing(used: NDArray[np.uint8]) -> float:
    """Share of the pixels all of whose states are known, but by different exposures."""
    low, high = used.min(axis=0), used.max(axis=0)
    return float(((low > 0) & (low != high)).mean())


def _reasons(known: NDArray[np.bool_], dark: Darkness, inverse_flat: Plane | None) -> NDArray[np.uint8]:
    reasons = np.where(known, Missing.NONE, Missing.SATURATED).astype(np.uint8)
    if inverse_flat is not None:
        reasons[np.isnan(inverse_flat)] = Missing.NO_FLAT
    reasons[dark.usable == 0] = Missing.HOT
    return reasons
