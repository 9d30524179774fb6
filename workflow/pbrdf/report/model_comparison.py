"""Fitted models beside their table: errors, DoLP along θd, Brewster's angle, reflectance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from pbrdf.report.figures import Picture, number, picture
from pbrdf.report.fit_view import model_title

COLOURS = ("#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
MEASURED_COLOUR = "#0072B2"
_BARS = 2.0
"""Standard errors that a bar reaches to either side."""


def comparison_view(content: Mapping[str, Any], band: int) -> dict[str, Any]:
    """Gather what a page shows of a document ``pbrdf/comparison/1``; the curves are those of `band`."""
    wavelength = content["wavelengths"]["values"][band]
    names = [model["model"] for model in content["models"]]
    return {
        "words": content["words"],
        "titles": [model_title(name) for name in names],
        "wavelength": wavelength,
        "models": [_model_row(model, band) for model in content["models"]],
        "unit": _cost_unit(content["models"]),
        "dolp": _dolp_picture([c for c in content["dolp"] if c["wavelength_nm"] == wavelength], wavelength),
        "brewster": [
            {
                "wavelength": angle["wavelength_nm"],
                "measured": angle["measured_deg"],
                "error": angle["standard_error_deg"],
                "models": [angle["models"][name] for name in names],
            }
            for angle in content["brewster"]
        ],
        "reflectance": [
            {
                "angle": albedo["theta_i_deg"],
                "measured": albedo["measured"]["value"],
                "known": 100 * albedo["measured"]["known"],
                "models": [albedo["models"][name] for name in names],
            }
            for albedo in content["albedo"]
            if albedo["wavelength_nm"] == wavelength
        ],
    }


def _cost_unit(models: Sequence[Mapping[str, Any]]) -> str:
    unit = str(models[0]["fitted"]["cost"]["unit"])
    return "no unit" if unit == "1" else unit


def _model_row(model: Mapping[str, Any], band: int) -> dict[str, Any]:
    relative = np.array(model["fitted"]["relative"]["values"][band])
    others = relative.copy()
    others[0, 0] = 0.0
    row, column = np.unravel_index(int(others.argmax()), others.shape)
    held = model["held_out"]
    return {
        "title": model_title(model["model"]),
        "cost": model["fitted"]["cost"]["per_node"],
        "held_out": None if held is None else held["cost"]["per_node"],
        "first": 100 * float(relative[0, 0]),
        "other": 100 * float(others[row, column]),
        "element": f"M{row}{column}",
    }


def _dolp_picture(curves: Sequence[Mapping[str, Any]], wavelength: float) -> Picture:
    """Draw the table's DoLP with its error bars, and a line for each model, one panel a θh."""

    def draw(figure: Figure) -> None:
        axes = figure.subplots(1, len(curves), sharey=True, squeeze=False)[0]
        figure.subplots_adjust(left=0.075, right=0.99, top=0.74, bottom=0.17, wspace=0.06)
        title = f"Degree of linear polarisation at {number(wavelength, 4)} nm"
        figure.text(0.075, 0.975, title, fontsize=8.5, weight="bold", va="top")
        for panel, curve in zip(axes, curves, strict=True):
            angles = np.array(curve["theta_d_deg"])
            measured = np.array(curve["measured"], dtype=np.float64)
            errors = np.nan_to_num(_BARS * np.array(curve["standard_error"], dtype=np.float64))
            panel.errorbar(
                angles,
                measured,
                errors,
                fmt="o",
                ms=2.6,
                mew=0,
                elinewidth=0.7,
                color=MEASURED_COLOUR,
                label="table ± 2 standard errors",
            )
            for (name, values), colour in zip(curve["models"].items(), COLOURS, strict=False):
                panel.plot(angles, values, lw=1.2, color=colour, label=model_title(name))
            panel.set_title(f"θh = {number(curve['theta_h_deg'])}°", loc="left")
            panel.set_xlim(0, 90)
            panel.set_xticks(range(0, 91, 15))
            panel.set_ylim(0, 1.05)
            panel.set_xlabel("θd, °")
            panel.grid(True)
        axes[0].set_ylabel("DoLP, no unit")
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(
            handles,
            labels,
            loc="upper right",
            ncols=3,
            frameon=False,
            borderaxespad=0.2,
            bbox_to_anchor=(1, 1),
        )

    return picture((9.4, 3.4), draw, _words(curves, wavelength))


def _words(curves: Sequence[Mapping[str, Any]], wavelength: float) -> str:
    text = f"Degree of linear polarisation of unpolarised light against θd at {number(wavelength, 4)} nm."
    for curve in curves:
        at = f" θh = {number(curve['theta_h_deg'])}°:"
        known = [
            (value, angle)
            for value, angle in zip(curve["measured"], curve["theta_d_deg"], strict=True)
            if value is not None
        ]
        if not known:
            text += f"{at} nothing known."
            continue
        most, angle = max(known)
        text += f"{at} the table's largest is {number(most)} at {number(angle)}°"
        peaks = [f"{model_title(name)} {number(max(values))}" for name, values in curve["models"].items()]
        text += f"; of models: {', '.join(peaks)}."
    return text
