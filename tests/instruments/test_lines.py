from __future__ import annotations

from collections.abc import Iterator

import pytest

from pbrdf.errors import InstrumentError
from pbrdf.instruments.emulators.server import PtyServer
from pbrdf.instruments.lines import LinePort


class _Echo:
    def receive(self, data: bytes) -> bytes:
        return data

    def due(self) -> bytes:
        return b""


@pytest.fixture
def server() -> Iterator[PtyServer]:
    with PtyServer(_Echo()) as one:
        yield one


@pytest.fixture
def port(server: PtyServer) -> Iterator[LinePort]:
    one = LinePort(server.url, "board", 115200, reply_timeout_s=0.5, poll_timeout_s=0.02)
    yield one
    one.close()
    one.close()


@pytest.mark.parametrize("end", ["\r\n", "\n\r", "\r", "\n", "\r\n\r\n"])
def test_lines_end_in_any_way(port: LinePort, end: str) -> None:
    port.write(f"one{end} two {end}{end}three{end}".encode())
    assert [port.line() for _ in range(4)] == ["one", "two", "three", None]


def test_a_line_may_come_in_pieces(port: LinePort) -> None:
    port.write(b"be")
    assert port.poll() is None
    port.write(b"gun\r")
    assert port.line() == "begun"
    port.write(b"\nnext\r\n")
    assert port.line() == "next"


def test_what_is_there_is_had_without_a_wait(port: LinePort) -> None:
    assert port.come() == []
    port.write(b"one\ntwo\nthree\n")
    assert port.line() == "one"
    assert port.come() == ["two", "three"]


def test_what_came_before_can_be_forgotten(server: PtyServer) -> None:
    patient = LinePort(server.url, "board", 115200, reply_timeout_s=0.2, poll_timeout_s=0.2)
    patient.write(b"old\nbegun")
    patient.drain()
    patient.write(b"new\n")
    assert patient.line() == "new"
    patient.close()


def test_noise_is_no_error(port: LinePort) -> None:
    port.write(b"\xff\x00\xfe\r\nok\r\n")
    assert port.line() is not None
    assert port.line() == "ok"


def test_a_port_that_has_gone_is_an_error_with_its_name(server: PtyServer, port: LinePort) -> None:
    server.unplug()
    for act in (port.poll, port.line, port.come, lambda: port.write(b"x")):
        with pytest.raises(
            InstrumentError, match=rf"board at {port.name[9:]}: port: has gone .*; see to its cable"
        ):
            act()
    server.plug_in()
