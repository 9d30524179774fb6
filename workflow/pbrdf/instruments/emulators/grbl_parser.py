"""The part of GRBL's G-code that turns a table.

Source: GRBL 1.1, "Grbl Commands"; modal groups as in NIST RS274/NGC.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

WORD = re.compile(r"([A-Z])([+-]?(?:\d+\.?\d*|\.\d+))")
INCH = 25.4

IGNORED_G = frozenset({17.0, 40.0, 49.0, 54.0, 61.0, 80.0, 94.0})
IGNORED_M = frozenset({0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 8.0, 9.0, 30.0})
AXES = "XYZ"

MODAL_GROUPS = {
    **dict.fromkeys((0.0, 1.0, 80.0), "motion"),
    **dict.fromkeys((90.0, 91.0), "distance"),
    **dict.fromkeys((20.0, 21.0), "units"),
}
"""Groups of which a line may hold one member."""


class GCodeError(Exception):
    """A line that is answered with ``error:number``."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


@dataclass(frozen=True)
class Block:
    """What a line asks for: a target of X with its feed (None: full speed), or a dwell, or neither."""

    target: float | None = None
    feed_min: float | None = None
    dwell_s: float | None = None


class Parser:
    """A parser with its modes, as they are after a reset."""

    def __init__(self) -> None:
        self._motion = 0.0
        self._absolute, self._metric = True, True
        self._feed_min = 0.0

    def modes(self) -> str:
        """The modes as ``$G`` prints them."""
        units, distance = ("G21" if self._metric else "G20"), ("G90" if self._absolute else "G91")
        return f"G{self._motion:.0f} G54 G17 {units} {distance} G94 M5 M9 T0 F{self._feed_min:.0f} S0"

    def block(self, line: str, here: float) -> Block:
        """Read a line without blanks and comments; `here` is where the queue so far ends.

        Raises
        ------
        GCodeError
            If it is not understood; no mode changes then.
        """
        words = _words(line.upper())
        codes = [value for letter, value in words if letter == "G"]
        values = {letter: value for letter, value in words if letter not in "GMN"}
        self._check(words, codes)
        motion = next((code for code in codes if code in (0.0, 1.0)), self._motion)
        metric = False if 20.0 in codes else True if 21.0 in codes else self._metric
        absolute = False if 91.0 in codes else True if 90.0 in codes else self._absolute
        unit = 1.0 if metric else INCH
        feed = values["F"] * unit if "F" in values else self._feed_min
        moves = any(axis in values for axis in AXES)
        if 4.0 in codes and "P" not in values:
            raise GCodeError(28)
        if moves and motion == 1.0 and feed <= 0.0:
            raise GCodeError(22)
        self._motion, self._metric, self._absolute, self._feed_min = motion, metric, absolute, feed
        if 4.0 in codes:
            return Block(dwell_s=values["P"])
        if "X" not in values:
            return Block()
        x = values["X"] * unit + (0.0 if absolute or 53.0 in codes else here)
        return Block(x, feed if motion == 1.0 else None)

    def _check(self, words: list[tuple[str, float]], codes: list[float]) -> None:
        known = IGNORED_G | MODAL_GROUPS.keys() | {4.0, 53.0}
        stops = [value for letter, value in words if letter == "M"]
        if any(code not in known for code in codes) or any(code not in IGNORED_M for code in stops):
            raise GCodeError(20)
        groups = [MODAL_GROUPS[code] for code in codes if code in MODAL_GROUPS]
        if len(groups) != len(set(groups)):
            raise GCodeError(21)
        letters = [letter for letter, _ in words if letter not in "GM"]
        if len(letters) != len(set(letters)):
            raise GCodeError(25)
        if any(letter not in "FNPSTXYZ" for letter in letters):
            raise GCodeError(36 if any(letter in "IJKLR" for letter in letters) else 20)


def _words(line: str) -> list[tuple[str, float]]:
    found, at = [], 0
    while at < len(line):
        match = WORD.match(line, at)
        if match is None:
            raise GCodeError(2 if line[at].isalpha() else 1)
        found.append((match.group(1), float(match.group(2))))
        at = match.end()
    return found
