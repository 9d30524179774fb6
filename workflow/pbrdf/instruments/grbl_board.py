"""A conversation with a GRBL 1.1 board: lines and their answers, alarms and resets that nobody asked for.

Source: GRBL 1.1, "Grbl Interface Basics".
"""

from __future__ import annotations

from pbrdf.errors import InstrumentError
from pbrdf.instruments.grbl_words import (
    ALARMS,
    BANNER,
    ERRORS,
    SETTING,
    VERSION,
    Status,
    number_of,
    status_of,
)
from pbrdf.instruments.kinds import Identity
from pbrdf.instruments.lines import LinePort

RESET = b"\x18"
HOLD = b"!"
ASK = b"?"

ATTEMPTS = 4
"""Resets until a banner: an Arduino's boot loader swallows what comes in the first two seconds."""

SETTING_TOLERANCE = 6e-4
"""Settings are printed with three decimals."""


class GrblBoard:
    """A board behind a port.

    Parameters
    ----------
    port : LinePort

    Attributes
    ----------
    upset : bool
        Whether it was in alarm or was reset since this was last set to False: its position means nothing.
    """

    def __init__(self, port: LinePort) -> None:
        self._port = port
        self.upset = False

    @property
    def name(self) -> str:
        """What it is, and its port."""
        return self._port.name

    def close(self) -> None:
        """Let go of the port."""
        self._port.close()

    def reset(self) -> str:
        """Reset it and return its banner.

        Raises
        ------
        InstrumentError
            If there is none, or it is not GRBL 1.1's.
        """
        for _ in range(ATTEMPTS):
            self._port.write(RESET)
            while (line := self._port.line()) is not None:
                found = BANNER.search(line)
                if found is not None:
                    self._port.drain()
                    if not found.group(2).startswith("1.1"):
                        raise self._error("firmware", f"is {found.group(0)}", "install GRBL 1.1 or GrblHAL")
                    return found.group(0)
        raise self._error(
            "reset", "was not answered", "see that the board has power and that the port is its own"
        )

    def identity(self, banner: str) -> Identity:
        """What it says it is; its serial number is what ``$I=`` had it remember."""
        for line in self.command("$I"):
            found = VERSION.match(line)
            if found is not None:
                return Identity(banner.split()[0], found.group(2), found.group(1))
        return Identity(banner.split()[0], "", banner.split()[1])

    def command(self, line: str) -> list[str]:
        """Send a line and return what it answers before ``ok``, which says that the line is understood.

        Raises
        ------
        InstrumentError
            If the answer is ``error:n`` or does not come, or the board is in alarm or was reset.
        """
        self.begin(line)
        said: list[str] = []
        while (answer := self._port.line()) is not None:
            if answer == "ok":
                return said
            if answer.startswith("error:"):
                number = number_of(answer)
                raise self._error(
                    line, f"{answer}: {ERRORS.get(number, 'an error of its own')}", "see the board's settings"
                )
            self.heed(answer)
            said.append(answer)
        raise self._error(line, "was not answered", "see to the board's power and its cable, then run again")

    def status(self) -> Status:
        """How it stands.

        Raises
        ------
        InstrumentError
            If it does not say, is in alarm, or was reset.
        """
        self._heed_all()
        self._port.write(ASK)
        while (line := self._port.line()) is not None:
            status = status_of(line)
            if status is not None:
                return status
            self.heed(line)
        raise self._error("?", "was not answered", "see to the board's power and its cable, then run again")

    def hints(self) -> list[str]:
        """Ask how it stands, and return what comes soon: nothing while it looks for its zero."""
        self._port.write(ASK)
        said: list[str] = []
        while (line := self._port.poll()) is not None:
            self.heed(line)
            said.append(line)
        return said

    def begin(self, line: str) -> None:
        """Send a line whose ``ok`` comes when all is done."""
        self._heed_all()
        self._port.write(line.encode() + b"\n")

    def halt(self) -> None:
        """Slow down and stop, without losing steps; `forget` ends the movement."""
        self._port.write(HOLD)

    def forget(self) -> None:
        """Reset it and let it forget what it was to do."""
        self._port.drain()
        self.reset()

    def heed(self, line: str) -> None:
        """Raise `InstrumentError` if a line tells of an alarm or a reset that nobody asked for."""
        if line.startswith("ALARM:"):
            self.upset = True
            problem = f"{line}: {ALARMS.get(number_of(line), 'an alarm of its own')}"
            raise self._error("alarm", problem, "remove the cause, then home it")
        if BANNER.search(line):
            self.upset = True
            raise self._error(
                "reset", "it was reset while it worked", "see to its power and its cable, then home it"
            )

    def settings(self) -> dict[int, float]:
        """All settings that are numbers, by number; GrblHAL has others."""
        found = (SETTING.fullmatch(line) for line in self.command("$$"))
        return {int(one.group(1)): float(one.group(2)) for one in found if one is not None}

    def adopt(self, wanted: dict[int, float]) -> None:
        """Set what differs, which wears its memory, and read all back.

        Raises
        ------
        InstrumentError
            If one is another than was set.
        """
        before = self.settings()
        changed = {key: value for key, value in wanted.items() if not _same(before.get(key), value)}
        for key, value in changed.items():
            self.command(f"${key}={value:.3f}".rstrip("0").rstrip("."))
        after = self.settings() if changed else before
        for key, value in wanted.items():
            if not _same(after.get(key), value):
                raise self._error(
                    f"${key}",
                    f"is {after.get(key)} after it was set to {value:g}",
                    "see the board's settings",
                )

    def _heed_all(self) -> None:
        # what came late belongs to no later question
        for line in self._port.come():
            self.heed(line)

    def _error(self, field: str, problem: str, remedy: str) -> InstrumentError:
        return InstrumentError(self.name, field, problem, remedy)


def _same(found: float | None, wanted: float) -> bool:
    return found is not None and abs(found - wanted) <= SETTING_TOLERANCE
