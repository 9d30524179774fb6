"""M00 and its polarisation against θd, at a few θh: points of the table, line of the model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pbrdf.report.figures import Float, Picture, number, picture

MEASURED_COLOUR = "#0072B2"
FILLED_COLOUR = "#777777"
MODEL_COLOUR = "#D55E00"


@dataclass(frozen=True)
class Curve:
    """Elements along θd at one θh and one φd.

    Attributes
    ----------
    theta_h, phi_d : float
        Radians.
    theta_d : ndarray, shape (D,)
        Radians.
    measured : ndarray, shape (D, 4, 4)
        1/sr; NaN where nothing is known.
    filled : ndarray of bool, shape (D,)
        Which of them are no measurement, but copied or interpolated.
    model : ndarray, shape (D, 4, 4), or None
        1/sr.
    """

    theta_h: float
    phi_d: float
    theta_d: Float
    measured: NDArray[np.floating]
    filled: NDArray[np.bool_]
    model: NDArray[np.floating] | None


def against_theta_d(
    curves: list[Curve], wavelength_nm: float, model_name: str, table_name: str = "table"
) -> Picture:
    """Draw M00 (logarithmic) above M10/M00 for each curve.

    M10/M00 is the degree of linear polarisation that the surface gives to unpolarised light, positive
    across the plane of light and camera, as reflection does, and negative in it.
    """
    columns = len(curves)

    def draw(figure: Figure) -> None:
        axes = figure.subplots(2, columns, sharex=True, sharey="row", squeeze=False)
        figure.subplots_adjust(left=0.075, right=0.99, top=0.84, bottom=0.12, hspace=0.12, wspace=0.06)
        title = f"Along θd at {number(wavelength_nm, 4)} nm, φd = {number(np.degrees(curves[0].phi_d))}°"
        figure.text(0.075, 0.975, title, fontsize=8.5, weight="bold", va="top")
        for column, curve in enumerate(curves):
            degrees = np.degrees(curve.theta_d)
            upper, lower = axes[0, column], axes[1, column]
            upper.set_title(f"θh = {number(np.degrees(curve.theta_h))}°", loc="left")
            for panel, element in ((upper, _first), (lower, _polarised)):
                measured = element(curve.measured)
                solid, hollow = (
                    np.where(curve.filled, np.nan, measured),
                    np.where(curve.filled, measured, np.nan),
                )
                panel.plot(degrees, solid, "o", ms=2.6, mew=0, color=MEASURED_COLOUR, label=table_name)
                if any(other.filled.any() for other in curves):
                    panel.plot(
                        degrees, hollow, "o", ms=2.4, mew=0.5, mfc="none", mec=FILLED_COLOUR, label="filled"
                    )
                if curve.model is not None:
                    panel.plot(degrees, element(curve.model), color=MODEL_COLOUR, lw=1.4, label=model_name)
                panel.grid(True)
                panel.set_xlim(0, 90)
                panel.set_xticks(range(0, 91, 15))
            lower.axhline(0.0, color="#555555", lw=0.6)
            lower.set_xlabel("θd, °")
        if any(np.any(_first(curve.measured) > 0) for curve in curves):
            axes[0, 0].set_yscale("log")
        axes[0, 0].set_ylabel("M00, 1/sr")
        axes[1, 0].set_ylabel("M10/M00, no unit")
        handles, labels = axes[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="upper right", ncols=3, frameon=False, borderaxespad=0.2)

    return picture((9.4, 4.4), draw, _words(curves, wavelength_nm))


def _first(mueller: NDArray[np.floating]) -> Float:
    first = np.asarray(mueller[..., 0, 0], dtype=np.float64)
    return np.where(first > 0, first, np.nan)


def _polarised(mueller: NDArray[np.floating]) -> Float:
    return np.asarray(mueller[..., 1, 0], dtype=np.float64) / _first(mueller)


def _words(curves: list[Curve], wavelength_nm: float) -> str:
    text = f"M00 and M10/M00 against θd at {number(wavelength_nm, 4)} nm."
    for curve in curves:
        first = _first(curve.measured)
        known = np.flatnonzero(np.isfinite(first))
        if known.size == 0:
            text += f" θh = {number(np.degrees(curve.theta_h))}°: nothing known."
            continue
        ends = [f"{number(first[n])} 1/sr at {number(np.degrees(curve.theta_d[n]))}°" for n in known[[0, -1]]]
        text += f" θh = {number(np.degrees(curve.theta_h))}°: M00 {ends[0]} and {ends[1]}."
    return text
