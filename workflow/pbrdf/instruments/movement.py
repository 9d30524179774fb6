"""A movement under way, which can be awaited."""

from __future__ import annotations

import math
from collections.abc import Callable

from pbrdf.errors import InstrumentError
from pbrdf.instruments.clock import Clock

POLL_S = 0.1
"""Between two questions whether a movement has ended."""

SPARE_S = 5.0
"""Added to twice the expected time before a movement counts as stuck."""


def travel_time(distance: float, speed: float, acceleration: float) -> float:
    """Seconds for a distance from rest to rest, at no more than a speed and an acceleration.

    Units are the caller's: degrees, degrees/s, degrees/s². Either sign of `distance` is the same.
    """
    distance = abs(distance)
    if distance <= speed * speed / acceleration:
        return 2.0 * math.sqrt(distance / acceleration)
    return distance / speed + speed / acceleration


def travelled(seconds: float, distance: float, speed: float, acceleration: float) -> float:
    """How far a travel of `travel_time` has come, between 0 and `distance`, with its sign."""
    length, total = abs(distance), travel_time(distance, speed, acceleration)
    seconds = min(max(seconds, 0.0), total)
    ramp = min(speed / acceleration, 0.5 * total)
    if seconds < ramp:
        come = 0.5 * acceleration * seconds**2
    elif seconds <= total - ramp:
        come = acceleration * ramp * (seconds - 0.5 * ramp)
    else:
        come = length - 0.5 * acceleration * (total - seconds) ** 2
    return math.copysign(min(come, length), distance)


class Movement:
    """A movement that has begun.

    Parameters
    ----------
    clock : Clock
    instrument : str
        Its name and port, for messages.
    what : str
        Where it goes: ``move to 45.000°``.
    expected_s : float
        How long it should take, from distance and speed.
    arrived : callable
        Asks the instrument; True when it stands still where it should. May raise `InstrumentError`.
    stop : callable
        Stops the instrument.
    longest_s : float, optional
        How long it may take before it counts as stuck; by default twice `expected_s` and `SPARE_S`.
    """

    def __init__(
        self,
        clock: Clock,
        instrument: str,
        what: str,
        expected_s: float,
        arrived: Callable[[], bool],
        stop: Callable[[], None],
        longest_s: float | None = None,
    ) -> None:
        self._clock = clock
        self._instrument, self._what = instrument, what
        self._arrived, self._stop = arrived, stop
        self._expected = clock.now() + expected_s
        self._deadline = clock.now() + (2.0 * expected_s + SPARE_S if longest_s is None else longest_s)
        self._done = False

    @property
    def done(self) -> bool:
        """Whether it has ended where it should; asks the instrument."""
        self._done = self._done or self._arrived()
        return self._done

    def wait(self) -> None:
        """Return when it has ended.

        Raises
        ------
        InstrumentError
            If it takes longer than it may: the instrument is stopped first.
        """
        self._clock.sleep(self._expected - self._clock.now())
        # while others were waited for, this one may have ended without having been asked
        deadline = max(self._deadline, self._clock.now() + SPARE_S)
        while not self.done:
            if self._clock.now() > deadline:
                self._stop()
                raise InstrumentError(
                    self._instrument,
                    self._what,
                    "has not ended in time",
                    "see that nothing blocks it and that its power is on, then run again",
                )
            self._clock.sleep(POLL_S)
