"""What lets a capture end between two frames, and keeps a second one from the same folder."""

from __future__ import annotations

import fcntl
import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

from pbrdf.errors import InputError


class Interrupted(InputError):
    """Somebody asked the capture to end; everything taken so far is kept."""


@contextmanager
def interruptible() -> Iterator[Callable[[], bool]]:
    """Give a function that tells whether the user or the system asked for an end, by SIGINT or SIGTERM.

    The first signal lets the frame in hand be finished, a second one interrupts at once. Outside the main
    thread, where signals do not arrive, it always says no.
    """
    asked = False

    def ask(number: int, frame: FrameType | None) -> None:
        nonlocal asked
        if asked:
            raise KeyboardInterrupt
        asked = True

    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    before = {number: signal.signal(number, ask) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield lambda: asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def sole_owner(folder: Path) -> Iterator[None]:
    """Keep other captures out of a folder; the system frees it whatever becomes of this process.

    Raises
    ------
    InputError
        If another capture is at work there.
    """
    folder.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    except BlockingIOError:
        raise InputError(
            folder, "folder", "another capture is at work there", "wait for it, or end it"
        ) from None
    finally:
        os.close(descriptor)
