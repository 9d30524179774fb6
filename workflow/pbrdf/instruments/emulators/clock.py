"""Time that passes when somebody waits, and at once."""

from __future__ import annotations

import threading


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
