from __future__ import annotations

import pytest

from pbrdf.instruments.emulators.clock import VirtualClock
from pbrdf.instruments.emulators.faults import Faults
from pbrdf.instruments.emulators.optec_ifw import EmulatedIFW

NAMES = ["450", "500", "550", "600", "650"]


def _wheel(**options: object) -> tuple[EmulatedIFW, VirtualClock]:
    clock = VirtualClock()
    wheel = EmulatedIFW(clock, Faults(), names=NAMES, **options)  # type: ignore[arg-type]
    return wheel, clock


@pytest.mark.parametrize(
    ("command", "answer"),
    [
        (b"WSMODE", b"!\n\r"),
        (b"WIDENT", b"A\n\r"),
        (b"WFILTR", b"1\n\r"),
        (b"WREADS", b"450     500     550     600     650     \n\r"),
        (b"WFxxxx", b"1\n\r"),
        (b"WRxxxx", b"450     500     550     600     650     \n\r"),
        (b"WVxxxx", b"V= 2.04\n\r"),
        (b"WNxxxx", b"SN= 20731\n\r"),
        (b"WGOTO9", b"ER=5\n\r"),
        (b"WGOTO0", b"ER=5\n\r"),
        (b"WGOTOx", b"ER=5\n\r"),
        (b"WEXITS", b"END\n\r"),
    ],
)
def test_answers_are_those_of_the_makers_document(command: bytes, answer: bytes) -> None:
    wheel, _ = _wheel()
    assert wheel.receive(b"WSMODE") == b"!\n\r"
    assert wheel.receive(command) == answer


@pytest.mark.parametrize(
    ("command", "seconds", "answer"), [(b"WGOTO3", 1.2, b"*\n\r"), (b"WHOMES", 5.0, b"A\n\r")]
)
def test_movements_are_answered_when_they_end(command: bytes, seconds: float, answer: bytes) -> None:
    wheel, clock = _wheel()
    wheel.receive(b"WSMODE")
    assert wheel.receive(command) == b""
    clock.sleep(seconds - 0.01)
    assert wheel.due() == b""
    clock.sleep(0.02)
    assert wheel.due() == answer
    assert wheel.due() == b""


def test_nothing_is_answered_outside_serial_mode() -> None:
    wheel, _ = _wheel()
    assert wheel.receive(b"WFILTRWIDENT") == b""
    wheel.receive(b"WSMODEWEXITS")
    assert wheel.receive(b"WFILTR") == b""


def test_commands_before_the_end_of_a_movement_are_lost() -> None:
    wheel, clock = _wheel()
    wheel.receive(b"WSMODEWGOTO3")
    assert wheel.receive(b"WFILTRWGOTO5") == b""
    clock.sleep(10.0)
    assert wheel.receive(b"WFILTR") == b"*\n\r3\n\r"


@pytest.mark.parametrize("end", [b"\r\n", b"\r", b"\n"])
def test_ends_of_lines_that_no_command_has_are_ignored(end: bytes) -> None:
    wheel, _ = _wheel()
    assert wheel.receive(b"WSMODE" + end + b"WIDENT" + end) == b"!\n\rA\n\r"


def test_commands_may_come_in_pieces() -> None:
    wheel, _ = _wheel()
    assert b"".join(wheel.receive(bytes([one])) for one in b"WSMODEWIDENT") == b"!\n\rA\n\r"


def test_the_shorter_way_is_taken() -> None:
    wheel, clock = _wheel(slot=1)
    wheel.receive(b"WSMODEWGOTO5")
    assert wheel.slot_in_beam() is None
    clock.sleep(0.61)
    assert wheel.slot_in_beam() == 5


def test_names_are_stored() -> None:
    wheel, _ = _wheel()
    wheel.receive(b"WSMODE")
    names = b"".join(b"NAME %-3d" % n for n in range(5))
    assert wheel.receive(b"WLOADA*" + names) == b"!\n\r"
    assert wheel.receive(b"WREADS") == names + b"\n\r"


def test_the_same_commands_give_the_same_bytes() -> None:
    said = []
    for _ in range(2):
        wheel, clock = _wheel()
        bytes_so_far = b""
        for command in (b"WSMODE", b"WHOMES", b"WGOTO4", b"WFILTR"):
            bytes_so_far += wheel.receive(command)
            clock.sleep(10.0)
            bytes_so_far += wheel.due()
        said.append(bytes_so_far)
    assert said == [b"!\n\rA\n\r*\n\r4\n\r"] * 2
