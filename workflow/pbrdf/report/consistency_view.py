"""How far measurements of one matrix disagree, for a material's page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from pbrdf.report.consistency_map import NAMES, consistency_map
from pbrdf.report.figures import Float, Picture, number, picture

STYLES = {"mirror": ("#0072B2", "o"), "exchange": ("#D55E00", "s")}
"""Okabe and Ito's colours, and markers that stay apart without them."""


def consistency_view(content: Mapping[str, Any]) -> dict[str, Any] | None:
    """Rows of the table of symmetries, from a document ``pbrdf/consistency/2``.

    Returns
    -------
    dict or None
        `pooled`, a row for each symmetry and band, a `picture` over θd, and a `map` over θh and θd; None
        where there is no pair.
    """
    rows = [
        {
            "name": NAMES[kind],
            "band": f"{band} nm",
            "pairs": told["pairs"],
            "m00_percent": 100 * told["relative"][0],
            "other_percent": 100 * max(told["relative"][1:]),
            "standard_errors": _root_mean_square(told["standard_errors"]),
        }
        for kind in NAMES
        for band, told in content[kind]["by_band_nm"].items()
        if told["pairs"] and None not in told["relative"]
    ]
    if not rows:
        return None
    pictures = {"picture": _drawn(content), "map": consistency_map(content)}
    return {"pooled": content["pooled"], "rows": rows, **pictures}


def _drawn(content: Mapping[str, Any]) -> Picture:
    """Draw how far symmetric measurements disagree along θd, in parts of M00 and in standard errors."""
    angles = np.array(content["theta_d_deg"])
    lines = {kind: _lines(content[kind]["along_theta_d"]) for kind in NAMES}
    labels = ("M00, % of M00", "largest other element, % of M00", "rms in standard errors")
    shown = [i for i in range(len(labels)) if any(np.isfinite(line[i]).any() for line in lines.values())]

    def draw(figure: Figure) -> None:
        axes = figure.subplots(1, len(shown), squeeze=False)[0]
        figure.subplots_adjust(left=0.06, right=0.99, top=0.84, bottom=0.17, wspace=0.24)
        for panel, index in zip(axes, shown, strict=True):
            for kind, (colour, marker) in STYLES.items():
                panel.plot(
                    angles,
                    lines[kind][index],
                    marker,
                    ls="-",
                    ms=2.8,
                    lw=0.9,
                    color=colour,
                    label=NAMES[kind],
                )
            panel.set_ylabel(labels[index])
            panel.set_xlabel("θd, °")
            panel.set_xlim(0, 90)
            panel.set_xticks(range(0, 91, 15))
            panel.set_ylim(bottom=0)
            panel.grid(True)
            if index == labels.index("rms in standard errors"):
                panel.axhline(1.0, color="#555555", lw=1.2, ls="--", label="noise alone")
        handles, names = axes[-1].get_legend_handles_labels()
        figure.legend(handles, names, loc="upper right", ncols=3, frameon=False, borderaxespad=0.2)

    return picture((9.4, 2.9), draw, _words(angles, lines, [labels[i] for i in shown]))


def _lines(told: Mapping[str, Any]) -> tuple[Float, Float, Float]:
    """Of M00, of the largest other element (both in %), and in standard errors, each over θd."""
    relative = 100 * np.array(told["relative"], dtype=np.float64)
    errors = np.array(told["standard_errors"], dtype=np.float64)
    others = np.where(np.isnan(relative[:, 1:]), -np.inf, relative[:, 1:]).max(axis=1)
    known = np.isfinite(errors)
    squares = np.where(known, errors, 0.0) ** 2
    with np.errstate(invalid="ignore"):
        rms = np.sqrt(squares.sum(axis=1) / known.sum(axis=1))
    return relative[:, 0], np.where(np.isfinite(others), others, np.nan), rms


def _words(angles: Float, lines: Mapping[str, tuple[Float, Float, Float]], labels: Sequence[str]) -> str:
    text = f"Disagreement of symmetric measurements over θd: {'; '.join(labels)}."
    for kind, (first, _, rms) in lines.items():
        values, unit = (rms, "standard errors") if np.isfinite(rms).any() else (first, "% of M00")
        if np.isfinite(values).any():
            most = int(np.nanargmax(values))
            text += f" {NAMES[kind].capitalize()}: at most {number(float(values[most]))} {unit}, "
            text += f"at θd = {number(float(angles[most]))}°."
    return text


def _root_mean_square(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return (sum(value**2 for value in known) / len(known)) ** 0.5 if known else None
