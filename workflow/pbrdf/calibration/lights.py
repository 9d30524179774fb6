"""Where the light stands at every angle of the arm, and how its generator is turned."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pbrdf.errors import InputError
from pbrdf.formats.documents import numbers, positive, read_document, unit_vector
from pbrdf.optics.arm import Arm, Vector, angle_key

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
