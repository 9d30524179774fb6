"""How a rule's script ends: a user's mistake is one line, on the screen and in the rule's log."""

from __future__ import annotations

import os
import select
import signal
import sys
import threading
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from pbrdf.errors import REFUSALS, InputError


@contextmanager
def job(log: str) -> Iterator[None]:
    """Turn an `InputError` into one line and exit code 1; other errors go to the log too.

    The job ends when the Snakemake that began it is killed: the next one may begin it again.
    """
    threading.Thread(target=_end_with, args=[int(os.environ["PBRDF_SNAKEMAKE"])], daemon=True).start()
    try:
        yield
    except InputError as error:
        print(error, file=sys.stderr)
        # where the disk is full there may be no room for the log either
        with suppress(OSError):
            Path(log).write_text(f"{error}\n", encoding="utf-8")
            with REFUSALS.open("a", encoding="utf-8") as lines:
                lines.write(f"{error}\n")
        sys.exit(1)
    except Exception:
        Path(log).write_text(traceback.format_exc(), encoding="utf-8")
        raise


def _end_with(process: int) -> None:
    """Wait for the end of another process, then end this one as an operator would."""
    try:
        handle = os.pidfd_open(process)
    # it ended before
    except ProcessLookupError:
        handle = None
    if handle is not None:
        select.select([handle], [], [])
    os.kill(os.getpid(), signal.SIGTERM)
