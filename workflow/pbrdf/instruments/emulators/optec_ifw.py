"""An Optec IFW filter wheel, as its driver finds it at the far end of the wire.

Source: Optec, "IFW Serial Commands" (IFW-Serial.md).
"""

from __future__ import annotations

from pbrdf.instruments.clock import Clock
from pbrdf.instruments.emulators.faults import Faults
from pbrdf.instruments.optec_ifw import SLOTS, SLOTS_IFW3

COMMAND = 6
"""Characters of a command."""

NAME = 8
"""Characters of a filter's name."""


class EmulatedIFW:
    """A wheel that turns on a clock (`pbrdf.instruments.emulators.server.Device`).

    Faults:

    - ``silent-start``: WSMODE is not answered.
    - ``garbage``: noise (`value`, bytes in hexadecimal) before the answer to WSMODE.
    - ``goto-error``, ``home-error``: WGOTO or WHOMES ends with ER=`value`, and the wheel stays.
    - ``goto-error-at-once``, ``home-error-at-once``: it is refused with ER=`value`.
    - ``late-star``: the end of a turn is told `value` seconds late.
    - ``slow-home``: WHOMES takes `value` seconds more.
    - ``wrong-slot``: the wheel slips one slot too far and does not notice.
    - ``cr-lf``: an answer ends in CR LF in place of LF CR.
    - ``reset``: on a command, the wheel has left serial mode; it and all later ones are not answered.
    - ``dead``: on a command, the controller has gone for ever.
    - ``power-off``: a movement is refused with ER=8, for want of 12 V.

    Parameters
    ----------
    clock : Clock
    faults : Faults
    wheel : str
        The letter that the wheel's magnets spell, ``A`` to ``K``.
    slot : int
        Where it stands when power comes: it remembers.
    firmware, serial_number : str
    slot_s : float
        Time from one slot to the next; the wheel goes the shorter way.
    home_s : float
        Time to find the first slot.
    names : list of str, optional
        Of the filters, at most eight characters each.
    """

    def __init__(
        self,
        clock: Clock,
        faults: Faults,
        wheel: str = "A",
        slot: int = 1,
        firmware: str = "2.04",
        serial_number: str = "20731",
        slot_s: float = 0.6,
        home_s: float = 5.0,
        names: list[str] | None = None,
    ) -> None:
        self._clock, self._faults = clock, faults
        self._wheel, self._slot = wheel, slot
        self._firmware, self._number = firmware, serial_number
        self._slot_s, self._home_s = slot_s, home_s
        self.slots = (SLOTS_IFW3 if firmware.startswith("3.") else SLOTS)[wheel]
        self._names = self._padded("".join(f"{n:8.8}" for n in names or []))
        self._serial_mode = self._dead = False
        self._pending = b""
        self._loading = 0
        self._end: tuple[float, int, str] | None = None
        self._answers = {
            "WI": lambda: self._wheel,
            "WF": lambda: str(self._slot),
            "WR": lambda: self._names,
            "WV": lambda: f"V= {self._firmware}",
            "WN": lambda: f"SN= {self._number}",
        }

    def slot_in_beam(self) -> int | None:
        """Which slot light goes through; none while the wheel turns. May be called from any thread."""
        end = self._end
        if end is None:
            return self._slot
        when, slot, _ = end
        return slot if self._clock.now() >= when else None

    def receive(self, data: bytes) -> bytes:
        """Answer the commands in the bytes so far."""
        said = self.due()
        # no command ends in CR or LF, and drivers that send them work
        self._pending += data.replace(b"\r", b"").replace(b"\n", b"")
        while len(self._pending) >= (size := self._loading or COMMAND):
            text, self._pending = self._pending[:size].decode("ascii", "replace"), self._pending[size:]
            said += self._store(text) if self._loading else self._obey(text)
        return said

    def due(self) -> bytes:
        """The end of a movement, when it has come."""
        if self._end is None or self._dead or self._clock.now() < self._end[0]:
            return b""
        _, self._slot, word = self._end
        self._end = None
        return self._said(word) if self._serial_mode else b""

    def _obey(self, command: str) -> bytes:
        if self._dead or self._faults.strikes("dead"):
            self._dead = True
            return b""
        if self._end is not None:
            # what comes before the end of a movement is lost
            return b""
        key = command[:2]
        if key == "WS":
            return self._enter()
        if self._faults.strikes("reset"):
            self._serial_mode = False
        if not self._serial_mode:
            return b""
        return self._act(key, command)

    def _act(self, key: str, command: str) -> bytes:
        if key == "WG":
            return self._goto(command[-1])
        if key == "WH":
            return self._home()
        if key == "WL":
            self._loading = 1 + NAME * self.slots
            return b""
        if key == "WE":
            self._serial_mode = False
            return self._said("END")
        answer = self._answers.get(key)
        return self._said(answer()) if answer else b""

    def _enter(self) -> bytes:
        if self._faults.strikes("silent-start"):
            return b""
        self._serial_mode = True
        noise = bytes.fromhex(self._faults.value("garbage", absent="", struck="ff 00 57 0d"))
        return noise + self._said("!")

    def _goto(self, where: str) -> bytes:
        refused = self._refused("goto-error")
        if refused:
            return refused
        if not where.isdigit() or not 1 <= int(where) <= self.slots:
            return self._said("ER=5")
        apart = abs(int(where) - self._slot)
        seconds = self._slot_s * min(apart, self.slots - apart)
        seconds += self._faults.value("late-star", absent=0.0)
        slip = 1 if self._faults.strikes("wrong-slot") else 0
        error = self._faults.value("goto-error", absent=0)
        arrived = self._slot if error else (int(where) - 1 + slip) % self.slots + 1
        self._end = (self._clock.now() + seconds, arrived, f"ER={error}" if error else "*")
        return b""

    def _home(self) -> bytes:
        refused = self._refused("home-error")
        if refused:
            return refused
        seconds = self._home_s + self._faults.value("slow-home", absent=0.0)
        error = self._faults.value("home-error", absent=0)
        # the maker's document prints a space here and none elsewhere
        word = f"ER= {error}" if error else self._wheel
        self._end = (self._clock.now() + seconds, self._slot if error else 1, word)
        return b""

    def _refused(self, fault: str) -> bytes:
        """What is said at once in place of a movement."""
        if self._faults.strikes("power-off"):
            return self._said("ER=8")
        at_once: int = self._faults.value(f"{fault}-at-once", absent=0)
        return self._said(f"ER={at_once}") if at_once else b""

    def _store(self, text: str) -> bytes:
        self._loading = 0
        self._names = self._padded(text[1:])
        return self._said("!")

    def _padded(self, names: str) -> str:
        return names.ljust(NAME * self.slots)

    def _said(self, text: str) -> bytes:
        end = b"\r\n" if self._faults.strikes("cr-lf") else b"\n\r"
        return text.encode() + end
