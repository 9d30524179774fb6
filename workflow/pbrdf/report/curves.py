"""M00 and its polarisation against θd, at a few θh: table with error bars, models, what they leave."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pbrdf.report.figures import Float, Picture, number, picture

MEASURED_COLOUR = "#0072B2"
FILLED_COLOUR = "#777777"
Dashes = str | tuple[int, tuple[int, ...]]

MODEL_STYLES: tuple[tuple[str, Dashes], ...] = (
    ("#D55E00", "-"),
    ("#009E73", "--"),
    ("#CC79A7", "-."),
    ("#56B4E9", ":"),
    ("#E69F00", (0, (5, 1, 1, 1, 1, 1))),
    ("#000000", (0, (1, 3))),
)
"""Okabe and Ito's colours, and dashes for those who see no colours."""

MOST_PERCENT = 100.0
LEGEND_COLUMNS = 4


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
    models : mapping of str to ndarray, shape (D, 4, 4)
        By title, 1/sr.
    variance : ndarray, shape (D, 4, 4), or None
        Of `measured`.
    """

    theta_h: float
    phi_d: float
    theta_d: Float
    measured: NDArray[np.floating]
    filled: NDArray[np.bool_]
    models: Mapping[str, NDArray[np.floating]] = field(default_factory=dict)
    variance: NDArray[np.floating] | None = None


def against_theta_d(curves: list[Curve], wavelength_nm: float, table_name: str = "table") -> Picture:
    """Draw M00 (logarithmic) above M10/M00 and, where there are models, what they leave of M00.

    M10/M00 is the degree of linear polarisation that the surface gives to unpolarised light, positive
    across the plane of light and camera, as reflection does, and negative in it. Bars are one standard
    error.
    """
    rows = 3 if any(curve.models for curve in curves) else 2
    titles = max((len(curve.models) for curve in curves), default=0)
    above = 0.7 + 0.16 * (titles // LEGEND_COLUMNS)
    height = 2.2 * rows + above - 0.7

    def draw(figure: Figure) -> None:
        axes = figure.subplots(rows, len(curves), sharex=True, sharey="row", squeeze=False)
        figure.subplots_adjust(
            left=0.075, right=0.99, top=1 - above / height, bottom=0.5 / height, hspace=0.12, wspace=0.06
        )
        title = f"Along θd at {number(wavelength_nm, 4)} nm, φd = {number(np.degrees(curves[0].phi_d))}°"
        figure.text(0.075, 1 - 0.11 / height, title, fontsize=8.5, weight="bold", va="top")
        some_filled = any(curve.filled.any() for curve in curves)
        for column, curve in zip(axes.T, curves, strict=True):
            column[0].set_title(f"θh = {number(np.degrees(curve.theta_h))}°", loc="left")
            for panel, element in ((column[0], _first), (column[1], _polarised)):
                error = _error_of_first(curve) if panel is column[0] else _error_of_polarised(curve)
                _points(panel, curve, element(curve.measured), error, table_name, some_filled)
                for (title, model), style in zip(curve.models.items(), _styles(), strict=False):
                    degrees = np.degrees(curve.theta_d)
                    panel.plot(degrees, element(model), color=style[0], ls=style[1], lw=1.4, label=title)
            if rows == 3:
                _left_over(column[2], curve)
            column[1].axhline(0.0, color="#555555", lw=0.6)
            column[-1].set_xlabel("θd, °")
            for panel in column:
                panel.grid(True)
                panel.set_xlim(0, 90)
                panel.set_xticks(range(0, 91, 15))
        if any(np.any(_first(curve.measured) > 0) for curve in curves):
            axes[0, 0].set_yscale("log")
        axes[0, 0].set_ylabel("M00, 1/sr")
        axes[1, 0].set_ylabel("M10/M00, no unit")
        if rows == 3:
            subject = "model" if table_name == "table" else " and ".join(curves[0].models)
            axes[2, 0].set_ylabel(f"M00, {subject} − {table_name}, %")
        handles, labels = axes[0, 0].get_legend_handles_labels()
        # below the title, which many models' names would run into
        corner = (0.07, 1 - 0.24 / height)
        figure.legend(
            handles, labels, ncols=LEGEND_COLUMNS, frameon=False, loc="upper left", bbox_to_anchor=corner
        )

    return picture((9.4, height), draw, _words(curves, wavelength_nm))


def _points(
    panel: Axes, curve: Curve, measured: Float, error: Float | None, table_name: str, some_filled: bool
) -> None:
    degrees = np.degrees(curve.theta_d)
    solid = np.where(curve.filled, np.nan, measured)
    panel.plot(degrees, solid, "o", ms=2.6, mew=0, color=MEASURED_COLOUR, label=table_name)
    if error is not None:
        known = np.isfinite(solid) & np.isfinite(error)
        at, middle, bar = degrees[known], solid[known], error[known]
        panel.errorbar(at, middle, yerr=bar, fmt="none", ecolor=MEASURED_COLOUR, elinewidth=0.7)
    if some_filled:
        hollow = np.where(curve.filled, measured, np.nan)
        panel.plot(degrees, hollow, "o", ms=2.4, mew=0.5, mfc="none", mec=FILLED_COLOUR, label="filled")


def _left_over(panel: Axes, curve: Curve) -> None:
    """Draw the residual of M00 in % of the table's, with the table's own standard error as a band."""
    first, degrees = np.where(curve.filled, np.nan, _first(curve.measured)), np.degrees(curve.theta_d)
    error = _error_of_first(curve)
    if error is not None:
        share = np.clip(100 * error / first, 0, MOST_PERCENT)
        panel.fill_between(degrees, -share, share, color=MEASURED_COLOUR, alpha=0.2, lw=0)
    for model, style in zip(curve.models.values(), _styles(), strict=False):
        percent = 100 * (_first(model) / first - 1)
        shown = np.where(np.abs(percent) <= MOST_PERCENT, percent, np.nan)
        panel.plot(degrees, shown, color=style[0], ls=style[1], lw=1.2)
    panel.axhline(0.0, color="#555555", lw=0.6)


def _styles() -> Iterator[tuple[str, Dashes]]:
    return cycle(MODEL_STYLES)


def _first(mueller: NDArray[np.floating]) -> Float:
    first = np.asarray(mueller[..., 0, 0], dtype=np.float64)
    return np.where(first > 0, first, np.nan)


def _polarised(mueller: NDArray[np.floating]) -> Float:
    return np.asarray(mueller[..., 1, 0], dtype=np.float64) / _first(mueller)


def _error_of_first(curve: Curve) -> Float | None:
    return None if curve.variance is None else np.sqrt(curve.variance[..., 0, 0].astype(np.float64))


def _error_of_polarised(curve: Curve) -> Float | None:
    """First order, as if M10 and M00 were independent."""
    if curve.variance is None:
        return None
    first, ratio = _first(curve.measured), _polarised(curve.measured)
    error: Float = np.sqrt(curve.variance[..., 1, 0] + ratio**2 * curve.variance[..., 0, 0]) / first
    return error


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
        for title, model in curve.models.items():
            off = np.abs(_first(model) / np.where(curve.filled, np.nan, first) - 1)
            if np.isfinite(off).any():
                text += f" {title} is off by {number(100 * float(np.nanmedian(off)), 2)} % there (median)."
    return text
