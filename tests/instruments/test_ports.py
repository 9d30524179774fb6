from __future__ import annotations

from pathlib import Path

import pytest
from serial.tools.list_ports_common import ListPortInfo

from pbrdf.errors import InstrumentError
from pbrdf.instruments.emulators.server import PtyServer, SocketServer
from pbrdf.instruments.ports import open_port, set_rts


class _Echo:
    def receive(self, data: bytes) -> bytes:
        return data

    def due(self) -> bytes:
        return b""


def test_a_port_has_one_owner() -> None:
    with PtyServer(_Echo()) as server:
        port = open_port(server.url, "stage", 115200)
        with pytest.raises(
            InstrumentError, match=rf"stage at {server.url}: port: is in use by another program"
        ):
            open_port(server.url, "stage", 115200)
        port.close()
        open_port(server.url, "stage", 115200).close()


def test_a_port_that_does_not_exist_is_named_with_a_remedy() -> None:
    with pytest.raises(InstrumentError, match=r"wheel at /dev/nothing: port: cannot be opened .*; see that"):
        open_port("/dev/nothing", "wheel", 19200)


def test_a_port_that_may_not_be_opened_asks_for_the_group(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("serial.serial_for_url", refuse)
    with pytest.raises(InstrumentError, match="group `dialout`"):
        open_port("/dev/ttyUSB0", "wheel", 19200)


def test_a_url_that_nobody_knows_is_refused() -> None:
    with pytest.raises(InstrumentError, match="cannot be opened"):
        open_port("smoke://signals", "wheel", 19200)


@pytest.mark.parametrize("kind", [PtyServer, SocketServer])
def test_lines_that_are_not_there_cannot_be_raised_and_do_not_matter(
    kind: type[PtyServer] | type[SocketServer],
) -> None:
    with kind(_Echo()) as server:
        port = open_port(server.url, "stage", 115200, rtscts=True)
        set_rts(port, True)
        port.write(b"abc")
        assert port.read(3) == b"abc"
        port.close()


def test_every_byte_in_either_direction_is_logged(tmp_path: Path) -> None:
    log = tmp_path / "wire.log"
    with PtyServer(_Echo()) as server:
        port = open_port(server.url, "stage", 115200, log=log)
        port.write(b"\x05\x00P\x01")
        assert port.read(4) == b"\x05\x00P\x01"
        port.close()
    lines = [line for line in log.read_text().splitlines() if "05 00 50 01" in line]
    assert [line.split()[1] for line in lines] == ["TX", "RX"]


def test_every_byte_over_a_socket_is_logged_too(tmp_path: Path) -> None:
    log = tmp_path / "wire.log"
    with SocketServer(_Echo()) as server:
        port = open_port(server.url, "stage", 115200, log=log)
        port.write(b"\x05\x00P\x01")
        assert port.read(4) == b"\x05\x00P\x01"
        port.close()
        port.close()
    lines = [line for line in log.read_text().splitlines() if "05 00 50 01" in line]
    assert [line.split()[1] for line in lines] == ["TX", "RX"]


@pytest.mark.parametrize("logged", [False, True])
def test_a_port_is_found_by_its_usb_serial_number(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, logged: bool
) -> None:
    log = tmp_path / "wire.log" if logged else None
    with PtyServer(_Echo()) as server:
        found = ListPortInfo(server.url)
        found.hwid = "USB VID:PID=0403:FAF0 SER=55000001 LOCATION=1-2"
        monkeypatch.setattr("serial.tools.list_ports.comports", lambda include_links=False: [found])
        port = open_port("hwgrep://55000001", "stage", 115200, log=log)
        port.write(b"here")
        assert port.read(4) == b"here"
        with pytest.raises(InstrumentError, match="is in use by another program"):
            open_port("hwgrep://55000001", "stage", 115200)
        port.close()
        with pytest.raises(InstrumentError, match="no ports found"):
            open_port("hwgrep://55000002", "stage", 115200)
    assert (log is not None) == (tmp_path / "wire.log").exists()


def test_a_logged_port_has_one_owner_too(tmp_path: Path) -> None:
    with PtyServer(_Echo()) as server:
        port = open_port(server.url, "stage", 115200)
        with pytest.raises(InstrumentError, match="is in use by another program"):
            open_port(server.url, "stage", 115200, log=tmp_path / "wire.log")
        port.close()


def test_a_log_is_added_to_and_a_refused_port_leaves_it_as_it_was(tmp_path: Path) -> None:
    log = tmp_path / "wire.log"
    with PtyServer(_Echo()) as server:
        for word in (b"first", b"later"):
            port = open_port(server.url, "stage", 115200, log=log)
            port.write(word)
            assert port.read(5) == word
            before = log.read_text()
            with pytest.raises(InstrumentError):
                open_port(server.url, "stage", 115200, log=log)
            assert log.read_text() == before
            port.close()
            port.close()
    assert "first" in before
    assert "later" in before


def test_a_log_that_cannot_be_written_is_named_and_the_port_let_go(tmp_path: Path) -> None:
    with PtyServer(_Echo()) as server:
        with pytest.raises(InstrumentError, match=r"stage at .*: log: .*wire\.log cannot be written"):
            open_port(server.url, "stage", 115200, log=tmp_path / "none" / "wire.log")
        open_port(server.url, "stage", 115200).close()
