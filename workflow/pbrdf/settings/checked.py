"""YAML files held against their schema, with one line for the first thing that is wrong."""

from __future__ import annotations

from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import yaml

from pbrdf.errors import InputError

SCHEMAS = Path(__file__).parent


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
    path = Path(path)
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(path, "file", "does not exist", "correct the path to it") from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise InputError(path, "file", f"is not YAML ({error})", "correct its syntax") from None
    return check(content, kind, path)


def check(content: object, kind: str, source: str | Path) -> dict[str, Any]:
    """Hold content against the schema of its kind and fill in defaults; raises `InputError`."""
    validator = jsonschema.Draft202012Validator(_schema(kind))
    error = jsonschema.exceptions.best_match(validator.iter_errors(content))
    if error is not None:
        raise InputError(source, *_explained(error))
    assert isinstance(content, dict)
    return _with_defaults(content, _schema(kind))


@cache
def _schema(kind: str) -> dict[str, Any]:
    schema: dict[str, Any] = yaml.safe_load((SCHEMAS / f"{kind}.schema.yaml").read_text(encoding="utf-8"))
    return schema


def _explained(error: jsonschema.exceptions.ValidationError) -> tuple[str, str, str]:
    """Field, problem and remedy of a schema error."""
    field = ".".join(str(part) for part in error.absolute_path) or "top level"
    if error.validator == "additionalProperties":
        known = sorted(error.schema.get("properties", {}))
        unknown = sorted(set(error.instance) - set(known))
        near = get_close_matches(unknown[0], known, n=1)
        remedy = f"did you mean `{near[0]}`?" if near else f"known keys are {', '.join(known)}"
        return field, f"unknown key `{unknown[0]}`", remedy
    wanted = error.schema.get("description")
    return field, error.message, f"give {wanted}" if wanted else "see config/README.md"


def _with_defaults(content: dict[str, Any], schema: dict[str, Any]) -> dict[str, Any]:
    filled = dict(content)
    for name, part in schema.get("properties", {}).items():
        if name not in filled and "default" in part:
            filled[name] = part["default"]
        if isinstance(filled.get(name), dict):
            filled[name] = _with_defaults(filled[name], part)
    return filled
