"""Where on a table measurements of one matrix disagree: a wrong geometry shows as a place, noise nowhere."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from pbrdf.report.coverage_maps import node_map
from pbrdf.report.figures import Float, Picture, number, picture
from pbrdf.report.scales import from_zero, round_up

NAMES = {"mirror": "mirror image, −φd", "exchange": "light and camera exchanged, φd ± 180°"}
MOST_ERRORS = 3.0
"""Standard errors that take the last colour."""


def consistency_map(content: Mapping[str, Any]) -> Picture:
    """Draw over θh and θd how far symmetric measurements disagree, all azimuths and bands together.

    Parameters
    ----------
    content : mapping
        Of a document ``pbrdf/consistency/2`` that compares something.

    Returns
    -------
    Picture
        In standard errors where the table has variances, else that of M00 in parts of M00.
    """
    theta_h, theta_d = (np.radians(content[f"{name}_deg"]) for name in ("theta_h", "theta_d"))
    errors, relative = (_maps(content, field) for field in ("standard_errors", "m00_relative"))
    in_errors = any(np.isfinite(values).any() for values in errors.values())
    shown = errors if in_errors else {kind: 100 * values for kind, values in relative.items()}
    known = np.concatenate([values[np.isfinite(values)] for values in shown.values()])
    if in_errors:
        label = "rms in standard errors; noise alone makes 1, the last colour is 3 and above"
        scale = from_zero(MOST_ERRORS, label)
    else:
        high = float(np.percentile(known, 95))
        label = "mean |difference| of M00, % of M00; the last colour is its upper bound and above"
        scale = from_zero(round_up(high) if high > 0 else 1.0, label)

    def draw(figure: Figure) -> None:
        panels = figure.subplots(1, 2)
        figure.subplots_adjust(left=0.07, right=0.985, top=0.9, bottom=0.3, wspace=0.16)
        for axes, (kind, values) in zip(panels, shown.items(), strict=True):
            node_map(axes, scale.paint(values, np.isfinite(values)), theta_h, theta_d)
            axes.set_title(NAMES[kind].capitalize(), loc="left")
        box = panels[0].get_position()
        scale.draw_bar(figure, box.x0, 0.13, box.width, 0.03)

    unit = "standard errors" if in_errors else "% of M00"
    return picture((9.4, 4.4), draw, _words(content, shown, unit))


def _maps(content: Mapping[str, Any], field: str) -> dict[str, Float]:
    return {kind: np.array(content[kind]["by_node"][field], dtype=np.float64) for kind in NAMES}


def _words(content: Mapping[str, Any], shown: Mapping[str, Float], unit: str) -> str:
    text = "Maps over θh and θd of how far symmetric measurements disagree."
    for kind, values in shown.items():
        if not np.isfinite(values).any():
            continue
        half, difference = np.unravel_index(np.nanargmax(values), values.shape)
        text += f" {NAMES[kind].capitalize()}: median {number(float(np.nanmedian(values)))}, "
        place = (content["theta_h_deg"][half], content["theta_d_deg"][difference])
        text += f"at most {number(float(values[half, difference]))} {unit}, "
        text += f"at θh = {number(place[0])}°, θd = {number(place[1])}°."
    return text
