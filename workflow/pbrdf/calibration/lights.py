"""Where the light stands at every angle of the arm, and how its generator is turned."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pbrdf.formats.documents import numbers, positive, read_document, unit_vector
from pbrdf.optics.arm import Arm

KIND = "lights/1"


def read_lights(path: str | Path) -> Arm:
    """Read ``lights.json``; raises `InputError` if a value is missing or a direction is none."""
    content = read_document(path, KIND)
    x, y, z = numbers(path, content, "centre_mm", 3)
    return Arm(
        centre_mm=(x, y, z),
        axis=unit_vector(path, content, "axis"),
        start=unit_vector(path, content, "start"),
        radius_mm=positive(path, content, "radius_mm"),
        generator_axis=unit_vector(path, content, "generator_axis"),
    )


def nominal_lights(arm: Arm) -> dict[str, Any]:
    """Content of ``lights.json`` for a known arm."""
    return {
        "source": "nominal",
        "centre_mm": list(arm.centre_mm),
        "axis": list(arm.axis),
        "start": list(arm.start),
        "radius_mm": arm.radius_mm,
        "generator_axis": list(arm.generator_axis),
    }
