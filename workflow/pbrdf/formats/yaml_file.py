"""YAML files that the user writes: as much of the language as settings need."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from pbrdf.errors import InputError

LARGEST_BYTES = 1 << 20
MOST_NODES = 200_000
"""What a file may hold once its aliases are followed: a few lines of them can stand for 10⁹ values."""


def read_yaml(path: str | Path, remedy: str = "correct its syntax") -> Any:
    """Read a YAML file of plain values.

    Parameters
    ----------
    path : str or Path
    remedy : str, optional
        What to do about a file that is not YAML.

    Raises
    ------
    InputError
        If it is missing, not YAML, larger than settings are, or an alias leads back to itself.
    """
    path = Path(path)
    try:
        if path.stat().st_size > LARGEST_BYTES:
            raise InputError(path, "file", f"is larger than {LARGEST_BYTES} bytes", "give a file of settings")
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(path, "file", "does not exist", "correct the path to it") from None
    except OSError as error:
        problem = f"cannot be read ({error.strerror})"
        raise InputError(path, "file", problem, "correct the path to it") from None
    except UnicodeDecodeError as error:
        raise InputError(path, "file", f"is not YAML ({error})", remedy) from None
    try:
        loader = yaml.SafeLoader(text)
        node = loader.get_single_node()
        if node is None:
            return None
        _count(node, {})
        return loader.construct_document(node)
    # a date that does not exist is a plain ValueError, nesting ends in a RecursionError
    except (yaml.YAMLError, ValueError, TypeError, AttributeError, RecursionError) as error:
        raise InputError(path, "file", f"is not YAML ({error})", remedy) from None


def _count(node: yaml.Node, counts: dict[int, int | None]) -> int:
    """Nodes below and with one, aliases followed; `counts` holds those known, None while being counted."""
    known = counts.get(id(node), 0)
    if known is None:
        raise ValueError("an alias leads back to itself")
    if known:
        return known
    counts[id(node)] = None
    number = 1
    if isinstance(node, yaml.SequenceNode):
        number += sum(_count(child, counts) for child in node.value)
    elif isinstance(node, yaml.MappingNode):
        number += sum(_count(child, counts) for pair in node.value for child in pair)
    if number > MOST_NODES:
        raise ValueError(f"it stands for more than {MOST_NODES} values")
    counts[id(node)] = number
    return number
