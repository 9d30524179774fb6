"""Where an emulated rotary stage stands while it turns."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from pbrdf.instruments.movement import travel_time, travelled


@dataclass(frozen=True)
class _Leg:
    """A travel from rest to rest; without speed it lasts for ever."""

    start_s: float
    origin: int
    distance: int
    speed: float
    acceleration: float

    @property
    def end_s(self) -> float:
        if self.distance == 0:
            return self.start_s
        if self.speed <= 0.0 or self.acceleration <= 0.0:
            return math.inf
        return self.start_s + travel_time(self.distance, self.speed, self.acceleration)

    def position(self, now: float) -> int:
        if self.end_s == math.inf:
            return self.origin
        return self.origin + round(
            travelled(now - self.start_s, self.distance, self.speed, self.acceleration)
        )


@dataclass(frozen=True)
class _Course:
    legs: tuple[_Leg, ...]
    final: int


class Rotation:
    """A position that is a function of time; may be asked from any thread.

    Parameters
    ----------
    position : int
        Microsteps, without end either way.
    """

    def __init__(self, position: int) -> None:
        # one attribute, so that who asks meanwhile meets the old course or the new, and no mixture
        self._course = _Course((), position)

    def position(self, now: float) -> int:
        """Microsteps at a time."""
        course = self._course
        for leg in course.legs:
            if now < leg.end_s:
                return leg.position(now)
        return course.final

    def moving(self, now: float) -> bool:
        """Whether it has not arrived."""
        legs = self._course.legs
        return bool(legs) and now < legs[-1].end_s

    def begin(
        self, now: float, stops: Sequence[int], speed: float, acceleration: float, error: int = 0
    ) -> None:
        """Go from where it is through all stops, and come to rest at some error from the last.

        Parameters
        ----------
        now : float
            Seconds.
        stops : sequence of int
            Microsteps.
        speed, acceleration : float
            Microsteps/s and microsteps/s²; where one is 0 it never arrives.
        error : int
            Microsteps.
        """
        legs: list[_Leg] = []
        start, origin = now, self.position(now)
        for stop in stops:
            legs.append(_Leg(start, origin, stop - origin, speed, acceleration))
            start, origin = legs[-1].end_s, stop
        self._course = _Course(tuple(legs), origin + error)

    def halt(self, now: float) -> None:
        """Stand where it is."""
        self._course = _Course((), self.position(now))
