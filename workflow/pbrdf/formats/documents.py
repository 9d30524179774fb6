"""Small JSON documents: each says what it is, and is written whole or not at all."""

from __future__ import annotations

import json
import math
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pbrdf.errors import InputError


def write_text(path: str | Path, text: str) -> None:
    """Write beside, then rename, so that `path` never holds half a text."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, beside = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=".part")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as stream:
            stream.write(text)
        Path(beside).chmod(0o644)
        Path(beside).replace(path)
    except BaseException:
        Path(beside).unlink(missing_ok=True)
        raise


def write_document(path: str | Path, kind: str, content: Mapping[str, Any]) -> None:
    """Write a JSON document of schema ``pbrdf/<kind>``; the same content gives the same bytes."""
    text = json.dumps({"schema": f"pbrdf/{kind}", **content}, indent=1, allow_nan=False, ensure_ascii=False)
    write_text(path, text + "\n")


def read_any(path: str | Path) -> dict[str, Any]:
    """Read a JSON document of whatever schema.

    Raises
    ------
    InputError
        If the file is missing, not a JSON object, or holds a number that is not finite.
    """
    path = Path(path)
    try:
        content = json.loads(path.read_text(encoding="utf-8"), parse_constant=_not_finite)
    except FileNotFoundError:
        raise InputError(path, "file", "does not exist", "correct the path, or make the file first") from None
    except (ValueError, RecursionError) as error:
        raise InputError(path, "file", f"is not JSON ({error})", "correct it, or make it again") from None
    if not isinstance(content, dict):
        raise InputError(path, "file", "is not a JSON object", "give a document of this program")
    return content


def read_document(path: str | Path, kind: str) -> dict[str, Any]:
    """Read a JSON document and check that it is of schema ``pbrdf/<kind>``; raises `InputError`."""
    content = read_any(path)
    if content.get("schema") != f"pbrdf/{kind}":
        raise InputError(
            path, "schema", f"is {content.get('schema')!r}", f"give a file of schema `pbrdf/{kind}`"
        )
    return content


def member(path: str | Path, content: Mapping[str, Any], field: str) -> Any:
    """Value at a dotted `field` of a document; raises `InputError` where there is none."""
    value: Any = content
    for part in field.split("."):
        if not isinstance(value, Mapping) or part not in value:
            raise InputError(path, field, "is missing", "add it, or make the file again")
        value = value[part]
    return value


def number(path: str | Path, content: Mapping[str, Any], field: str) -> float:
    """Finite number at a dotted `field`; raises `InputError` otherwise."""
    value = member(path, content, field)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise InputError(path, field, f"is {value!r}", "give a finite number")
    return float(value)


def numbers(path: str | Path, content: Mapping[str, Any], field: str, length: int) -> tuple[float, ...]:
    """`length` finite numbers at a dotted `field`; raises `InputError` otherwise."""
    values = member(path, content, field)
    if not isinstance(values, list) or len(values) != length:
        raise InputError(path, field, f"is {values!r}", f"give {length} numbers")
    return tuple(number(path, {"value": value}, "value") for value in values)


def _not_finite(name: str) -> float:
    raise ValueError(f"{name} is not a number of JSON")
