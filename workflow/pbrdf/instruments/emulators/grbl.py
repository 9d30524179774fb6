"""A table behind a GRBL 1.1 board, as its driver finds it at the far end of the wire.

Source: GRBL 1.1, "Grbl Interface Basics", "Grbl Commands" and "Grbl Settings".
"""

from __future__ import annotations

import re
import threading
from collections.abc import Mapping
from statistics import NormalDist

from pbrdf.instruments.clock import Clock
from pbrdf.instruments.emulators.faults import Faults
from pbrdf.instruments.emulators.grbl_axis import Axis
from pbrdf.instruments.emulators.grbl_parser import GCodeError, Parser
from pbrdf.instruments.virtual_words import drawn

HELP = "[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? ctrl-x]"
UNLOCK = "[MSG:'$H'|'$X' to unlock]"

SETTINGS = {
    0: 10,
    1: 25,
    2: 0,
    3: 0,
    4: 0,
    5: 0,
    6: 0,
    10: 1,
    11: 0.01,
    12: 0.002,
    13: 0,
    20: 0,
    21: 0,
    22: 0,
    23: 1,
    24: 25.0,
    25: 500.0,
    26: 250,
    27: 1.0,
    30: 1000,
    31: 0,
    32: 0,
    100: 250.0,
    110: 500.0,
    120: 10.0,
    130: 200.0,
}
"""A board's settings as delivered, of three axes the first alone."""

FRACTIONS = frozenset({11, 12, 24, 25, 27})
"""Settings below 100 that are printed with decimals."""

LOCKS = (1, 2)
"""Alarms after which nothing but a reset is heeded."""


