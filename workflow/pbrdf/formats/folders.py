"""Folders written beside their place, then renamed into it."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replace_folder(path: str | Path) -> Iterator[Path]:
    """Give a new, empty folder beside `path`, which takes the place of `path` when the block ends well.

    A block that raises leaves `path` as it was and nothing beside it.
    """
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    beside = target.with_name(f".{target.name}.{os.getpid()}.part")
    # a killed process may have left a folder of this name
    shutil.rmtree(beside, ignore_errors=True)
    try:
        beside.mkdir()
        yield beside
        _put_in_place(target, beside)
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def recover_folder(path: str | Path) -> None:
    """Undo what a killed process left half done of a folder and in it.

    If `replace_folder` was about to put another in its place, the old one returns; whatever was being written
    beside it, or beside a file or folder in it, goes. Nobody else may be writing there.
    """
    target = Path(path)
    for old in target.parent.glob(f".{target.name}.*.old"):
        if target.exists():
            shutil.rmtree(old)
        else:
            old.rename(target)
    for begun in (*target.parent.glob(f".{target.name}.*.part"), *target.glob(".*.part")):
        if begun.is_dir():
            shutil.rmtree(begun)
        else:
            begun.unlink()


def _put_in_place(target: Path, complete: Path) -> None:
    """Put a complete folder in the place of another, which returns if that fails."""
    if not target.exists():
        complete.rename(target)
        return
    # no rename replaces a folder that is not empty: the old one steps aside first
    old = target.with_name(f".{target.name}.{os.getpid()}.old")
    shutil.rmtree(old, ignore_errors=True)
    target.rename(old)
    try:
        complete.rename(target)
    except OSError:
        old.rename(target)
        raise
    if old.is_dir():
        shutil.rmtree(old)
    else:
        old.unlink()
