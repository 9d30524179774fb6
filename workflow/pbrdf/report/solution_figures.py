"""How a Mueller image was solved for, as its receipt tells it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

_NOISE = {
    "radiometry": "from the radiometric calibration of the camera",
    "residuals": "from the residuals over the whole image",
    "unknown": "not known: sixteen states leave no residuals",
}


def solution_figures(summary: Mapping[str, Any], unit: str) -> list[dict[str, Any]]:
    """Figures of a solution, those that its receipt holds: label, value (number or words), unit.

    Parameters
    ----------
    summary : mapping
        The band's entry in the summary of the light's receipt.
    unit : str
        Unit of the residuals.
    """
    known = [
        ("residual_rms", "residual of the measured intensities, rms", 1.0, unit),
        ("predicted_residual_rms", "residual that the noise predicts, rms", 1.0, unit),
        ("condition", "condition number of the measurement matrix W (no unit)", 1.0, ""),
        ("physical_share", "physical matrices, share when reconstructed", 100.0, "%"),
        ("weighted_share", "pixels weighted, their states differing in exposures", 100.0, "%"),
    ]
    figures: list[dict[str, Any]] = [
        {"label": label, "value": factor * summary[key], "unit": shown}
        for key, label, factor, shown in known
        if summary.get(key) is not None
    ]
    least, greatest = summary.get("drift", (1.0, 1.0))
    if least != greatest:
        words = f"{100 * least:.2f} to {100 * greatest:.2f}"
        figures.append({"label": "power of the lamp meanwhile, corrected", "value": words, "unit": "%"})
    for reason, share in summary.get("missing", {}).items():
        figures.append({"label": f"missing pixels: {reason}", "value": 100.0 * share, "unit": "%"})
    if "noise" in summary:
        words = _NOISE.get(summary["noise"], summary["noise"])
        figures.append({"label": "variance of the elements", "value": words, "unit": ""})
    return figures
