"""Optec's intelligent filter wheels IFW, IFW2 and IFW3, by their serial commands.

Source: Optec, "IFW Serial Commands" (IFW-Serial.md) and its own Python program (fw-python): commands of six
characters without an end, answers that end in LF CR, or CR LF from some firmware.
"""

from __future__ import annotations

import contextlib
import re
from pathlib import Path
from typing import Self

from pbrdf.errors import InstrumentError
from pbrdf.instruments.clock import Clock
from pbrdf.instruments.kinds import FilterWheel, Identity
from pbrdf.instruments.lines import LinePort
from pbrdf.instruments.movement import Movement

BAUDRATE = 19200
ATTEMPTS = 6
"""Calls for serial mode: the first may be lost, and a wheel that still turns answers none."""

LONGEST_S = 30.0
"""What the maker's own program waits for the end of a movement."""

SLOTS = {"A": 5, "B": 5, "C": 5, "D": 5, "E": 5, "F": 8, "G": 8, "H": 8, "I": 7, "J": 7, "K": 7}
"""How many slots a wheel has, by its letter, in an IFW or IFW2."""

SLOTS_IFW3 = {"A": 9, "B": 9, "C": 6, "D": 6, "E": 6, "F": 5, "G": 5, "H": 5}
"""The same in an IFW3: firmware 3."""

ERRORS = {
    1: ("found no first slot in 2600 steps", "see that the wheel turns freely and does not slip"),
    2: ("finds the pulses of its SBIG input out of bounds", "unplug what is connected to that input"),
    3: ("does not know the wheel", "see that the wheel sits right and bears its magnets"),
    4: ("could not leave its slot", "see that nothing blocks the wheel"),
    5: ("calls the slot invalid", "name a slot of this wheel in the rig file"),
    6: ("did not reach the slot", "see that the wheel does not slip"),
    7: ("has no such slot in this wheel", "name a slot of this wheel in the rig file"),
    8: ("has no 12 V", "plug in its power supply"),
}
"""What ER=n says, and what to do."""

LOST = frozenset({1, 4, 6, 8})
"""Errors after which the wheel may stand anywhere."""