class EmulatedGrbl:
    """A board and its table on a clock (`pbrdf.instruments.emulators.server.Device`).

    Its Y and Z axes, spindle and coordinate systems are understood and ignored; a block is answered when it
    is queued, however many there are.

    Faults:

    - ``silent-start``: a reset is not followed by a banner.
    - ``garbage``: noise (`value`, bytes in hexadecimal) before the banner.
    - ``error``: a line is answered with error:`value`.
    - ``lost-ok``: a line is obeyed and not answered.
    - ``setting-kept``: a setting is answered with ok and not stored.
    - ``alarm``: ALARM:`value` in the middle of a movement.
    - ``reset``: the board starts anew in the middle of a movement and counts from zero.
    - ``hold``: somebody presses the hold button in the middle of a movement.
    - ``homing-alarm``: homing ends in ALARM:`value`.
    - ``dead``: on a line, the board has gone for ever.

    Parameters
    ----------
    clock : Clock
    faults : Faults
    settings : mapping, optional
        Settings that its memory holds in place of those delivered, by number.
    start_deg : float
        Where the arm really stands when power comes; the board then counts from zero.
    switch_deg : float
        Where it really stands when homing has ended.
    play_deg : float
        How much farther the arm stands where it came from above.
    error_deg : float
        Standard deviation of where the arm stands, over targets.
    seed : int
        Of that error, which otherwise depends on the target alone.
    banner : str
    remembers : str
        What ``$I=`` has stored.
    """

    def __init__(
        self,
        clock: Clock,
        faults: Faults,
        settings: Mapping[int, float] | None = None,
        start_deg: float = 0.0,
        switch_deg: float = 0.0,
        play_deg: float = 0.0,
        error_deg: float = 0.0,
        seed: int = 0,
        banner: str = "Grbl 1.1h ['$' for help]",
        remembers: str = "",
    ) -> None:
        self._clock, self._faults = clock, faults
        self._settings: dict[int, float] = SETTINGS | dict(settings or {})
        self._switch, self._play, self._error, self._seed = switch_deg, play_deg, error_deg, seed
        self._banner, self._remembers = banner, remembers
        self._axis = Axis(self._settings)
        self._offset = start_deg
        self._parser = Parser()
        self._alarm = bool(self._settings[22])
        self._locked = self._dead = self._asked = False
        self._text = ""
        self._waiting: list[str] = []
        self._busy: tuple[float, str, int] | None = None
        self._upset: tuple[float, str, int] | None = None
        self._reports = 0
        self._lock = threading.Lock()

    def angle_deg(self) -> float:
        """Where the arm really stands; may be called from any thread."""
        with self._lock:
            return self._angle_deg()

    def _angle_deg(self) -> float:
        axis, now = self._axis, self._clock.now()
        angle = self._offset + axis.position(now) + (0.0 if axis.rising(now) else self._play)
        if self._error and not axis.moving(now):
            chance = float(drawn(f"{self._seed}/table/{axis.position(now):.4f}", 1)[0])
            angle += self._error * NormalDist().inv_cdf(min(max(chance, 1e-12), 1.0 - 1e-12))
        return angle

    def receive(self, data: bytes) -> bytes:
        """Answer characters that are obeyed at once, and the lines so far."""
        with self._lock:
            said = self._due()
            for code in data:
                said += self._character(chr(code))
            return b"" if self._dead else said

    def due(self) -> bytes:
        """What homing, a dwell or a fault in mid-move say when their time has come."""
        with self._lock:
            said = self._due()
            return b"" if self._dead else said

    def _due(self) -> bytes:
        now, said = self._clock.now(), b""
        if self._upset is not None and now >= self._upset[0]:
            said += self._strike(*self._upset)
        if self._busy is not None and now >= self._busy[0]:
            said += self._finish(*self._busy[1:])
            while self._waiting and self._busy is None:
                said += self._line(self._waiting.pop(0))
        return said

    def _character(self, one: str) -> bytes:
        if one == "\x18":
            return self._reset()
        if self._locked:
            return b""
        if one == "?":
            return self._report()
        if one == "!":
            self._hold()
        elif one == "~":
            self._axis.resume(self._clock.now())
        elif one in "\r\n":
            line, self._text = self._text, ""
            return self._line(line)
        elif " " < one < "\x7f":
            self._text += one
        return b""

    def _line(self, line: str) -> bytes:
        if self._faults.strikes("dead"):
            self._dead = True
        if self._busy is not None:
            self._waiting.append(line)
            return b""
        error: int = self._faults.value("error", absent=0)
        if error:
            return _said(f"error:{error}")
        try:
            answer = self._system(line) if line.startswith("$") else self._gcode(line)
        except GCodeError as refused:
            answer = _said(f"error:{refused.number}")
        return b"" if self._faults.strikes("lost-ok") else answer

    def _system(self, line: str) -> bytes:
        key, equals, value = line[1:].partition("=")
        if equals and key.isdigit():
            return self._set(int(key), value)
        if equals and key.upper() == "I":
            self._remembers = value
            return _said("ok")
        texts = {
            "": [HELP],
            "$": [f"${key}={_printed(key, value)}" for key, value in sorted(self._settings.items())],
            "I": [f"[VER:1.1h.20190825:{self._remembers}]", "[OPT:V,15,128]"],
            "G": [f"[GC:{self._parser.modes()}]"],
            "#": ["[G54:0.000,0.000,0.000]", "[G92:0.000,0.000,0.000]", "[TLO:0.000]"],
            "N": ["$N0=", "$N1="],
        }
        if line[1:].upper() in texts:
            return _said(*texts[line[1:].upper()], "ok")
        if line.upper() == "$X":
            unlocked, self._alarm = self._alarm, False
            return _said("[MSG:Caution: Unlocked]", "ok") if unlocked else _said("ok")
        if line.upper() == "$H":
            return self._home()
        raise GCodeError(3)

    def _set(self, key: int, value: str) -> bytes:
        if self._axis.moving(self._clock.now()):
            raise GCodeError(8)
        if key not in self._settings:
            raise GCodeError(3)
        try:
            number = float(value)
        except ValueError:
            raise GCodeError(2) from None
        if number < 0:
            raise GCodeError(4)
        if key == 20 and number and not self._settings[22]:
            raise GCodeError(10)
        if not self._faults.strikes("setting-kept"):
            self._settings[key] = number
        return _said("ok")

    def _gcode(self, line: str) -> bytes:
        line = re.sub(r"\([^)]*\)|;.*", "", line)
        if self._alarm and line:
            raise GCodeError(9)
        now = self._clock.now()
        block = self._parser.block(line, self._axis.target(now))
        if block.dwell_s is not None:
            self._busy = (self._axis.end_s(now) + block.dwell_s, "dwell", 0)
            return b""
        if block.target is None:
            return _said("ok")
        if self._settings[20] and not -self._settings[130] <= block.target <= 0.0:
            return self._strike(now, "alarm", 2)
        begin, end = self._axis.add(now, block.target, block.feed_min)
        for fault in ("alarm", "reset", "hold"):
            number: int | None = self._faults.value(fault, absent=None)
            if number is not None:
                self._upset = (0.5 * (begin + end), fault, number)
        return _said("ok")

    def _home(self) -> bytes:
        if not self._settings[22]:
            raise GCodeError(5)
        number: int = self._faults.value("homing-alarm", absent=0)
        far = abs(self._angle_deg() - self._switch)
        seek, locate = self._settings[25] / 60.0, self._settings[24] / 60.0
        seconds = far / seek + self._settings[27] * (1.0 / locate + 2.0 / seek)
        self._busy = (self._clock.now() + seconds, "home", number)
        return b""

    def _finish(self, what: str, number: int) -> bytes:
        self._busy = None
        if what == "home" and number:
            self._alarm = True
            return _said(f"ALARM:{number}", UNLOCK) + self._owed()
        if what == "home":
            pull_off = self._settings[27]
            homes_down = int(self._settings[23]) & 1
            self._axis.place(pull_off - self._settings[130] if homes_down else -pull_off)
            self._offset = self._switch - self._axis.position(self._clock.now())
            self._alarm = False
        return _said("ok") + self._owed()

    def _owed(self) -> bytes:
        """The one report that is given after homing for all that were asked for during it."""
        asked, self._asked = self._asked, False
        return self._report() if asked else b""

    def _strike(self, when: float, what: str, number: int) -> bytes:
        self._upset = None
        if what == "hold":
            self._axis.hold(when)
            return b""
        self._axis.halt(when)
        self._alarm = True
        if what == "alarm":
            self._locked = number in LOCKS
            return _said(f"ALARM:{number}", "[MSG:Reset to continue]")
        self._offset += self._axis.position(when)
        self._axis.place(0.0)
        self._alarm = bool(self._settings[22])
        return self._greeting()

    def _hold(self) -> None:
        if self._busy is None:
            self._axis.hold(self._clock.now())

    def _reset(self) -> bytes:
        now, said = self._clock.now(), b""
        if self._busy is not None and self._busy[1] == "home":
            self._alarm, said = True, _said("ALARM:6")
        elif self._axis.running(now):
            self._alarm, said = True, _said("ALARM:3")
        self._axis.halt(now)
        self._parser, self._text, self._waiting = Parser(), "", []
        self._busy = self._upset = None
        self._locked = self._asked = False
        return said + (b"" if self._faults.strikes("silent-start") else self._greeting())

    def _greeting(self) -> bytes:
        noise = bytes.fromhex(self._faults.value("garbage", absent="", struck="fe 00 6f 6b 0d 0a 81"))
        return noise + _said("", self._banner, *([UNLOCK] if self._alarm else []))

    def _report(self) -> bytes:
        if self._busy is not None and self._busy[1] == "home":
            self._asked = True
            return b""
        now = self._clock.now()
        kind = "MPos" if int(self._settings[10]) & 1 else "WPos"
        place = f"{kind}:{self._axis.position(now):.3f},0.000,0.000"
        # now and then a report says more
        more = {0: "|WCO:0.000,0.000,0.000", 1: "|Ov:100,100,100"}.get(self._reports % 10, "")
        self._reports += 1
        return _said(f"<{self._state(now)}|{place}|FS:{self._axis.feed_min(now):.0f},0{more}>")

    def _state(self, now: float) -> str:
        if self._alarm:
            return "Alarm"
        return self._axis.state(now)


def _said(*lines: str) -> bytes:
    return "".join(f"{line}\r\n" for line in lines).encode()


def _printed(key: int, value: float) -> str:
    return f"{value:.3f}" if key >= 100 or key in FRACTIONS else f"{value:.0f}"
