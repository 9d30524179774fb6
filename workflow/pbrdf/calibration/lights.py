"""Where the light stands at every angle of the arm, and how its generator is turned."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pbrdf.calibration.arm_fit import ArmFit
from pbrdf.calibration.arm_problem import angle_key
from pbrdf.errors import InputError
from pbrdf.formats.documents import numbers, positive, read_document, unit_vector
from pbrdf.optics.arm import Arm, Vector
from pbrdf.settings.plan import light_id

KIND = "lights/1"


def read_lights(path: str | Path) -> Arm:
    """Read ``lights.json``.

    Raises
    ------
    InputError
        If a value is missing, a direction or an angle is none, or the calibration's own verdict is that it
        is unusable.
    """
    content = read_document(path, KIND)
    verdict = content.get("verdict")
    if isinstance(verdict, str) and verdict.startswith("unusable"):
        raise InputError(path, "verdict", verdict, "calibrate the lights again")
    x, y, z = numbers(path, content, "centre_mm", 3)
    return Arm(
        centre_mm=(x, y, z),
        axis=unit_vector(path, content, "axis"),
        start=unit_vector(path, content, "start"),
        radius_mm=positive(path, content, "radius_mm"),
        generator_axis=unit_vector(path, content, "generator_axis"),
        offsets_mm=_offsets(path, content) if "offsets_mm" in content else {},
    )


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


def _offsets(path: str | Path, content: Mapping[str, Any]) -> dict[float, Vector]:
    entries = content["offsets_mm"]
    if not isinstance(entries, Mapping):
        raise InputError(path, "offsets_mm", f"is {entries!r}", "give an object with an entry an angle")
    offsets: dict[float, Vector] = {}
    for name in entries:
        try:
            angle = float(name)
        except ValueError:
            angle = math.nan
        if not math.isfinite(angle):
            raise InputError(path, f"offsets_mm.{name}", "is no angle", "name it by degrees, as 041.00")
        try:
            x, y, z = numbers(path, {"offset": entries[name]}, "offset", 3)
        except InputError as error:
            # the dot in the name would part it into fields
            raise InputError(path, f"offsets_mm.{name}", error.problem, error.remedy) from None
        offsets[angle_key(angle)] = (x, y, z)
    return offsets
