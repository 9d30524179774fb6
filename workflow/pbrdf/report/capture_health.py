"""Is this capture good? What the receipts of a material's Mueller images say of each light."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from pbrdf.formats.receipt import receipt_summary
from pbrdf.report.curves import MODEL_STYLES
from pbrdf.report.figures import Picture, number, picture

NOTICEABLE = {
    "residual": ("residuals", 1.2),
    "saturated_percent": ("saturation", 1.0),
    "drift_percent": ("drift", 2.0),
}
"""From where on a light is named: residuals over their prediction, saturated pixels, drift of the lamp."""


@dataclass(frozen=True)
class LightHealth:
    """One light in one band.

    Attributes
    ----------
    light, band : str
    angle_deg : float
        Of the arm.
    residual : float
        Rms residual of the intensities over what the noise predicts; NaN where nothing predicts it.
    saturated_percent, missing_percent : float
        Pixels that are saturated, and those that miss for any reason.
    drift_percent : float
        Largest departure of the lamp's power from its mean, corrected.
    physical_percent : float
        Pixels with a physical matrix.
    """

    light: str
    band: str
    angle_deg: float
    residual: float
    saturated_percent: float
    missing_percent: float
    drift_percent: float
    physical_percent: float


def lights_health(receipts: Sequence[str | Path]) -> list[LightHealth]:
    """Read what the receipts of Mueller images say; raises `InputError` if one is none."""
    return [
        _health(Path(receipt).stem, band, summary)
        for receipt in receipts
        for band, summary in receipt_summary(receipt).items()
    ]


def health_view(found: Sequence[LightHealth]) -> dict[str, Any] | None:
    """Gather what the page shows: a sentence, a picture, and a row for each light, its worst band."""
    if not found:
        return None
    lights = list(dict.fromkeys(each.light for each in found))
    rows = [[each for each in found if each.light == light] for light in lights]
    return {
        "words": _sentences(found),
        "picture": _drawn(found),
        "rows": [
            {
                "light": row[0].light,
                "residual": _worst(each.residual for each in row),
                "saturated_percent": _worst(each.saturated_percent for each in row),
                "missing_percent": _worst(each.missing_percent for each in row),
                "drift_percent": _worst(each.drift_percent for each in row),
                "physical_percent": min(each.physical_percent for each in row),
            }
            for row in rows
        ],
    }


def _health(light: str, band: str, summary: Mapping[str, Any]) -> LightHealth:
    predicted = summary.get("predicted_residual_rms")
    measured = summary.get("residual_rms")
    residual = float("nan")
    if predicted and measured is not None:
        residual = float(measured) / float(predicted)
    missing = {name: 100 * float(share) for name, share in summary.get("missing", {}).items()}
    drift = summary.get("drift") or (1.0, 1.0)
    return LightHealth(
        light,
        band,
        float(light),
        residual,
        missing.get("saturated", 0.0),
        sum(missing.values()),
        100 * max(abs(float(power) - 1) for power in drift),
        100 * float(summary.get("physical_share") or 0.0),
    )


def _worst(values: Iterable[float]) -> float:
    known = [value for value in values if np.isfinite(value)]
    return max(known) if known else float("nan")


def _sentences(found: Sequence[LightHealth]) -> str:
    residuals = [each.residual for each in found if np.isfinite(each.residual)]
    words = "Nothing predicts the residuals of these photographs."
    if residuals:
        middle = float(np.median(residuals))
        words = (
            f"The photographs are met within {number(middle, 3)} times the residual that their noise "
            f"predicts (median; {number(max(residuals), 3)} at worst)."
        )
    for field, (noun, limit) in NOTICEABLE.items():
        lights = list(dict.fromkeys(each.light for each in found if getattr(each, field) > limit))
        if lights:
            unit = " %" if field.endswith("percent") else " times the prediction"
            words += f" Look at {noun} (above {limit:g}{unit}) of {', '.join(lights)}."
    if "Look at" not in words:
        words += " No light stands out by residuals, saturation or drift."
    return words


def _drawn(found: Sequence[LightHealth]) -> Picture:
    bands = list(dict.fromkeys(each.band for each in found))
    panels = (
        ("residual", "residual / prediction"),
        ("saturated_percent", "saturated pixels, %"),
        ("drift_percent", "lamp's drift, %"),
    )

    def draw(figure: Figure) -> None:
        axes = figure.subplots(1, len(panels), squeeze=False)[0]
        figure.subplots_adjust(left=0.06, right=0.99, top=0.82, bottom=0.17, wspace=0.24)
        for panel, (field, label) in zip(axes, panels, strict=True):
            for band, (colour, _) in zip(bands, cycle(MODEL_STYLES), strict=False):
                lights = [each for each in found if each.band == band]
                angles = [each.angle_deg for each in lights]
                values = [getattr(each, field) for each in lights]
                panel.plot(angles, values, "o-", ms=2.5, lw=0.8, color=colour, label=band)
            panel.set_ylabel(label)
            panel.set_xlabel("arm, °")
            panel.grid(True)
            panel.set_ylim(bottom=0)
        axes[0].axhline(1.0, color="#555555", lw=0.6)
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="upper right", ncols=6, frameon=False, borderaxespad=0.2)

    alt = "Against the arm's angle, a line a band: residual over its prediction, saturation, lamp's drift."
    return picture((9.4, 2.8), draw, f"{alt} {_sentences(found)}")
