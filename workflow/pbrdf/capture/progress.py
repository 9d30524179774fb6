"""How far a long work is, and how long it still takes."""

from __future__ import annotations

import sys
import time
from typing import TextIO


class Progress:
    """Prints a line now and then: share done, rate, time left.

    Parameters
    ----------
    what : str
        What is going on, such as ``capture of gold``.
    total : int
        Number of steps.
    unit : str
        What a step is, in the plural.
    every_s : float
        Seconds between lines.
    stream : TextIO, optional
        Standard error unless given.
    """

    def __init__(
        self, what: str, total: int, unit: str = "frames", every_s: float = 5.0, stream: TextIO | None = None
    ) -> None:
        self._what = what
        self._unit = unit
        self._every = every_s
        self._stream = stream or sys.stderr
        self._begun = self._last = time.monotonic()
        self.total = total
        self.done = 0
        self._skipped = 0
        self._note = ""

    def skip(self) -> None:
        """One step more was done earlier: it says nothing of the rate."""
        self.done += 1
        self._skipped += 1

    def step(self) -> None:
        """One step more is done."""
        self.done += 1
        now = time.monotonic()
        if now - self._last >= self._every or (self.done == self.total and self._last != self._begun):
            self._last = now
            self._print(now - self._begun)

    def note(self, text: str) -> None:
        """Something that the next line says besides."""
        self._note = f", {text}"

    def _print(self, elapsed_s: float) -> None:
        rate = (self.done - self._skipped) / max(elapsed_s, 1e-9)
        left_s = (self.total - self.done) / rate
        percent = 100 * self.done / self.total
        print(
            f"{self._what}: {self.done} of {self.total} {self._unit} ({percent:.0f} %), "
            f"{rate:.{0 if rate >= 10 else 1}f} {self._unit}/s, {_duration(left_s)} left{self._note}",
            file=self._stream,
            flush=True,
        )


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes} min"
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"
