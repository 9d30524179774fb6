"""The link to a stage has the line settings that Thorlabs asks for, and matches answers by their number."""

from __future__ import annotations

import os
import termios
from typing import Any

import pytest

from pbrdf.errors import InstrumentError
from pbrdf.instruments import apt_link
from pbrdf.instruments.apt_link import AptLink
from pbrdf.instruments.apt_messages import Id, Status, decode_number
from pbrdf.instruments.emulators.clock import VirtualClock
from pbrdf.instruments.emulators.faults import Faults
from pbrdf.instruments.emulators.k10cr1 import K10CR1Emulator
from pbrdf.instruments.emulators.server import PtyServer

ENOUGH_S = 1.0


def test_the_line_is_set_as_the_protocol_asks(monkeypatch: pytest.MonkeyPatch) -> None:
    raised: list[bool] = []
    monkeypatch.setattr(apt_link, "set_rts", lambda port, on: raised.append(on))
    with PtyServer(_Stage(b"")) as server:
        link = AptLink(server.url, "stage", VirtualClock(), ENOUGH_S)
        line = os.open(server.url, os.O_RDWR | os.O_NOCTTY)
        _, _, control, _, speed_in, speed_out, _ = termios.tcgetattr(line)
        os.close(line)
        link.close()
    assert speed_in == speed_out == termios.B115200
    assert control & termios.CSIZE == termios.CS8
    assert control & termios.CRTSCTS
    assert not control & (termios.PARENB | termios.CSTOPB)
    assert raised == [True]


def test_the_line_is_given_the_time_that_the_protocol_asks() -> None:
    clock = VirtualClock()
    with PtyServer(_Stage(b"")) as server:
        AptLink(server.url, "stage", clock, ENOUGH_S).close()
    assert clock.now() >= 0.1


class _Stage:
    """Answers every question by the same bytes."""

    def __init__(self, said: bytes) -> None:
        self.said = said

    def receive(self, data: bytes) -> bytes:
        return self.said

    def due(self) -> bytes:
        return b""


def test_an_answer_to_another_question_is_none() -> None:
    wrong = bytes.fromhex("12 04 06 00 81 50 01 00 40 0d 03 00")
    with PtyServer(_Stage(wrong)) as server:
        link = AptLink(server.url, "stage", VirtualClock(), 0.05)
        with pytest.raises(InstrumentError, match=f"stage at {server.url}: answer: none to STATUS_REQ"):
            link.ask(Id.STATUS_REQ, Id.STATUS_GET)
        assert decode_number(link.ask(Id.POSITION_REQ, Id.POSITION_GET).payload) == 200_000
        link.close()


def test_what_came_before_the_question_is_no_answer() -> None:
    clock = VirtualClock()
    stage = K10CR1Emulator(clock, Faults(), power_up_deg=0.0)

    class Talkative:
        unasked: Any = stage._update()

        def receive(self, data: bytes) -> bytes:
            return stage.receive(data)

        def due(self) -> bytes:
            said, self.unasked = self.unasked, b""
            return bytes(said)

    with PtyServer(Talkative()) as server:
        link = AptLink(server.url, "stage", clock, ENOUGH_S)
        link.tell(Id.MOVE_HOME)
        link.ask(Id.POSITION_REQ, Id.POSITION_GET)
        clock.sleep(60.0)
        assert Status.decode(link.ask(Id.STATUS_REQ, Id.STATUS_GET).payload).homed
        link.close()


def test_a_stage_that_never_falls_silent_is_given_up() -> None:
    update = bytes.fromhex("81 04 0e 00 81 50 01 00") + bytes(12)

    class Chatterbox(_Stage):
        def due(self) -> bytes:
            return self.said

    with (
        PtyServer(Chatterbox(update)) as server,
        pytest.raises(InstrumentError, match="none to POSITION_REQ"),
    ):
        AptLink(server.url, "stage", VirtualClock(), 0.1).ask(Id.POSITION_REQ, Id.POSITION_GET)
