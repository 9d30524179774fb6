"""A person who does what no instrument does, and a table that such a person turns."""

from __future__ import annotations

import contextlib
import math
import os
import sys
from collections.abc import Callable
from pathlib import Path

from pbrdf.errors import InstrumentError
from pbrdf.instruments.clock import Clock
from pbrdf.instruments.kinds import Identity, Rotator
from pbrdf.instruments.movement import Movement


class Operator:
    """Whoever sits at the terminal.

    Parameters
    ----------
    terminal : str or Path, optional
        By default the terminal of standard input, or the one that this program was started from:
        a rule's standard input is not a terminal.
    """

    def __init__(self, terminal: str | Path | None = None) -> None:
        self._terminal = terminal

    def ask(self, instrument: str, task: str) -> str:
        """Show a task, wait for Enter and return what was typed before it.

        Raises
        ------
        InstrumentError
            If there is no terminal, or it was closed without an answer.
        """
        path = _terminal() if self._terminal is None else self._terminal
        try:
            with contextlib.closing(_Terminal(path)) as terminal:
                terminal.show(f"\n{instrument}: {task} Then press Enter: ")
                answer = terminal.line()
        except OSError as error:
            raise InstrumentError(
                instrument,
                "operator",
                f"there is no terminal to ask on ({error.strerror})",
                "run it from a terminal, or name an instrument that does it in the rig file",
            ) from None
        if not answer.endswith("\n"):
            raise InstrumentError(instrument, "operator", "the question was not answered", "run again")
        return answer.strip()


class _Terminal:
    def __init__(self, path: str | Path) -> None:
        # neither made if it is not there, nor made the terminal that controls this program
        self._descriptor = os.open(path, os.O_RDWR | os.O_NOCTTY)

    def show(self, text: str) -> None:
        data = text.encode()
        while data:
            data = data[os.write(self._descriptor, data) :]

    def line(self) -> str:
        """Up to and with the end of the line, without it if the terminal was closed."""
        data = b""
        while not data.endswith(b"\n"):
            more = os.read(self._descriptor, 4096)
            if not more:
                break
            data += more
        return data.decode(errors="replace")

    def close(self) -> None:
        os.close(self._descriptor)


class ManualTable(Rotator):
    """A table that the operator turns by hand, and whose scale the operator reads.

    Parameters
    ----------
    name : str
    clock : Clock
    operator : Operator
    limits_deg : tuple of float
        Least and greatest angle of the arm that hits nothing.
    tolerance_deg : float
        How far from its target the arm may be left.
    """

    def __init__(
        self,
        name: str,
        clock: Clock,
        operator: Operator,
        limits_deg: tuple[float, float],
        tolerance_deg: float = 0.1,
    ) -> None:
        self.name, self.identity = f"{name} by hand", Identity("manual table", "", "")
        self._clock, self._operator = clock, operator
        self._limits, self._tolerance = limits_deg, tolerance_deg
        self._angle: float | None = None

    def home(self) -> Movement:
        """Begin to read where it stands: a scale needs no search."""
        return self._movement("reading of the scale", self._read)

    def move_to(self, angle_deg: float) -> Movement:
        """Begin to turn; the operator is asked when the movement is awaited."""
        low, high = self._limits
        if not low <= angle_deg <= high:
            raise InstrumentError(
                self.name,
                "angle",
                f"{angle_deg:g}° is not within {low:g}° to {high:g}°",
                "choose one where it hits nothing",
            )
        return self._movement(f"move to {angle_deg:.3f}°", lambda: self._turned(angle_deg))

    def position_deg(self) -> float:
        """What the operator read or confirmed last; raises `InstrumentError` before that."""
        if self._angle is None:
            raise InstrumentError(self.name, "angle", "is not known yet", "home it first")
        return self._angle

    def stop(self) -> None:
        """Nothing moves by itself."""

    def close(self) -> None:
        """There is no port."""

    def _movement(self, what: str, arrived: Callable[[], bool]) -> Movement:
        # nobody hurries a person
        return Movement(self._clock, self.name, what, 0.0, arrived, self.stop, math.inf)

    def _read(self) -> bool:
        answer = self._operator.ask(self.name, "Type the angle in degrees that its scale shows.")
        self._angle = _number(answer)
        return self._angle is not None

    def _turned(self, angle_deg: float) -> bool:
        self._angle = None
        answer = self._operator.ask(
            self.name,
            f"Turn the arm to {angle_deg:.3f}°, in the end from lower angles; "
            "type the angle if its scale shows another.",
        )
        angle = _number(answer) if answer else angle_deg
        if angle is None or abs(angle - angle_deg) > self._tolerance:
            return False
        self._angle = angle
        return True


def _number(text: str) -> float | None:
    try:
        return float(text.replace(",", ".").rstrip("°"))
    except ValueError:
        return None


def _terminal() -> str:
    return os.ttyname(sys.stdin.fileno()) if sys.stdin is not None and sys.stdin.isatty() else "/dev/tty"
