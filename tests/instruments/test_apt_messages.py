"""Bytes of the APT protocol are those of Thorlabs' own program, and are found in what comes over a wire."""

from __future__ import annotations

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pbrdf.instruments.apt_messages import (
    CHANNEL,
    HOST,
    MOVING,
    STAGE,
    TURN,
    Bits,
    Homing,
    Id,
    Information,
    Message,
    MessageReader,
    Status,
    Velocity,
    decode_number,
    degrees,
    encode_number,
    microsteps,
)

ORDERS = {
    "05 00 00 00 50 01": Message(Id.HW_REQ_INFO),
    "11 00 00 00 50 01": Message(Id.HW_START_UPDATES),
    "12 00 00 00 50 01": Message(Id.HW_STOP_UPDATES),
    "23 02 01 00 50 01": Message(Id.IDENTIFY, CHANNEL),
    "10 02 01 01 50 01": Message(Id.CHANNEL_SET, CHANNEL, 1),
    "10 02 01 02 50 01": Message(Id.CHANNEL_SET, CHANNEL, 2),
    "43 04 01 00 50 01": Message(Id.MOVE_HOME, CHANNEL),
    "11 04 01 00 50 01": Message(Id.POSITION_REQ, CHANNEL),
    "65 04 01 02 50 01": Message(Id.MOVE_STOP, CHANNEL, 2),
    "29 04 01 00 50 01": Message(Id.STATUS_BITS_REQ, CHANNEL),
    "80 04 01 00 50 01": Message(Id.STATUS_REQ, CHANNEL),
    "53 04 06 00 d0 01 01 00 00 80 bb 00": Message(Id.MOVE_ABSOLUTE, payload=encode_number(microsteps(90.0))),
    "13 04 0e 00 d0 01 01 00 00 00 00 00 ac 3a 00 00 27 7b 5e 04": Message(
        Id.VELOCITY_SET, payload=Velocity.of(10.0, 10.0).encode()
    ),
    "40 04 0e 00 d0 01 01 00 02 00 01 00 27 7b 5e 04 55 55 08 00": Message(
        Id.HOMING_SET, payload=Homing.of(10.0, 4.0).encode()
    ),
}
COMPLETED = bytes.fromhex("64 04 0e 00 81 50 01 00 68 aa a0 01 00 00 00 00 30 00 00 80")
COMPLETED_SHORT = bytes.fromhex("64 04 01 00 01 50")
HOMED = bytes.fromhex("44 04 01 00 01 50")
POSITION = bytes.fromhex("12 04 06 00 81 50 01 00 40 0d 03 00")
INFORMATION = (
    bytes.fromhex("06 00 54 00 81 22 89 53 9a 05")
    + b"ION001 \0"
    + bytes.fromhex("2c 00 02 01 39 00")
    + bytes(60)
    + bytes.fromhex("01 00 03 00 01 00")
)


def from_stage() -> MessageReader:
    return MessageReader(dests=(0x00, HOST), sources=(0x00, STAGE))


@pytest.mark.parametrize("golden", ORDERS)
def test_orders_have_the_bytes_of_thorlabs_program(golden: str) -> None:
    assert ORDERS[golden].encode() == bytes.fromhex(golden)


@pytest.mark.parametrize("golden", ORDERS)
def test_a_stage_reads_the_orders(golden: str) -> None:
    reader = MessageReader(dests=(STAGE,), sources=(HOST,))
    assert reader.feed(bytes.fromhex(golden)) == [ORDERS[golden]]


def test_completion_of_a_real_stage_says_that_it_still_moves() -> None:
    (message,) = from_stage().feed(COMPLETED)
    assert message.id == Id.MOVE_COMPLETED
    status = Status.decode(message.payload)
    # sent there by a program that takes 136533 microsteps for a degree
    assert status.position == 200 * 136_533
    assert degrees(status.position) == pytest.approx(200.0, abs=5e-4)
    assert status.bits == Bits.ENABLED | Bits.MOVING_CW | Bits.MOVING_CCW
    assert status.moving and not status.homed
    assert status.encode() == message.payload


def test_short_completion_and_homed_are_read() -> None:
    messages = from_stage().feed(COMPLETED_SHORT + HOMED)
    assert [message.id for message in messages] == [Id.MOVE_COMPLETED, Id.MOVE_HOMED]
    assert all(not message.payload and message.param1 == CHANNEL for message in messages)


def test_position_is_read() -> None:
    (message,) = from_stage().feed(POSITION)
    assert decode_number(message.payload) == 200_000
    assert (
        Message(Id.POSITION_GET, payload=encode_number(200_000), dest=HOST, source=STAGE).encode() == POSITION
    )


