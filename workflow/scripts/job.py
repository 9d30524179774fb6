"""How a rule's script ends: a user's mistake is one line, on the screen and in the rule's log."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pbrdf.errors import InputError


@contextmanager
def job(log: str) -> Iterator[None]:
    """Turn an `InputError` into one line and exit code 1; anything else keeps its traceback."""
    try:
        yield
    except InputError as error:
        Path(log).write_text(f"{error}\n", encoding="utf-8")
        print(error, file=sys.stderr)
        sys.exit(1)
