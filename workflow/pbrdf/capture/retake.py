"""A light that is to be taken anew: what was taken of it is kept under another name."""

from __future__ import annotations

from itertools import count
from pathlib import Path

from pbrdf.capture.interruption import sole_owner
from pbrdf.capture.light_folder import light_folder
from pbrdf.errors import InputError


def archive_light(folder: str | Path, light: str) -> Path:
    """Rename ``lights/041.00`` to ``lights/041.00.r1``, or the next number that is free.

    Parameters
    ----------
    folder : str or Path
        ``captures/<material>``.
    light : str
        Name of the light.

    Returns
    -------
    Path
        Where the frames are now.

    Raises
    ------
    InputError
        If there is no such light, or a capture is at work there.
    """
    here = light_folder(folder, light)
    if not here.is_dir():
        found = sorted(path.name for path in here.parent.glob("*.??")) if here.parent.is_dir() else []
        taken = f"there: {', '.join(found)}" if found else "none was taken yet"
        raise InputError(here, "light", "does not exist", f"name one that was taken ({taken})")
    with sole_owner(Path(folder)):
        archive = next(
            path for number in count(1) if not (path := here.with_name(f"{light}.r{number}")).exists()
        )
        here.rename(archive)
    return archive
