"""Emulated devices behind a pseudo-terminal or a socket, as a driver would find them."""

from __future__ import annotations

import contextlib
import os
import pty
import select
import socket
import threading
import tty
from typing import Protocol

from pbrdf.instruments.closing import Closing

TICK_S = 0.02
"""Longest wait between two looks at what a device has to say on its own."""

FIRST_TICK_S = 2e-4
"""The first such wait after bytes from the driver, since more is often due soon; each is twice the last."""


class Device(Protocol):
    """What speaks at the far end of a wire. Called from the server's thread alone."""

    def receive(self, data: bytes) -> bytes:
        """Bytes from the driver, in pieces of any size; returns what it answers at once."""

    def due(self) -> bytes:
        """What it says on its own by now."""


class PtyServer(Closing):
    """A device behind a pseudo-terminal; `url` is the port that a driver opens. A context that ends it.

    A pseudo-terminal does not tell when it is opened, so there is no banner; what nobody reads is lost with
    `unplug`.
    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self._wake, self._woken = os.pipe()
        self._plug()

    def _plug(self) -> None:
        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        self.url = os.ttyname(self._slave)
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def unplug(self) -> None:
        """Pull the cable: whoever has the port open meets an error."""
        os.write(self._woken, b".")
        self._thread.join()
        os.read(self._wake, 1)
        for end in (self._master, self._slave):
            with contextlib.suppress(OSError):
                os.close(end)

    def plug_in(self) -> None:
        """Put it back; `url` may be another one now."""
        self._plug()

    def close(self) -> None:
        """End it."""
        self.unplug()
        os.close(self._wake)
        os.close(self._woken)

    def _serve(self) -> None:
        tick = TICK_S
        while True:
            ready, _, _ = select.select([self._master, self._wake], [], [], tick)
            tick = min(2.0 * tick, TICK_S)
            if self._wake in ready:
                return
            if self._master in ready:
                tick = FIRST_TICK_S
                self._say(self._device.receive(os.read(self._master, 4096)))
            self._say(self._device.due())

    def _say(self, data: bytes) -> None:
        while data:
            data = data[os.write(self._master, data) :]


class SocketServer(Closing):
    """A device behind a TCP port of this machine, one driver at a time; `url` is ``socket://127.0.0.1:port``."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        self.url = f"socket://127.0.0.1:{self.port}"
        self._wake, self._woken = os.pipe()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End it."""
        os.write(self._woken, b".")
        self._thread.join()
        self._listener.close()
        os.close(self._wake)
        os.close(self._woken)

    def _serve(self) -> None:
        while True:
            ready, _, _ = select.select([self._listener.fileno(), self._wake], [], [])
            if self._wake in ready:
                return
            driver, _ = self._listener.accept()
            with driver:
                if not self._converse(driver):
                    return

    def _converse(self, driver: socket.socket) -> bool:
        """Until the driver leaves; False when the server is to end."""
        tick = TICK_S
        with contextlib.suppress(ConnectionError, BrokenPipeError):
            while True:
                ready, _, _ = select.select([driver.fileno(), self._wake], [], [], tick)
                tick = min(2.0 * tick, TICK_S)
                if self._wake in ready:
                    return False
                if driver.fileno() in ready:
                    data = driver.recv(4096)
                    if not data:
                        return True
                    tick = FIRST_TICK_S
                    driver.sendall(self._device.receive(data))
                driver.sendall(self._device.due())
        return True
