"""Small JSON documents: each says what it is, and is written whole or not at all."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pbrdf.errors import InputError
from pbrdf.formats.beside import replace_file

LONGEST_NM = 6
"""Digits of a wavelength in nm: more are no light, and Python refuses to read thousands of them."""


def write_text(path: str | Path, text: str) -> None:
    """Write beside, then rename, so that `path` never holds half a text."""
    with replace_file(path) as beside:
        beside.write_text(text, encoding="utf-8")


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
        text = path.read_text(encoding="utf-8")
        content = json.loads(text, parse_constant=_not_finite, parse_float=_finite)
    except FileNotFoundError:
        raise InputError(path, "file", "does not exist", "correct the path, or make the file first") from None
    except OSError as error:
        raise InputError(path, "file", f"cannot be read ({error.strerror})", "correct the path") from None
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
    return _number(path, field, value)


def positive(path: str | Path, content: Mapping[str, Any], field: str) -> float:
    """Number above zero at a dotted `field`; raises `InputError` otherwise."""
    value = number(path, content, field)
    if value <= 0:
        raise InputError(path, field, f"is {value:g}", "give a number above zero")
    return value


def numbers(path: str | Path, content: Mapping[str, Any], field: str, length: int) -> tuple[float, ...]:
    """`length` finite numbers at a dotted `field`; raises `InputError` otherwise."""
    values = member(path, content, field)
    if not isinstance(values, list) or len(values) != length:
        raise InputError(path, field, f"is {values!r}", f"give {length} numbers")
    return tuple(_number(path, f"{field}[{index}]", value) for index, value in enumerate(values))


def wavelengths(path: str | Path, content: Mapping[str, Any], field: str) -> dict[int, str]:
    """Keys of the object at a dotted `field`, by the whole nm they name; raises `InputError` otherwise."""
    value = member(path, content, field)
    if not isinstance(value, Mapping) or not value:
        raise InputError(path, field, f"is {value!r}", "give an object with an entry a band")
    for name in value:
        if not (name.isascii() and name.isdecimal() and len(name) <= LONGEST_NM):
            raise InputError(path, f"{field}.{name}", "is not a wavelength", "name bands by whole nm")
    return {int(name): name for name in value}


def unit_vector(path: str | Path, content: Mapping[str, Any], field: str) -> tuple[float, float, float]:
    """Direction at a dotted `field`, made of length 1; raises `InputError` if it is far from that."""
    x, y, z = numbers(path, content, field, 3)
    length = math.hypot(x, y, z)
    if not 0.999 < length < 1.001:
        raise InputError(path, field, f"has length {length:.4g}", "give a unit vector")
    return x / length, y / length, z / length


def _number(path: str | Path, field: str, value: object) -> float:
    if isinstance(value, int | float) and not isinstance(value, bool):
        try:
            found = float(value)
        except OverflowError:
            found = math.inf
        if math.isfinite(found):
            return found
    raise InputError(path, field, f"is {value!r}", "give a finite number")


def _finite(text: str) -> float:
    value = float(text)
    return value if math.isfinite(value) else _not_finite(text)


def _not_finite(text: str) -> float:
    raise ValueError(f"{text} is not a finite number")
