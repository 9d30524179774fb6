"""A table that a GRBL 1.1 board turns: its X axis counts degrees where a mill's counts millimetres.

Source: GRBL 1.1, "Grbl Interface Basics", "Grbl Commands" and "Grbl Settings".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Self

from pbrdf.errors import InstrumentError
from pbrdf.instruments.clock import Clock
from pbrdf.instruments.grbl_board import GrblBoard
from pbrdf.instruments.kinds import Identity, Rotator
from pbrdf.instruments.lines import LinePort
from pbrdf.instruments.manual import Operator
from pbrdf.instruments.movement import POLL_S, Movement, travel_time

BAUDRATE = 115200

HALT_POLLS = 50
"""Questions whether a movement has been stopped."""

PRINTED_DEG = 1e-3
"""Positions are printed with three decimals."""


@dataclass(frozen=True)
class Drive:
    """How the table is driven.

    Attributes
    ----------
    steps_per_deg : float
        Micro-steps of the motor for a degree of the table ($100).
    speed_deg_s : float
        ($110, which counts a minute.)
    acceleration_deg_s2 : float
        ($120).
    limits_deg : tuple of float
        Least and greatest angle of the arm that hits nothing.
    run_up_deg : float
        How far below its target the arm turns back where it comes from above: more than the gear's play.
    home_deg : float
        Angle of the arm at its zero: where homing leaves it, or where the operator puts it.
    has_switch : bool
        Whether the board finds that zero by a limit switch.
    homing_s : float
        How long that takes as a rule.
    """

    steps_per_deg: float
    speed_deg_s: float
    acceleration_deg_s2: float
    limits_deg: tuple[float, float]
    run_up_deg: float = 1.0
    home_deg: float = 0.0
    has_switch: bool = True
    homing_s: float = 30.0

    def settings(self) -> dict[int, float]:
        """The board's settings that say the same.

        Motors stay on between moves ($1), positions are the machine's ($10) and metric ($13).
        """
        return {
            1: 255.0,
            10: 1.0,
            13: 0.0,
            22: float(self.has_switch),
            100: self.steps_per_deg,
            110: 60.0 * self.speed_deg_s,
            120: self.acceleration_deg_s2,
        }

    def travel_s(self, places: Sequence[float]) -> float:
        """Seconds from place to place, with a stop at each."""
        return sum(
            travel_time(b - a, self.speed_deg_s, self.acceleration_deg_s2) for a, b in pairwise(places)
        )


class GrblTable(Rotator):
    """A table; `open` makes one. Its angles mean something after `home` alone.

    Parameters
    ----------
    board : GrblBoard
    clock : Clock
    drive : Drive
    operator : Operator, optional
        Who puts the arm at its zero where there is no switch.
    """

    def __init__(self, board: GrblBoard, clock: Clock, drive: Drive, operator: Operator | None) -> None:
        self._board, self._clock, self._drive, self._operator = board, clock, drive, operator
        self.name = board.name
        self.identity = Identity("", "", "")
        self._zero: float | None = None
        self._rising = False

    @classmethod
    def open(
        cls,
        url: str,
        name: str,
        clock: Clock,
        *,
        drive: Drive,
        operator: Operator | None = None,
        serial_number: str | None = None,
        reply_timeout_s: float = 2.0,
        poll_timeout_s: float = 0.05,
        log: str | Path | None = None,
    ) -> Self:
        """Open the port, reset the board, set its settings and read them back.

        Parameters
        ----------
        url, name : str
        clock : Clock
        drive : Drive
        operator : Operator, optional
            See the class.
        serial_number : str, optional
            What the board must have been told to remember by ``$I=``.
        reply_timeout_s, poll_timeout_s : float
        log : str or Path, optional
            See `LinePort`.

        Raises
        ------
        InstrumentError
            If nothing answers, or another board, or a setting does not take.
        """
        port = LinePort(
            url, name, BAUDRATE, reply_timeout_s=reply_timeout_s, poll_timeout_s=poll_timeout_s, log=log
        )
        try:
            board = GrblBoard(port)
            self = cls(board, clock, drive, operator)
            self.identity = board.identity(board.reset())
            if serial_number is not None and self.identity.serial != serial_number:
                raise self._error(
                    "serial number",
                    f"is `{self.identity.serial}`, not `{serial_number}`",
                    "correct the rig file or the cables, or have the board remember it by `$I=`",
                )
            board.adopt(drive.settings())
        except BaseException:
            port.close()
            raise
        return self

    def home(self) -> Movement:
        """Begin to look for the zero; without a switch, ask the operator to put the arm there."""
        self._zero = None
        self._rising = False
        if self._board.upset:
            # after some alarms it heeds a reset alone
            self._board.forget()
            self._board.upset = False
        if self._drive.has_switch:
            self._board.begin("$H")
            # a refusal comes at once
            found = self._homed()
            return Movement(
                self._clock,
                self.name,
                "search for zero",
                self._drive.homing_s,
                lambda: found or self._homed(),
                self.stop,
                4.0 * self._drive.homing_s,
            )
        if self._operator is None:
            raise self._error("home", "there is neither a switch nor an operator", "name one in the rig file")
        self._operator.ask(self.name, f"Turn the arm to {self._drive.home_deg:g}°, from lower angles.")
        if self._board.status().state == "Alarm":
            self._board.command("$X")
        self._found(self._board.status().position)
        return Movement(self._clock, self.name, "search for zero", 0.0, lambda: True, self.stop)

    def move_to(self, angle_deg: float) -> Movement:
        """Begin to turn, in the end from lower angles.

        Raises
        ------
        InstrumentError
            If the arm may not go there, which is seen before a byte is written; if it could not come from
            below, or its zero is not known, before anything moves.
        """
        places = self._places(angle_deg)
        feed = 60.0 * self._drive.speed_deg_s
        self._rising = False
        for place in places[1:]:
            # G53: no offset that somebody left in the board's memory moves the target
            self._board.command(f"G21G90G94G53G1X{place + self._known_zero():.4f}F{feed:.3f}")
        return Movement(
            self._clock,
            self.name,
            f"move to {angle_deg:.3f}°",
            self._drive.travel_s(places),
            lambda: self._arrived(angle_deg),
            self.stop,
        )

    def position_deg(self) -> float:
        """Where the board counts the arm to be; raises `InstrumentError` before homing."""
        zero = self._known_zero()
        return self._board.status().position - zero

    def stop(self) -> None:
        """Slow down, stop and forget the movement; the zero stays known if the arm came to rest."""
        self._rising = False
        # while it looks for its zero it heeds a reset alone
        if self._zero is not None and not self._came_to_rest():
            self._zero = None
        self._board.forget()

    def close(self) -> None:
        """Let go of the port; the board holds the arm where it is."""
        self._board.close()

    def _places(self, angle_deg: float) -> list[float]:
        """Where the arm is, where it turns back if it does, and where it goes."""
        low, high = self._drive.limits_deg
        if not low <= angle_deg <= high:
            raise self._error(
                "angle",
                f"{angle_deg:g}° is not within {low:g}° to {high:g}°",
                "choose one where it hits nothing",
            )
        here = self.position_deg()
        if self._rising and angle_deg >= here - self._tolerance():
            return [here, angle_deg]
        below = angle_deg - self._drive.run_up_deg
        if below < low:
            raise self._error(
                "angle",
                f"{angle_deg:g}° cannot be approached from {self._drive.run_up_deg:g}° below: limit {low:g}°",
                "choose a greater one, or lower the limit if the arm hits nothing there",
            )
        return [here, below, angle_deg]

    def _arrived(self, angle_deg: float) -> bool:
        status = self._board.status()
        if status.state in ("Alarm", "Door", "Sleep"):
            self._board.upset = True
            raise self._error("state", f"is {status.state}", "remove the cause, then home it")
        off = abs(status.position - self._known_zero() - angle_deg)
        if status.state != "Idle" or off > self._tolerance():
            return False
        self._rising = True
        return True

    def _homed(self) -> bool:
        said = self._board.hints()
        refused = [line for line in said if line.startswith("error:")]
        if refused:
            raise self._error(
                "$H", f"{refused[0]}: it refuses to look for its zero", "see the board's settings"
            )
        if "ok" not in said:
            return False
        self._found(self._board.status().position)
        return True

    def _came_to_rest(self) -> bool:
        self._board.halt()
        for _ in range(HALT_POLLS):
            if any(line.startswith(("<Hold:0", "<Idle")) for line in self._board.hints()):
                return True
            self._clock.sleep(POLL_S)
        return False

    def _found(self, position: float) -> None:
        self._zero = position - self._drive.home_deg
        self._board.upset = False

    def _known_zero(self) -> float:
        if self._board.upset:
            self._zero = None
        if self._zero is None:
            raise self._error("angle", "its zero is not known", "home it first")
        return self._zero

    def _tolerance(self) -> float:
        return PRINTED_DEG + 1.0 / self._drive.steps_per_deg

    def _error(self, field: str, problem: str, remedy: str) -> InstrumentError:
        return InstrumentError(self.name, field, problem, remedy)
