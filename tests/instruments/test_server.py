from __future__ import annotations

import socket
import threading
import time

import pytest
import serial

from pbrdf.instruments.emulators.clock import VirtualClock
from pbrdf.instruments.emulators.server import FIRST_TICK_S, TICK_S, PtyServer, SocketServer
from pbrdf.instruments.ports import open_port

Servers = type[PtyServer] | type[SocketServer]
both = pytest.mark.parametrize("kind", [PtyServer, SocketServer])


class _Device:
    """Echoes in capitals, and says so when its time has come."""

    def __init__(self) -> None:
        self.clock = VirtualClock()
        self.threads: set[int] = set()
        self.said = False

    def receive(self, data: bytes) -> bytes:
        self.threads.add(threading.get_ident())
        return data.upper()

    def due(self) -> bytes:
        if self.said or self.clock.now() < 10.0:
            return b""
        self.said = True
        return b"!"


@both
def test_a_driver_is_answered(kind: Servers) -> None:
    device = _Device()
    with kind(device) as server:
        port = open_port(server.url, "device", 115200)
        port.write(b"hello")
        assert port.read(5) == b"HELLO"
        port.close()
    assert len(device.threads) == 1
    assert threading.get_ident() not in device.threads


@both
def test_long_answers_come_whole(kind: Servers) -> None:
    with kind(_Device()) as server:
        port = open_port(server.url, "device", 115200)
        sent = bytes(range(97, 123)) * 2000
        writer = threading.Thread(target=port.write, args=(sent,))
        writer.start()
        assert port.read(len(sent)) == sent.upper()
        writer.join()
        port.close()


@both
def test_a_device_speaks_on_its_own_when_its_time_has_come(kind: Servers) -> None:
    device = _Device()
    with kind(device) as server:
        port = open_port(server.url, "device", 115200)
        port.write(b"a")
        assert port.read(1) == b"A"
        port.timeout = 5 * TICK_S
        assert port.read(1) == b""
        device.clock.sleep(10.0)
        assert port.read(1) == b"!"
        port.close()


@both
def test_what_follows_a_question_at_once_does_not_wait_for_a_whole_tick(kind: Servers) -> None:
    waits = []
    device = _Device()
    with kind(device) as server:
        port = open_port(server.url, "device", 115200)
        for _ in range(10):
            device.clock, device.said = VirtualClock(), False
            port.write(b"a")
            port.read(1)
            begun = time.perf_counter()
            device.clock.sleep(10.0)
            port.read(1)
            waits.append(time.perf_counter() - begun)
        port.close()
    assert FIRST_TICK_S < 0.1 * TICK_S
    assert min(waits) < 0.5 * TICK_S


def test_a_server_ends_although_a_driver_is_there() -> None:
    servers = (PtyServer(_Device()), SocketServer(_Device()))
    with (
        open_port(servers[0].url, "device", 115200),
        socket.create_connection(("127.0.0.1", servers[1].port)),
    ):
        for server in servers:
            server.close()


def test_an_unplugged_cable_is_an_error_for_who_has_the_port_open() -> None:
    with PtyServer(_Device()) as server:
        port = open_port(server.url, "device", 115200)
        server.unplug()
        with pytest.raises((serial.SerialException, OSError)):
            port.read(1)
        port.close()
        server.plug_in()


def test_a_cable_put_back_has_a_port_that_works_and_none_of_what_was_said_before() -> None:
    with PtyServer(_Device()) as server:
        port = open_port(server.url, "device", 115200)
        port.write(b"lost")
        server.unplug()
        port.close()
        server.plug_in()
        again = open_port(server.url, "device", 115200)
        again.write(b"new")
        assert again.read(3) == b"NEW"
        again.close()


def test_a_socket_takes_the_next_driver_when_the_last_has_left() -> None:
    with SocketServer(_Device()) as server:
        for _ in range(2):
            port = open_port(server.url, "device", 115200)
            port.write(b"abc")
            assert port.read(3) == b"ABC"
            port.close()
