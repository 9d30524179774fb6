"""Where the light stands at every angle of the arm, and how its generator is turned."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pbrdf.errors import InputError
from pbrdf.formats.documents import number, numbers, read_document
from pbrdf.optics.arm import Arm, Vector

KIND = "lights/1"


def read_lights(path: str | Path) -> Arm:
    """Read ``lights.json``; raises `InputError` if a value is missing or a direction is none."""
    content = read_document(path, KIND)
    return Arm(
        centre_mm=_vector(path, content, "centre_mm"),
        axis=_unit(path, content, "axis"),
        start=_unit(path, content, "start"),
        radius_mm=number(path, content, "radius_mm"),
        generator_axis=_unit(path, content, "generator_axis"),
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


def _vector(path: str | Path, content: Mapping[str, Any], field: str) -> Vector:
    x, y, z = numbers(path, content, field, 3)
    return x, y, z


def _unit(path: str | Path, content: Mapping[str, Any], field: str) -> Vector:
    vector = np.array(_vector(path, content, field))
    length = np.linalg.norm(vector)
    if not 0.999 < length < 1.001:
        raise InputError(path, field, f"has length {length:.4g}", "give a unit vector")
    x, y, z = (float(value) for value in vector / length)
    return x, y, z