def test_information_is_read() -> None:
    # the example is that of a rack's bay
    (message,) = MessageReader(dests=(HOST,), sources=(0x22,)).feed(INFORMATION)
    assert Information.decode(message.payload) == Information(94_000_009, "ION001", (57, 1, 2))


def test_information_survives_the_wire() -> None:
    information = Information(55_000_488, "K10CR1", (2, 0, 3))
    assert len(information.encode()) == 84
    assert Information.decode(information.encode()) == information


def test_status_with_reserved_bytes_is_the_same() -> None:
    status = Status(-12_345, 0x8000_0400)
    long = Message(Id.STATUS_GET, payload=status.encode() + bytes(14), dest=HOST, source=STAGE).encode()
    (message,) = from_stage().feed(long)
    assert len(long) == 6 + 28
    assert Status.decode(message.payload) == status


def test_a_turn_is_a_whole_number_of_microsteps() -> None:
    assert microsteps(360.0) == TURN == 49_152_000
    assert microsteps(3.0) == 409_600
    assert microsteps(-43 * 360.0) == -43 * TURN
    assert degrees(TURN) == 360.0


@given(st.floats(-15_480.0, 15_480.0))
def test_angles_survive_to_half_a_microstep(angle_deg: float) -> None:
    assert abs(degrees(microsteps(angle_deg)) - angle_deg) <= 0.5 * 360.0 / TURN + 1e-11


@given(st.floats(0.01, 10.0), st.floats(0.01, 20.0))
def test_rates_survive_to_half_a_unit(velocity: float, acceleration: float) -> None:
    rates = Velocity.decode(Velocity.of(velocity, acceleration).encode())
    assert rates.velocity_deg_s == pytest.approx(velocity, abs=1e-7)
    assert rates.acceleration_deg_s2 == pytest.approx(acceleration, abs=4e-4)
    homing = Homing.decode(Homing.of(velocity, 4.0).encode())
    assert homing.velocity_deg_s == rates.velocity_deg_s


def test_moving_is_any_of_five_bits() -> None:
    assert MOVING == 0x2F0
    assert all(Status(0, bit).moving for bit in (0x10, 0x20, 0x40, 0x80, 0x200))
    assert not Status(0, 0x8000_0400).moving


def test_complaints_are_named() -> None:
    assert Status(0, 0x8000_0400).complaints == ""
    assert Status(0, 0x8002_4000).complaints == "position error, too hot"


@given(st.lists(st.integers(1, 30), min_size=1, max_size=60))
def test_messages_are_found_however_the_bytes_are_cut(sizes: list[int]) -> None:
    stream = COMPLETED + HOMED + COMPLETED_SHORT + POSITION + COMPLETED + POSITION
    reader, found, start = from_stage(), [], 0
    for size in sizes:
        found += reader.feed(stream[start : start + size])
        start += size
    found += reader.feed(stream[start:])
    assert b"".join(message.encode() for message in found) == stream


@settings(max_examples=300)
@given(st.binary(max_size=40))
def test_messages_are_found_behind_rubbish(rubbish: bytes) -> None:
    """Whatever comes before, a message is lost at most to what claims to be one, and never the second."""
    found = from_stage().feed(rubbish + POSITION * 12)
    assert POSITION in [message.encode() for message in found[-2:]]


def test_the_end_of_a_message_is_skipped() -> None:
    for cut in range(1, len(COMPLETED)):
        found = from_stage().feed(COMPLETED[cut:] + POSITION)
        assert [message.encode() for message in found] == [POSITION]


def test_noise_holds_no_messages() -> None:
    assert from_stage().feed(random.Random(1).randbytes(200_000)) == []


@pytest.mark.parametrize(
    "bad",
    [
        "12 04 07 00 81 50 01 00 40 0d 03 00 00",  # no such length
        "12 04 06 00 91 50 01 00 40 0d 03 00",  # to nobody
        "12 04 06 00 81 33 01 00 40 0d 03 00",  # from nobody
        "99 77 01 00 01 50",  # no such message
        "12 04 01 00 01 50",  # a position without its payload
    ],
)
def test_what_cannot_be_a_message_is_none(bad: str) -> None:
    assert from_stage().feed(bytes.fromhex(bad)) == []
    assert [one.encode() for one in from_stage().feed(bytes.fromhex(bad) + POSITION)] == [POSITION]


def test_missing_bytes_are_counted_so_that_no_read_waits_in_vain() -> None:
    reader = from_stage()
    assert reader.missing == 6
    reader.feed(POSITION[:4])
    assert reader.missing == 2
    reader.feed(POSITION[4:7])
    assert reader.missing == 5
    reader.clear()
    assert reader.missing == 6
