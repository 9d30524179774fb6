"""Files and folders that are written beside their place, then put there."""

from __future__ import annotations

import errno
import glob
import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pbrdf.errors import InputError

_WAITS_S = (0.01, 0.1, 1.0)


def name_beside(target: Path, ending: str = "part") -> Path:
    """Name that no other process uses; what dead processes of this machine left of its kind goes.

    Of processes on other machines nobody knows here whether they still write.
    """
    machine = os.uname().nodename
    for left in target.parent.glob(f".{glob.escape(f'{target.name}.{machine}')}-*.{ending}"):
        process = left.name.removesuffix(f".{ending}").rpartition("-")[2]
        if process.isdecimal() and not _is_another(int(process)):
            remove(left)
    return target.with_name(f".{target.name}.{machine}-{os.getpid()}.{ending}")


def remove(path: Path) -> None:
    """Remove a file or a folder, if it is there."""
    if path.is_dir() and not path.is_symlink():
        _remove_folder(path)
    else:
        path.unlink(missing_ok=True)


def _remove_folder(path: Path) -> None:
    """Remove a folder in which threads of a writer that failed may still put and take files."""
    for wait_s in _WAITS_S:
        try:
            shutil.rmtree(path)
            return
        except OSError as error:
            if error.errno not in (errno.ENOENT, errno.ENOTEMPTY):
                raise
            time.sleep(wait_s)
    shutil.rmtree(path)


@contextmanager
def beside(path: str | Path) -> Iterator[Path]:
    """Give a name beside `path` to write to; whatever the block leaves there goes when it ends.

    Raises
    ------
    InputError
        If the disk refuses; it names `path`.
    """
    target = Path(path)
    place = target
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        place = name_beside(target)
        try:
            yield place
        finally:
            remove(place)
    except OSError as error:
        named = Path(error.filename2 or error.filename or place)
        # what is read meanwhile lies elsewhere
        if not (named.is_relative_to(place) or target.is_relative_to(named)):
            raise
        problem = f"cannot be written: {error.strerror or error}"
        raise InputError(target, "file", problem, "check the rights and room of its place") from error
    except InputError as error:
        # of a file in a folder
        if not Path(error.source).is_relative_to(place):
            raise
        named = target / Path(error.source).relative_to(place)
        raise InputError(named, error.field, error.problem, error.remedy) from error


@contextmanager
def replace_file(path: str | Path) -> Iterator[Path]:
    """Give a name beside `path` to write to; that file takes its place when the block ends well.

    A block that raises leaves `path` as it was and nothing beside it.

    Raises
    ------
    InputError
        If the disk refuses.
    """
    with beside(path) as part:
        yield part
        part.replace(path)


def _is_another(process: int) -> bool:
    """Whether a process other than this one has that number."""
    if process == os.getpid():
        return False
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    # it belongs to somebody else
    except PermissionError:
        return True
    return True
