"""What ``lights.json`` tells of an arm whose lights were measured."""

from __future__ import annotations

from typing import Any

from pbrdf.calibration.arm_fit import ArmFit
from pbrdf.optics.arm import Vector
from pbrdf.settings.plan import light_id


def measured_lights(fit: ArmFit, generator_axis: Vector) -> dict[str, Any]:
    """Content of ``lights.json`` for an arm fitted to highlights.

    Parameters
    ----------
    fit : ArmFit
    generator_axis : Vector
        x axis of the generator's frame at angle zero, `pbrdf.optics.arm.generator_axis_at_zero`.
    """
    return {
        "source": "measured",
        "verdict": fit.verdict,
        "notes": list(fit.notes),
        "centre_mm": list(fit.centre_mm),
        "axis": list(fit.axis),
        "start": list(fit.start),
        "radius_mm": fit.radius_mm,
        "generator_axis": list(generator_axis),
        "offsets_mm": {light_id(angle): list(offset) for angle, offset in fit.offsets_mm.items()},
        "standard_errors": {
            "centre_mm": list(fit.centre_errors_mm),
            "axis_deg": fit.axis_error_deg,
            "start_deg": fit.start_error_deg,
            "radius_mm": fit.radius_error_mm,
            "direction_deg": {light_id(angle): error for angle, error in fit.direction_errors_deg.items()},
        },
        "residuals_px": {
            light_id(angle): [list(pair) for pair in pairs] for angle, pairs in fit.residuals_px.items()
        },
    }
