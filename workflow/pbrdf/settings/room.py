"""Room on a disk: how much a run needs, and whether it is there."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

from pbrdf.errors import InputError

COMPRESSED = 0.6
"""Of a frame's raw size, as virtual and real frames have come out."""


def require_room(folder: str | Path, needed_bytes: float) -> str:
    """Tell in a line how much a run writes and how much is free.

    Parameters
    ----------
    folder : str or Path
        An existing one of the disk in question.
    needed_bytes : float

    Raises
    ------
    InputError
        If less is free than is needed.
    """
    free_bytes = shutil.disk_usage(folder).free
    needed, free = told(needed_bytes), told(free_bytes)
    if needed_bytes > free_bytes:
        problem = f"has {free} free, and this run writes {needed}"
        raise InputError(
            Path(folder).resolve(), "disk", problem, "make room, or work elsewhere (`--directory`)"
        )
    return f"This run writes at most {needed}; {free} are free."


def told(size_bytes: float) -> str:
    """A size in its unit, to two digits or to the whole."""
    for unit, size in (("TB", 1e12), ("GB", 1e9)):
        if size_bytes >= size:
            amount = size_bytes / size
            return f"{amount:.1f} {unit}" if amount < 9.95 else f"{amount:.0f} {unit}"
    return f"{math.ceil(size_bytes / 1e6)} MB"
