"""YAML files held against their schema, with one line for the first thing that is wrong."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from copy import deepcopy
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import yaml

from pbrdf.errors import InputError
from pbrdf.formats.yaml_file import read_yaml

SCHEMAS = Path(__file__).parent
WIDEST_VALUE = 60

# JSON Schema takes 450.0 for an integer; names of folders and ranges do not
_Validator = jsonschema.validators.extend(  # type: ignore[no-untyped-call]
    jsonschema.Draft202012Validator,
    type_checker=jsonschema.Draft202012Validator.TYPE_CHECKER.redefine(
        "integer", lambda _, value: isinstance(value, int) and not isinstance(value, bool)
    ),
)


def read_checked(path: str | Path, kind: str) -> dict[str, Any]:
    """Read a YAML file and hold it against the schema of its kind.

    Parameters
    ----------
    path : str or Path
        The file.
    kind : {"config", "rig"}
        Which schema.

    Returns
    -------
    dict
        The content, defaults filled in.

    Raises
    ------
    InputError
        If the file is missing, not YAML, or not as the schema says.
    """
    return check(read_yaml(path), kind, path)


def check(content: object, kind: str, source: str | Path) -> dict[str, Any]:
    """Hold content against the schema of its kind and fill in defaults; raises `InputError`."""
    _refuse_what_no_schema_knows(content, source, "")
    schema = _schema(kind)
    error = jsonschema.exceptions.best_match(_Validator(schema).iter_errors(content))
    if error is not None:
        raise InputError(source, *_explained(error, schema))
    assert isinstance(content, dict)
    return _with_defaults(content, schema)


@cache
def _schema(kind: str) -> dict[str, Any]:
    text = (SCHEMAS / f"{kind}.schema.yaml").read_text(encoding="utf-8")
    # ten times as fast as the loader in Python, at every start of the workflow
    schema: dict[str, Any] = yaml.load(text, yaml.CSafeLoader)
    return schema


def _refuse_what_no_schema_knows(content: object, source: str | Path, field: str) -> None:
    """Refuse keys that are not text and numbers that are not finite: YAML has them, JSON Schema does not."""
    if isinstance(content, dict):
        for key, value in content.items():
            if not isinstance(key, str):
                raise InputError(
                    source, field or "top level", f"the key {key} is no text", f'write it as "{key}"'
                )
            _refuse_what_no_schema_knows(value, source, f"{field}.{key}" if field else key)
    elif isinstance(content, list):
        for index, value in enumerate(content):
            _refuse_what_no_schema_knows(value, source, f"{field}.{index}" if field else str(index))
    elif isinstance(content, float) and not math.isfinite(content):
        raise InputError(source, field or "top level", f"is {content}", "give a finite number")


def _explained(error: jsonschema.exceptions.ValidationError, schema: dict[str, Any]) -> tuple[str, str, str]:
    """Field, problem and remedy of a schema error."""
    path = [str(part) for part in error.absolute_path]
    field = ".".join(path) or "top level"
    # jsonschema marks what an error may lack with a type of its own
    part: Any = error.schema
    found: Any = error.instance
    if error.validator == "additionalProperties":
        return field, *_unknown_key(found, part)
    if error.validator == "required":
        names: Any = error.validator_value
        missing = next(name for name in names if name not in found)
        wanted = part.get("properties", {}).get(missing, {}).get("description")
        return ".".join([*path, missing]), "is missing", f"give {wanted}" if wanted else "add it"
    if found is None and path:
        return field, "is empty", "give its keys, or delete the line"
    wanted = _description(schema, error.absolute_schema_path)
    if error.validator == "type" and _is_number_to_a_reader(found):
        remedy = f"YAML takes it for text: write {_as_yaml(float(found))}, without quotes"
        return field, f"{found!r} is no number", remedy
    message = error.message.replace(repr(found), _short(repr(found)), 1)
    if wanted:
        return field, message, f"give {wanted}"
    return field, message, "correct it" if path else "write a line `key: value` for each setting"


def _unknown_key(content: dict[str, Any], schema: dict[str, Any]) -> tuple[str, str]:
    """Problem and remedy of a key that the schema does not have."""
    patterns = schema.get("patternProperties", {})
    known = sorted(schema.get("properties", {}))
    unknown = next(
        key for key in content if key not in known and not any(re.search(p, key) for p in patterns)
    )
    near = get_close_matches(unknown, known, n=1)
    if near:
        remedy = f"did you mean `{near[0]}`?"
    elif known:
        remedy = f"known keys are {', '.join(known)}"
    else:
        remedy = f"keys look like {', '.join(patterns)}"
    return f"unknown key `{unknown}`", remedy


def _description(schema: dict[str, Any], path: Iterable[str | int]) -> str | None:
    """What the innermost described part of the schema on the way to an error says is wanted there."""
    part: Any = schema
    found = None
    for step in path:
        part = part[step]
        if isinstance(part, dict) and isinstance(part.get("description"), str):
            found = part["description"]
    return found


def _is_number_to_a_reader(value: object) -> bool:
    """Whether a text is a number such as ``2.9e6``, for which YAML 1.1 wants ``2.9e+6``."""
    try:
        return isinstance(value, str) and math.isfinite(float(value))
    except ValueError:
        return False


def _as_yaml(value: float) -> str:
    """A number as YAML 1.1 reads it: with a point before the exponent."""
    mantissa, letter, exponent = repr(value).partition("e")
    return f"{mantissa if '.' in mantissa else mantissa + '.0'}{letter}{exponent}"


def _short(text: str) -> str:
    return text if len(text) <= WIDEST_VALUE else f"{text[: WIDEST_VALUE - 1]}…"


def _with_defaults(content: dict[str, Any], schema: dict[str, Any]) -> dict[str, Any]:
    filled = dict(content)
    for name, part in schema.get("properties", {}).items():
        if name not in filled and "default" in part:
            filled[name] = deepcopy(part["default"])
        if isinstance(filled.get(name), dict):
            filled[name] = _with_defaults(filled[name], part)
    return filled
