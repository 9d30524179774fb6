"""How a rule's script ends: a user's mistake is one line, on the screen and in the rule's log."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pbrdf.errors import REFUSALS, InputError


@contextmanager
def job(log: str) -> Iterator[None]:
    """Turn an `InputError` into one line and exit code 1; other errors go to the log too."""
    try:
        yield
    except InputError as error:
        Path(log).write_text(f"{error}\n", encoding="utf-8")
        with REFUSALS.open("a", encoding="utf-8") as lines:
            lines.write(f"{error}\n")
        print(error, file=sys.stderr)
        sys.exit(1)
    except Exception:
        Path(log).write_text(traceback.format_exc(), encoding="utf-8")
        raise
