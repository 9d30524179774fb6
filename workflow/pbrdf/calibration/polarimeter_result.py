"""Content of ``polarimeter.json`` for a measured polarimeter, and maps of what its pixels leave over."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf.calibration.polarimeter import ELEMENTS
from pbrdf.calibration.polarimeter_ambiguity import Ambiguity
from pbrdf.calibration.polarimeter_fit import PolarimeterFit
from pbrdf.calibration.polarimeter_verdict import judge
from pbrdf.errors import InputError

Float = NDArray[np.float64]

_QUARTER_WAVE = 0.25
_BLOCK = 65536
"""Pixels that are solved at once, so that no second stack of images is held."""


def measured_polarimeter(
    fit: PolarimeterFit, bands_nm: Sequence[int], analyser_axis: Iterable[float], signal_unit: str
) -> dict[str, Any]:
    """Content of ``polarimeter.json``; digests of the inputs are the caller's to add.

    Parameters
    ----------
    fit : PolarimeterFit
    bands_nm : sequence of int
        Wavelength of each band, whole nm.
    analyser_axis : iterable of three float
        X axis of the analyser's frame in the camera's frame, of length 1.
    signal_unit : str
        Unit of the signals that were fitted.

    Returns
    -------
    dict
        Values, standard errors, residual beside noise, what was assumed, and the verdict in words;
        `usable` is false where the values must not be used.
    """
    verdict = judge(fit, list(bands_nm))
    return {
        "source": "measured",
        "verdict": verdict.words,
        "usable": verdict.usable,
        "zeros_deg": _by_element(fit.elements.zeros),
        "zeros_standard_error_deg": _by_element(fit.standard_errors.zeros),
        "analyser_axis": list(analyser_axis),
        "frame_rotation": _told(fit.frame_rotation),
        "s3_sign": _told(fit.s3_sign),
        "scale_sense": _told(fit.scale_sense),
        "signal_unit": signal_unit,
        "states": len(fit.model.states),
        "lamp_known_at": None if isinstance(fit.model.drift, bool) else list(fit.model.drift),
        "chi_square_per_freedom": fit.chi_square / fit.freedom if fit.noise_known else None,
        "bands": {str(nm): _band(fit, index) for index, nm in enumerate(bands_nm)},
        "retardance_curve": retardance_curve(fit, bands_nm),
    }


def retardance_curve(fit: PolarimeterFit, bands_nm: Sequence[int]) -> dict[str, Any]:
    """Retardances with standard errors beside the ideal quarter wave, all in waves (SUPP §1, fig. 1)."""
    curve: dict[str, Any] = {"wavelengths_nm": list(bands_nm), "ideal_waves": _QUARTER_WAVE}
    for module in ("generator", "analyser"):
        for what, elements in (("retardance", fit.elements), ("standard_error", fit.standard_errors)):
            values: Float = getattr(elements, f"{module}_retardances")
            curve[f"{module}_{what}_waves"] = (values / (2.0 * np.pi)).tolist()
    return curve


def residual_map(columns: ArrayLike, images: ArrayLike, source: str = "images") -> tuple[Float, Float]:
    """What each pixel of a stack leaves over after the calibrated polarimeter is fitted to it.

    Parameters
    ----------
    columns : array_like, shape (N, K)
        Signals per unit of each unknown: the measurement matrix times a known reference (K = 1), or
        the measurement matrix itself for an unknown sample (K = 16).
    images : array_like, shape (N, pixels)
    source : str
        What messages call the images.

    Returns
    -------
    coefficients : ndarray, shape (K, pixels)
    residual_rms : ndarray, shape (pixels,)
        Root mean square over the states, in the images' unit; NaN where a pixel is not finite.

    Raises
    ------
    InputError
        If the shapes do not agree or the states do not determine the unknowns.
    """
    design = np.asarray(columns, dtype=np.float64)
    stack = np.asarray(images)
    if design.ndim != 2 or stack.ndim != 2 or len(design) != len(stack):
        problem = f"have shape {stack.shape} where the states give {design.shape}"
        raise InputError(source, "images", problem, "give an array (states, pixels)")
    if np.linalg.matrix_rank(design) < design.shape[1]:
        raise InputError(source, "states", "do not determine every unknown", "take more states")
    inverse = np.linalg.pinv(design)
    coefficients = np.empty((design.shape[1], stack.shape[1]))
    rms = np.empty(stack.shape[1])
    for first in range(0, stack.shape[1], _BLOCK):
        block = slice(first, first + _BLOCK)
        pixels = stack[:, block].astype(np.float64)
        pixels[:, ~np.isfinite(pixels).all(axis=0)] = np.nan
        coefficients[:, block] = inverse @ pixels
        rms[block] = np.sqrt(((pixels - design @ coefficients[:, block]) ** 2).mean(axis=0))
    return coefficients, rms


def _band(fit: PolarimeterFit, band: int) -> dict[str, Any]:
    """Values of one band."""
    content: dict[str, Any] = {}
    for module in ("generator", "analyser"):
        name = f"{module}_retardances"
        content[f"{module}_retardance_deg"] = float(np.rad2deg(getattr(fit.elements, name)[band]))
        error = float(np.rad2deg(getattr(fit.standard_errors, name)[band]))
        content[f"{module}_retardance_standard_error_deg"] = error
    if fit.model.extinction:
        content["extinction_ratio"] = fit.polarimeters()[band].extinction
        content["extinction_ratio_standard_error"] = float(fit.standard_errors.extinctions[band])
    content["references"] = {
        reference.name: _cell(fit, index, band) for index, reference in enumerate(fit.model.references)
    }
    return content


def _cell(fit: PolarimeterFit, reference: int, band: int) -> dict[str, Any]:
    """Values of one reference in one band."""
    at = reference, band
    content: dict[str, Any] = {
        "amplitude": float(fit.elements.amplitudes[at]),
        "amplitude_standard_error": float(fit.standard_errors.amplitudes[at]),
        "mean_signal": float(fit.signal[at].mean()),
        "residual_rms": float(fit.residual_rms[at]),
        "noise_rms": float(np.sqrt((fit.noise[at] ** 2).mean())) if fit.noise_known else None,
    }
    if fit.model.drift:
        content["lamp_drift"] = fit.elements.drifts[at].tolist()
        content["lamp_drift_standard_error"] = fit.standard_errors.drifts[at].tolist()
    return content


def _by_element(angles: Float) -> dict[str, float]:
    return {name: float(np.rad2deg(angle)) for name, angle in zip(ELEMENTS, angles, strict=True)}


def _told(ambiguity: Ambiguity) -> dict[str, Any]:
    return {"settled": ambiguity.settled, "by" if ambiguity.settled else "assumed": ambiguity.by}
