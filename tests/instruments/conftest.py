"""Emulated instruments behind ports, for the tests of their drivers."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from pbrdf.instruments.apt_messages import CHANNEL, Id, Message
from pbrdf.instruments.emulators.clock import VirtualClock
from pbrdf.instruments.emulators.faults import Faults
from pbrdf.instruments.emulators.k10cr1 import K10CR1Emulator
from pbrdf.instruments.emulators.server import PtyServer
from pbrdf.instruments.k10cr1 import K10CR1


class StageBench:
    """A stage behind a port, and what the driver writes to it."""

    def __init__(self, **parameters: Any) -> None:
        self.clock, self.faults = VirtualClock(), Faults()
        self.stage = K10CR1Emulator(self.clock, self.faults, **parameters)
        self.written = bytearray()

    def receive(self, data: bytes) -> bytes:
        self.written += data
        return self.stage.receive(data)

    def due(self) -> bytes:
        return self.stage.due()

    def open(self, url: str, **parameters: Any) -> K10CR1:
        return K10CR1.open(url, "generator retarder", self.clock, **({"reply_timeout_s": 0.05} | parameters))

    @contextmanager
    def opened(self, **parameters: Any) -> Iterator[K10CR1]:
        with PtyServer(self) as server, self.open(server.url, **parameters) as driver:
            yield driver

    @contextmanager
    def homed(self, **parameters: Any) -> Iterator[K10CR1]:
        with self.opened(**parameters) as driver:
            driver.home().wait()
            yield driver

    def wrote(self, number: Id) -> bool:
        return Message(number, CHANNEL).encode()[:2] in bytes(self.written)


@pytest.fixture
def new_stage_bench() -> type[StageBench]:
    """Makes a rotary stage of one's own parameters."""
    return StageBench
