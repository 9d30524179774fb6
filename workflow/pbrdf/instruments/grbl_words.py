"""What the numbers of GRBL 1.1 mean, and the form of its lines.

Source: GRBL 1.1, "Grbl Interface Basics" and "Grbl Settings"; words are this program's own.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

BANNER = re.compile(r"(Grbl|GrblHAL) (\d+\.\d+\w?)", re.IGNORECASE)
"""How a board greets after a reset."""

STATUS = re.compile(r"<(\w+)(?::\d+)?\|(?:.*\|)?MPos:(-?[\d.]+)")
"""A status report with the machine's position."""

SETTING = re.compile(r"\$(\d+)=(-?\d+(?:\.\d+)?)(?: .*)?")
"""A setting that is a number; old boards add words."""

VERSION = re.compile(r"\[VER:([^:]*):([^\]]*)\]")
"""Firmware with its date, and what the owner has had the board remember."""

ERRORS = {
    1: "a word without its letter",
    2: "a number in no known form",
    3: "a command with $ that it does not know",
    4: "a negative value where none may be",
    5: "homing is not enabled",
    6: "a step pulse that is too short",
    7: "its memory could not be read, and its settings are the first ones again",
    8: "a command that it takes at rest alone",
    9: "G-code is locked while it is in alarm",
    10: "soft limits need homing",
    11: "the line is too long",
    12: "more steps a second than it can make",
    13: "its safety door is open",
    14: "the line is too long to be remembered",
    15: "a target beyond its travel",
    16: "a jog without an axis or with a forbidden word",
    17: "laser mode needs another output",
    20: "a command that it does not know",
    21: "two commands of one group in a line",
    22: "no feed rate was set",
    23: "a whole number was needed",
    24: "two commands that both want the axes",
    25: "a word is there twice",
    26: "no axis was named",
    27: "a line number that is out of range",
    28: "a word lacks its value",
    29: "a coordinate system that it does not have",
    30: "G53 goes with G0 and G1 alone",
    31: "axes were named that nothing uses",
    32: "an arc without an axis in its plane",
    33: "a target that cannot be reached so",
    34: "an arc of impossible radius",
    35: "an arc without an offset in its plane",
    36: "words that nothing uses",
    37: "a tool length for another axis",
    38: "a tool number that is too large",
}
"""Why a line was refused: ``error:n``."""

ALARMS = {
    1: "it ran into a limit switch, or the line to the switch is disturbed",
    2: "the target lies beyond its own soft limits",
    3: "it was reset in mid-move",
    4: "its probe was not in the state that it should start from",
    5: "its probe touched nothing",
    6: "it was reset while it looked for its zero",
    7: "its safety door was opened while it looked for its zero",
    8: "it could not leave the limit switch",
    9: "it found no limit switch",
}
"""Why it stopped and locked itself: ``ALARM:n``."""


@dataclass(frozen=True)
class Status:
    """State in GRBL's word (``Idle``, ``Run``, ``Hold``, ``Home``, ``Alarm``), and the machine's position."""

    state: str
    position: float


def status_of(line: str) -> Status | None:
    """Read a status report; None if the line is something else."""
    found = STATUS.match(line)
    return Status(found.group(1), float(found.group(2))) if found else None


def number_of(line: str) -> int:
    """Read the n of ``error:n`` and ``ALARM:n``; 0 if there is none."""
    digits = line.partition(":")[2]
    return int(digits) if digits.isdigit() else 0
