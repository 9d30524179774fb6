"""Time as drivers and emulators share it."""

from __future__ import annotations

import time
from typing import Protocol


class Clock(Protocol):
    """Seconds since some moment, and waiting; may be called from any thread."""

    def now(self) -> float:
        """Seconds that have passed; never fewer than before."""

    def sleep(self, seconds: float) -> None:
        """Return when so many seconds have passed."""


class WallClock:
    """Time as it passes on the wall (`Clock`)."""

    def now(self) -> float:
        """Seconds of the monotonic clock."""
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        """Wait."""
        time.sleep(max(0.0, seconds))
