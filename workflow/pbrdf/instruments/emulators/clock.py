"""Time that passes when somebody waits, and at once; or on the wall, but faster."""

from __future__ import annotations

import threading
import time


class VirtualClock:
    """Seconds that only `sleep` moves on (`pbrdf.instruments.clock.Clock`)."""

    def __init__(self) -> None:
        self._now = 0.0
        self._lock = threading.Lock()

    def now(self) -> float:
        """Seconds slept by all together."""
        return self._now

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        with self._lock:
            self._now += max(0.0, seconds)


class ScaledClock:
    """Time as it passes on the wall, so many times as fast, for drivers that wait by a clock of their own."""

    def __init__(self, factor: float) -> None:
        self._factor, self._start = factor, time.monotonic()

    def now(self) -> float:
        """Seconds since it was made, times the factor."""
        return (time.monotonic() - self._start) * self._factor

    def sleep(self, seconds: float) -> None:
        """Wait for the shorter time."""
        time.sleep(max(0.0, seconds) / self._factor)
