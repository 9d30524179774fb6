"""A file in a few lines of text, for the terminal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pbrdf.errors import InputError
from pbrdf.formats.documents import read_any
from pbrdf.formats.table_data import TableData
from pbrdf.report.figures import Float, number
from pbrdf.report.visibility import ORIGIN_NAMES, coverage, visible_nodes

_LONGEST_LIST = 8


def table_summary(table: TableData) -> dict[str, str]:
    """Tell kind, shape, units, ranges and coverage of a table, by name."""
    grid = (len(table.wavelengths_nm), len(table.theta_h), len(table.theta_d), len(table.phi_d))
    lows, highs, negative, known = [], [], 0, 0
    for band in range(grid[0]):
        first = table.mueller[band, ..., 0, 0][visible_nodes(table, band)]
        first = first[np.isfinite(first)]
        known += first.size
        negative += int(np.count_nonzero(first < 0))
        if first.size:
            lows.append(float(first.min()))
            highs.append(float(first.max()))
    covered = coverage(table)
    lines = {
        "kind": "pBRDF table",
        "shape": f"{grid[0]} bands × {grid[1]} θh × {grid[2]} θd × {grid[3]} φd × 4 × 4",
        "wavelengths": ", ".join(number(w, 4) for w in table.wavelengths_nm) + " nm",
        "θh": _axis(table.theta_h),
        "θd": _axis(table.theta_d),
        "φd": _axis(table.phi_d),
        "M00": f"{number(min(lows))} … {number(max(highs))} 1/sr" if lows else "nothing known",
        "visible": f"{covered.visible} nodes, {number(100 * covered.known)} % of them known",
    }
    if negative:
        lines["M00 below 0"] = f"{negative} of {known} known nodes"
    for origin, share in covered.origins.items():
        lines[ORIGIN_NAMES[origin]] = f"{number(100 * share)} % of the visible nodes"
    lines["holds"] = ", ".join(
        f"{name} {'yes' if getattr(table, name) is not None else 'no'}"
        for name in ("variance", "count", "origin")
    )
    return lines


def document_summary(path: str | Path) -> dict[str, str]:
    """Flatten a JSON document of pbrdf to lines of text, by dotted name.

    Raises
    ------
    InputError
        If the file is no JSON document that says what it is.
    """
    content = read_any(path)
    schema = content.get("schema")
    if not isinstance(schema, str) or not schema.startswith("pbrdf/"):
        raise InputError(path, "schema", f"is {schema!r}", "give a document whose schema begins with pbrdf/")
    return dict(_entries(content))


def _entries(content: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    for name, value in content.items():
        if isinstance(value, Mapping):
            yield from _entries(value, f"{prefix}{name}.")
        elif isinstance(value, list) and (
            len(value) > _LONGEST_LIST or any(isinstance(v, list | Mapping) for v in value)
        ):
            shape = " × ".join(str(n) for n in _shape(value))
            yield prefix + name, f"list of {shape}"
        elif isinstance(value, list):
            yield prefix + name, ", ".join(_scalar(v) for v in value) or "none"
        else:
            yield prefix + name, _scalar(value)


def _shape(value: Any) -> list[int]:
    return [len(value), *_shape(value[0])] if isinstance(value, list) and value else []


def _scalar(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _axis(radians: Float) -> str:
    degrees = np.degrees(radians)
    return f"{number(float(degrees[0]))}° … {number(float(degrees[-1]))}°, {degrees.size} nodes"