class OptecIFW(FilterWheel):
    """A filter wheel of the IFW family; `open` makes one.

    Parameters
    ----------
    port : LinePort
    clock : Clock
    turn_s : float
        How long a turn to another slot takes as a rule.
    home_s : float
        How long it takes to find the first slot as a rule.
    """

    def __init__(self, port: LinePort, clock: Clock, turn_s: float, home_s: float) -> None:
        self._port, self._clock = port, clock
        self._turn_s, self._home_s = turn_s, home_s
        self._turning = ""
        self._lost = False
        self._slots = 0
        self.name = port.name
        self.identity = Identity("", "", "")

    @classmethod
    def open(
        cls,
        url: str,
        name: str,
        clock: Clock,
        *,
        serial_number: str | None = None,
        wheel: str | None = None,
        turn_s: float = 3.0,
        home_s: float = 7.0,
        reply_timeout_s: float = 2.0,
        poll_timeout_s: float = 0.05,
        log: str | Path | None = None,
    ) -> Self:
        """Open the port, enter serial mode and read what is there.

        Parameters
        ----------
        url, name : str
        clock : Clock
        serial_number, wheel : str, optional
            What must be there: the controller's number, and the letter of the wheel in it.
        turn_s, home_s : float
            See the class.
        reply_timeout_s, poll_timeout_s : float
        log : str or Path, optional
            See `LinePort`.

        Raises
        ------
        InstrumentError
            If nothing answers, or something else than was asked for.
        """
        port = LinePort(
            url, name, BAUDRATE, reply_timeout_s=reply_timeout_s, poll_timeout_s=poll_timeout_s, log=log
        )
        try:
            self = cls(port, clock, turn_s, home_s)
            self._begin()
            self._expect("serial number", self.identity.serial, serial_number)
            self._expect("wheel", self._wheel, wheel)
        except BaseException:
            port.close()
            raise
        return self

    @property
    def slots(self) -> int:
        """How many there are, from the letter of the wheel."""
        return self._slots

    def home(self) -> Movement:
        """Begin to look for the first slot."""
        self._refuse_while_turning("WHOMES")
        self._port.write(b"WHOMES")
        return self._begun("WHOMES", "search for the first slot", self._home_s)

    def select(self, slot: int) -> Movement:
        """Begin to turn to a slot.

        Raises
        ------
        InstrumentError
            If the wheel has no such slot, has lost its place, or still turns; nothing is sent then.
        """
        if not 1 <= slot <= self._slots:
            raise InstrumentError(
                self.name, "slot", f"{slot} is not one of 1 to {self._slots}", "name a slot of this wheel"
            )
        if self._lost:
            raise InstrumentError(self.name, "slot", "the wheel has lost its place", "home it first")
        self._refuse_while_turning(f"WGOTO{slot}")
        self._port.write(f"WGOTO{slot}".encode())
        return self._begun(f"WGOTO{slot}", f"turn to slot {slot}", self._turn_s)

    def slot(self) -> int:
        """Which is in the beam, as read back."""
        self._refuse_while_turning("WFILTR")
        reply = self._ask("WFILTR")
        if not re.fullmatch(r"[1-9]", reply):
            raise self._strange("WFILTR", reply)
        return int(reply)

    def close(self) -> None:
        """Leave serial mode, so that the wheel's own buttons work again, and let go of the port."""
        if not self._turning:
            # a wheel that has gone needs no farewell
            with contextlib.suppress(InstrumentError):
                self._port.write(b"WEXITS")
        self._port.close()

    def _begin(self) -> None:
        self._enter_serial_mode()
        firmware, number = self._told("WVxxxx", "V"), self._told("WNxxxx", "SN")
        third = firmware.startswith("3.")
        self.identity = Identity("Optec IFW3" if third else "Optec IFW", number, firmware)
        self._wheel = self._ask("WIDENT")
        self._slots = (SLOTS_IFW3 if third else SLOTS).get(self._wheel, 0)
        if not self._slots:
            raise self._strange("WIDENT", self._wheel)

    def _enter_serial_mode(self) -> None:
        self._port.drain()
        for _ in range(ATTEMPTS):
            if self._called():
                return
        raise InstrumentError(
            self.name,
            "WSMODE",
            "has not been answered",
            "see that the wheel has power and that the port is the wheel's",
        )

    def _called(self) -> bool:
        """Whether a call for serial mode was answered; the end of an earlier movement may come first."""
        self._port.write(b"WSMODE")
        while (line := self._port.line()) is not None:
            if line.endswith("!"):
                # answers to earlier calls, given late
                self._port.drain()
                return True
        return False

    def _told(self, command: str, key: str) -> str:
        """The value of ``key= value``, empty where the firmware does not know the command."""
        self._port.write(command.encode())
        line = self._port.line() or ""
        found = re.fullmatch(rf"{key}= *(\S+)", line)
        return found.group(1) if found else ""

    def _expect(self, field: str, found: str, wanted: str | None) -> None:
        if wanted is not None and found != wanted:
            raise InstrumentError(
                self.name,
                field,
                f"is {found or 'not told'}, not {wanted}",
                "correct the rig file, or the cables",
            )

    def _ask(self, command: str) -> str:
        self._port.write(command.encode())
        line = self._port.line()
        if line is None:
            self._lost = True
            raise InstrumentError(self.name, command, *self._silence())
        self._raise_error(command, line)
        return line

    def _silence(self) -> tuple[str, str]:
        if self._called():
            return "was not answered: the wheel had left serial mode", "see to its power, then home it"
        return "was not answered", "see to its power and its cable, then run again"

    def _raise_error(self, command: str, line: str) -> None:
        found = re.fullmatch(r"ER= *(\d)", line)
        if found is None:
            return
        number = int(found.group(1))
        self._lost = self._lost or number in LOST
        problem, remedy = ERRORS.get(number, ("tells an unknown error", "ask its maker"))
        raise InstrumentError(self.name, command, f"ER={number}: {problem}", remedy)

    def _strange(self, command: str, reply: str) -> InstrumentError:
        return InstrumentError(
            self.name, command, f"was answered by `{reply}`", "see that the port is an Optec IFW's"
        )

    def _refuse_while_turning(self, command: str) -> None:
        if self._turning:
            raise InstrumentError(
                self.name, command, f"cannot be sent before {self._turning} has ended", "await the movement"
            )

    def _begun(self, command: str, what: str, expected_s: float) -> Movement:
        self._turning = command
        # a refusal comes at once
        refusal = self._port.poll()
        come = [refusal] if refusal is not None else []
        return Movement(
            self._clock,
            self.name,
            what,
            expected_s,
            lambda: self._arrived(command, come),
            self._give_up,
            max(LONGEST_S, 2.0 * expected_s),
        )

    def _arrived(self, command: str, come: list[str]) -> bool:
        line = come.pop() if come else self._port.poll()
        if line is None:
            return False
        self._turning = ""
        self._raise_error(command, line)
        if command == "WHOMES":
            return self._homed(line)
        if line != "*":
            raise self._strange(command, line)
        return self._verified(command, int(command[-1]))

    def _homed(self, line: str) -> bool:
        if line != self._wheel:
            raise InstrumentError(
                self.name,
                "WHOMES",
                f"found wheel {line} where {self._wheel} was",
                "run again if the wheel was changed",
            )
        self._lost = False
        return self._verified("WHOMES", 1)

    def _verified(self, command: str, wanted: int) -> bool:
        slot = self.slot()
        if slot != wanted:
            self._lost = True
            raise InstrumentError(
                self.name,
                command,
                f"ended in slot {slot}, not {wanted}",
                "see that the wheel does not slip, then home it",
            )
        return True

    def _give_up(self) -> None:
        # there is no command to stop it, and none may be sent while it turns
        self._lost = True
        self._turning = ""
