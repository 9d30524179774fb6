"""Questions and answers with a Thorlabs stage over its port."""

from __future__ import annotations

import termios
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import serial

from pbrdf.errors import InstrumentError
from pbrdf.instruments.apt_messages import CHANNEL, HOST, STAGE, Id, Message, MessageReader, decode_complaint
from pbrdf.instruments.clock import Clock
from pbrdf.instruments.ports import open_port, set_rts

_BAUDRATE = 115200
_DWELL_S = 0.05
_PAUSE_S = 0.003
_ATTEMPTS = 2


class AptLink:
    """The port of one stage.

    Parameters
    ----------
    url : str
        What pyserial's `serial_for_url` takes.
    name : str
        What it is in the rig.
    clock : Clock
    reply_timeout_s : float
        Longest wait for an answer.
    log : str, optional
        File to which all bytes are added.

    Raises
    ------
    InstrumentError
        Here, if the port cannot be opened; in all methods, if it is lost.

    Notes
    -----
    Opened as the protocol asks: dwell, purge, dwell, ready to receive; then the stage is told not to speak
    unasked. Messages are told by their number, never by their order, so one that comes unasked does no harm.
    """

    def __init__(
        self, url: str, name: str, clock: Clock, reply_timeout_s: float, log: str | None = None
    ) -> None:
        self.name = f"{name} at {url}"
        self._clock, self._timeout = clock, reply_timeout_s
        self._reader = MessageReader(dests=(0x00, HOST), sources=(0x00, STAGE))
        self._port: serial.SerialBase = open_port(
            url, name, _BAUDRATE, rtscts=True, timeout_s=reply_timeout_s, log=log
        )
        try:
            self._begin()
        except InstrumentError:
            self.close()
            raise

    def _begin(self) -> None:
        self._clock.sleep(_DWELL_S)
        with self._watched():
            self._port.reset_input_buffer()
            self._port.reset_output_buffer()
        self._clock.sleep(_DWELL_S)
        with self._watched():
            set_rts(self._port, True)
        self.tell(Id.HW_NO_FLASH_PROGRAMMING, 0)
        self.tell(Id.HW_STOP_UPDATES, 0)

    def tell(self, number: Id, param1: int = CHANNEL, param2: int = 0, payload: bytes = b"") -> None:
        """Send a message."""
        # messages in quick succession are lost by some firmware
        self._clock.sleep(_PAUSE_S)
        with self._watched():
            self._port.write(Message(number, param1, param2, payload).encode())

    def ask(self, number: Id, answer: Id, param1: int = CHANNEL) -> Message:
        """Ask until the answer comes; what came before the question is none.

        Raises
        ------
        InstrumentError
            If there is no answer to the question, put twice, or the stage complains.
        """
        for _ in range(_ATTEMPTS):
            self._drain()
            self.tell(number, param1)
            for message in self._heard():
                if message.id == answer:
                    return message
        raise InstrumentError(
            self.name,
            "answer",
            f"none to {number.name}",
            "see that its power is on and that the port is that of a K10CR1",
        )

    def close(self) -> None:
        """Let go of the port."""
        with suppress(OSError, termios.error):
            self._port.close()

    def _drain(self) -> None:
        with self._watched():
            while waiting := self._port.in_waiting:
                self._port.read(waiting)
        self._reader.clear()

    def _heard(self) -> Iterator[Message]:
        """Messages as they come, until nothing comes or the answer has had its time."""
        deadline = time.monotonic() + self._timeout
        while time.monotonic() <= deadline:
            with self._watched():
                data = self._port.read(self._reader.missing)
            if not data:
                return
            for message in self._reader.feed(data):
                self._refuse_complaint(message)
                yield message

    def _refuse_complaint(self, message: Message) -> None:
        if message.id == Id.HW_RICH_RESPONSE:
            words = decode_complaint(message.payload)
        elif message.id == Id.HW_RESPONSE:
            words = "an error without a name"
        else:
            return
        raise InstrumentError(
            self.name, "report", f"the stage reports {words}", "switch it off and on, then run again"
        )

    @contextmanager
    def _watched(self) -> Iterator[None]:
        """Make a lost port an `InstrumentError`."""
        try:
            yield
        except (OSError, termios.error) as error:
            raise InstrumentError(
                self.name,
                "port",
                f"is lost ({error})",
                "see that its cable is plugged in and which port it has now, then run again",
            ) from None
