"""What covers the lamp for dark frames, where the filter wheel has no blank slot."""

from __future__ import annotations

from typing import Protocol

import serial

from pbrdf.errors import InstrumentError
from pbrdf.instruments.manual import Operator
from pbrdf.instruments.ports import open_port, set_rts

RELAY_BAUDRATE = 9600


class LightSwitch(Protocol):
    """Lets the lamp's light through, or not."""

    def turn(self, on: bool) -> None:
        """Do it, and return when it is done; raises `InstrumentError` if it cannot."""

    def close(self) -> None:
        """Let go of its port, with the light on; may be called twice."""


class RelaySwitch:
    """A relay in the lamp's supply, on the RTS line of a serial port (`LightSwitch`).

    Parameters
    ----------
    url : str
        The port, see `pbrdf.instruments.ports.open_port`.

    Raises
    ------
    InstrumentError
        If the port cannot be opened.
    """

    def __init__(self, url: str) -> None:
        self._name = f"lamp's relay at {url}"
        self._port: serial.SerialBase | None = open_port(url, "lamp's relay", RELAY_BAUDRATE)

    def turn(self, on: bool) -> None:
        """Raise or lower the line."""
        if self._port is None:
            raise InstrumentError(self._name, "port", "is closed", "open it again")
        set_rts(self._port, on)

    def close(self) -> None:
        """Let go of the port, with the light on."""
        if self._port is not None:
            set_rts(self._port, True)
            self._port.close()
        self._port = None


class OperatorSwitch:
    """A person with a cap (`LightSwitch`)."""

    def __init__(self, operator: Operator) -> None:
        self._operator = operator
        self._on = True

    def turn(self, on: bool) -> None:
        """Ask for it, unless it is so already."""
        if on != self._on:
            self._operator.ask("lamp", "Uncover the lamp." if on else "Cover the lamp.")
        self._on = on

    def close(self) -> None:
        """Have the lamp uncovered."""
        self.turn(True)
