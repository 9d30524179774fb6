"""Conversations in lines of text, as filter wheels and motion controllers hold them."""

from __future__ import annotations

import math
import re
from pathlib import Path

import serial

from pbrdf.errors import InstrumentError
from pbrdf.instruments.ports import open_port

LINE_ENDS = re.compile(rb"[\r\n]+")

BABBLE = 1000
"""Pieces, or lines, after which nobody waits for an end any longer."""


class LinePort:
    """A port whose answers are lines, ended by CR, LF or both in either order; empty lines are dropped.

    Parameters
    ----------
    url, name : str
        See `pbrdf.instruments.ports.open_port`.
    baudrate : int
    reply_timeout_s : float
        Longest wait for an answer.
    poll_timeout_s : float
        Longest wait for what may or may not come.
    log : str or Path, optional
        File to which every byte is added.

    Raises
    ------
    InstrumentError
        If the port cannot be opened; later, from every method, if it has gone.
    """

    def __init__(
        self,
        url: str,
        name: str,
        baudrate: int,
        *,
        reply_timeout_s: float,
        poll_timeout_s: float,
        log: str | Path | None = None,
    ) -> None:
        self._port = open_port(url, name, baudrate, timeout_s=reply_timeout_s, log=log)
        self._port.timeout = poll_timeout_s
        self.name = f"{name} at {url}"
        self._waits = max(1, math.ceil(reply_timeout_s / poll_timeout_s))
        self._begun = b""
        self._lines: list[str] = []

    def write(self, data: bytes) -> None:
        """Send bytes as they are."""
        try:
            self._port.write(data)
        except (serial.SerialException, OSError) as error:
            raise self._gone(error) from None

    def poll(self) -> str | None:
        """The next line, or None after a short wait in which nothing came."""
        for _ in range(BABBLE):
            if self._lines or not self._read():
                break
        return self._lines.pop(0) if self._lines else None

    def line(self) -> str | None:
        """The next line, if one comes within the wait for an answer."""
        for _ in range(self._waits):
            line = self.poll()
            if line is not None:
                return line
        return None

    def come(self) -> list[str]:
        """The lines that are there without any wait."""
        if self._waiting():
            self._read()
        lines, self._lines = self._lines, []
        return lines

    def drain(self) -> None:
        """Forget what comes until nothing does, within bounds."""
        for _ in range(BABBLE):
            if self.poll() is None:
                break
        self._begun, self._lines = b"", []

    def close(self) -> None:
        """Let go of the port; may be called twice."""
        self._port.close()

    def _waiting(self) -> int:
        try:
            return int(self._port.in_waiting)
        except (serial.SerialException, OSError) as error:
            raise self._gone(error) from None

    def _read(self) -> bool:
        """Take what comes; whether anything did."""
        size = max(1, self._waiting())
        try:
            data = self._port.read(size)
        except (serial.SerialException, OSError) as error:
            raise self._gone(error) from None
        *whole, self._begun = LINE_ENDS.split(self._begun + data)
        self._lines += [line.decode("ascii", "replace").strip() for line in whole if line.strip()]
        return bool(data)

    def _gone(self, error: Exception) -> InstrumentError:
        return InstrumentError(
            self.name,
            "port",
            f"has gone ({error})",
            "see to its cable and its power; its port may have another name now; then run again",
        )
