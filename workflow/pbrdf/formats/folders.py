"""Folders written beside their place, then renamed into it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pbrdf.formats.beside import beside, name_beside, remove


@contextmanager
def replace_folder(path: str | Path) -> Iterator[Path]:
    """Give a new, empty folder beside `path`, which takes the place of `path` when the block ends well.

    A block that raises leaves `path` as it was and nothing beside it.

    Raises
    ------
    InputError
        If the disk refuses.
    """
    with beside(path) as part:
        part.mkdir()
        yield part
        _put_in_place(Path(path), part)


def recover_folder(path: str | Path) -> None:
    """Undo what a killed process left half done of a folder and in it.

    If `replace_folder` was about to put another in its place, the old one returns; whatever was being written
    beside it, or beside a file or folder in it, goes. Nobody else may be writing there.
    """
    target = Path(path)
    for old in target.parent.glob(f".{target.name}.*.old"):
        if target.exists():
            remove(old)
        else:
            old.rename(target)
    for begun in (*target.parent.glob(f".{target.name}.*.part"), *target.glob(".*.part")):
        remove(begun)


def _put_in_place(target: Path, complete: Path) -> None:
    """Put a complete folder in the place of another, which returns if that fails."""
    if not target.exists():
        complete.rename(target)
        # if a process was killed here before, it left the old one aside
        name_beside(target, "old")
        return
    # no rename replaces a folder that is not empty: the old one steps aside first
    old = name_beside(target, "old")
    target.rename(old)
    try:
        complete.rename(target)
    except OSError:
        old.rename(target)
        raise
    remove(old)
