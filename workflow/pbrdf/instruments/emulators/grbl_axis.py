"""How an axis of an emulated GRBL board moves: one movement after another, each from rest to rest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from pbrdf.instruments.movement import travel_time, travelled


@dataclass(frozen=True)
class _Leg:
    start_s: float
    begin: float
    target: float
    speed: float
    acceleration: float

    @property
    def end_s(self) -> float:
        return self.start_s + travel_time(self.target - self.begin, self.speed, self.acceleration)

    def position(self, now: float) -> float:
        way = self.target - self.begin
        return self.begin + travelled(now - self.start_s, way, self.speed, self.acceleration)

    def speed_at(self, now: float) -> float:
        since, left = max(0.0, now - self.start_s), max(0.0, self.end_s - now)
        return min(self.speed, self.acceleration * since, self.acceleration * left)


class Axis:
    """An axis that counts steps.

    Parameters
    ----------
    settings : mapping
        The board's, by number: steps a unit ($100), units a minute ($110), units/s² ($120). Not copied.
    """

    def __init__(self, settings: Mapping[int, float]) -> None:
        self._settings = settings
        self._legs: list[_Leg] = []
        self._kept: list[_Leg] = []
        self._rest = 0.0
        self._rises = True
        self._held_s: float | None = None

    def place(self, position: float) -> None:
        """Let the count be this; the last movement before it went up."""
        self._legs, self._kept, self._held_s = [], [], None
        self._rest, self._rises = position, True

    def add(self, now: float, target: float, feed_min: float | None) -> tuple[float, float]:
        """Queue a movement, at full speed without a feed; returns when it begins and ends."""
        self._settle(now)
        top = self._settings[110] if feed_min is None else min(feed_min, self._settings[110])
        steps = self._settings[100]
        leg = _Leg(
            self.end_s(now), self.target(now), round(target * steps) / steps, top / 60.0, self._settings[120]
        )
        if self._held_s is not None:
            self._kept.append(leg)
        elif leg.target != leg.begin:
            self._legs.append(leg)
        return leg.start_s, leg.end_s

    def target(self, now: float) -> float:
        """Where the last movement in the queue ends."""
        queue = self._legs + self._kept
        return queue[-1].target if queue else self._rest

    def end_s(self, now: float) -> float:
        """When the queue will be empty."""
        return max(now, self._legs[-1].end_s) if self._legs else now

    def position(self, now: float) -> float:
        """Where the count stands."""
        self._settle(now)
        return self._legs[0].position(now) if self._legs else self._rest

    def rising(self, now: float) -> bool:
        """Whether it goes up, or went up last."""
        self._settle(now)
        return self._legs[0].target > self._legs[0].begin if self._legs else self._rises

    def feed_min(self, now: float) -> float:
        """Speed a minute."""
        self._settle(now)
        return 60.0 * self._legs[0].speed_at(now) if self._legs else 0.0

    def moving(self, now: float) -> bool:
        """Whether anything is under way, held or not."""
        self._settle(now)
        return bool(self._legs or self._kept)

    def running(self, now: float) -> bool:
        """Whether steps are being made."""
        self._settle(now)
        return bool(self._legs) or (self._held_s is not None and now < self._held_s)

    def state(self, now: float) -> str:
        """GRBL's word for it."""
        if self._held_s is not None:
            return f"Hold:{int(now < self._held_s)}"
        return "Run" if self.moving(now) else "Idle"

    def hold(self, now: float) -> None:
        """Slow down to a stop; the count jumps to where that ends."""
        self._settle(now)
        if self._held_s is not None:
            return
        self._held_s = now
        if not self._legs:
            return
        leg = self._legs[0]
        speed = leg.speed_at(now)
        self._held_s = now + speed / leg.acceleration
        way = 0.5 * speed * speed / leg.acceleration
        stop = leg.position(now) + (way if leg.target > leg.begin else -way)
        self._rises, self._kept = leg.target > leg.begin, self._legs
        steps = self._settings[100]
        self._rest, self._legs = round(stop * steps) / steps, []

    def resume(self, now: float) -> None:
        """Go on after `hold`."""
        kept, self._kept, self._held_s = self._kept, [], None
        for leg in kept:
            self.add(now, leg.target, 60.0 * leg.speed)

    def halt(self, now: float) -> None:
        """Stop dead and forget what was queued."""
        position, rises = self.position(now), self.rising(now)
        steps = self._settings[100]
        self.place(round(position * steps) / steps)
        self._rises = rises

    def _settle(self, now: float) -> None:
        while self._legs and now >= self._legs[0].end_s:
            leg = self._legs.pop(0)
            self._rest, self._rises = leg.target, leg.target > leg.begin
