"""Messages of Thorlabs' APT protocol as the rotary stage K10CR1 speaks it: bytes, fields and units.

Numbers and layouts: "APT Communications Protocol", Thorlabs, issue 37, as QMI, pylablib and
thorlabs-apt-protocol agree on them. All numbers are little-endian.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum
from fractions import Fraction
from typing import Self

HOST = 0x01
STAGE = 0x50
CHANNEL = 1
HEADER_BYTES = 6
_LONG = 0x80

TURN = 49_152_000
"""Microsteps of a whole turn: 200 steps of 2048 microsteps, geared down 120 to 1."""

_PER_DEG = Fraction(TURN, 360)
_VELOCITY_PER_DEG = 7_330_077.5
_ACCELERATION_PER_DEG = 1502.0


class Id(IntEnum):
    """Numbers of the messages; a stage answers ``X_REQ`` by ``X_GET``."""

    HW_DISCONNECT = 0x0002
    HW_REQ_INFO = 0x0005
    HW_GET_INFO = 0x0006
    HW_START_UPDATES = 0x0011
    HW_STOP_UPDATES = 0x0012
    HW_NO_FLASH_PROGRAMMING = 0x0018
    HW_RESPONSE = 0x0080
    HW_RICH_RESPONSE = 0x0081
    CHANNEL_SET = 0x0210
    CHANNEL_REQ = 0x0211
    CHANNEL_GET = 0x0212
    IDENTIFY = 0x0223
    POSITION_SET = 0x0410
    POSITION_REQ = 0x0411
    POSITION_GET = 0x0412
    VELOCITY_SET = 0x0413
    VELOCITY_REQ = 0x0414
    VELOCITY_GET = 0x0415
    JOG_SET = 0x0416
    JOG_REQ = 0x0417
    JOG_GET = 0x0418
    LIMITS_SET = 0x0423
    LIMITS_REQ = 0x0424
    LIMITS_GET = 0x0425
    STATUS_BITS_REQ = 0x0429
    STATUS_BITS_GET = 0x042A
    BACKLASH_SET = 0x043A
    BACKLASH_REQ = 0x043B
    BACKLASH_GET = 0x043C
    HOMING_SET = 0x0440
    HOMING_REQ = 0x0441
    HOMING_GET = 0x0442
    MOVE_HOME = 0x0443
    MOVE_HOMED = 0x0444
    MOVE_RELATIVE = 0x0448
    MOVE_ABSOLUTE = 0x0453
    MOVE_COMPLETED = 0x0464
    MOVE_STOP = 0x0465
    MOVE_STOPPED = 0x0466
    STATUS_REQ = 0x0480
    STATUS_GET = 0x0481
    STATUS_ACKNOWLEDGE = 0x0492


_PAYLOADS: dict[Id, tuple[int, ...]] = {
    Id.HW_GET_INFO: (84,),
    Id.HW_RICH_RESPONSE: (68,),
    Id.POSITION_SET: (6,),
    Id.POSITION_GET: (6,),
    Id.VELOCITY_SET: (14,),
    Id.VELOCITY_GET: (14,),
    Id.JOG_SET: (22,),
    Id.JOG_GET: (22,),
    Id.LIMITS_SET: (16,),
    Id.LIMITS_GET: (16,),
    Id.STATUS_BITS_GET: (6,),
    Id.BACKLASH_SET: (6,),
    Id.BACKLASH_GET: (6,),
    Id.HOMING_SET: (14,),
    Id.HOMING_GET: (14,),
    Id.MOVE_RELATIVE: (6,),
    Id.MOVE_ABSOLUTE: (6,),
    Id.MOVE_COMPLETED: (0, 14),
    Id.MOVE_STOPPED: (0, 14),
    Id.STATUS_GET: (14, 28),
}
"""Bytes that may follow the header; 0 where there is no payload, as for all messages not named."""


class Bits(IntEnum):
    """Bits of the status word."""

    MOVING_CW = 0x10
    MOVING_CCW = 0x20
    JOGGING_CW = 0x40
    JOGGING_CCW = 0x80
    HOMING = 0x200
    HOMED = 0x400
    ENABLED = 0x8000_0000


MOVING = Bits.MOVING_CW | Bits.MOVING_CCW | Bits.JOGGING_CW | Bits.JOGGING_CCW | Bits.HOMING
"""A stage turns while any of these is set; both directions are set together, whichever it takes."""

_COMPLAINTS = {
    0x4000: "position error",
    0x8000: "instruction error",
    0x1_0000: "interlock",
    0x2_0000: "too hot",
    0x4_0000: "supply voltage",
    0x8_0000: "commutation error",
    0x100_0000: "overload",
    0x200_0000: "encoder fault",
    0x400_0000: "overcurrent",
    0x800_0000: "supply current",
    0x4000_0000: "error",
}


@dataclass(frozen=True)
class Message:
    """A message: either two parameters in its header, or a payload."""

    id: int
    param1: int = 0
    param2: int = 0
    payload: bytes = b""
    dest: int = STAGE
    source: int = HOST

    def encode(self) -> bytes:
        """As it goes over the wire."""
        if self.payload:
            return (
                struct.pack("<HHBB", self.id, len(self.payload), self.dest | _LONG, self.source)
                + self.payload
            )
        return struct.pack("<HBBBB", self.id, self.param1, self.param2, self.dest, self.source)


class MessageReader:
    """Messages from bytes that come in pieces of any size, with rubbish between them.

    Parameters
    ----------
    dests, sources : tuple of int
        Who may be addressed, and who may speak: what else looks like a header is none.

    Notes
    -----
    A header that cannot be one costs a byte, and the search goes on at the next.
    """

    def __init__(self, dests: tuple[int, ...], sources: tuple[int, ...]) -> None:
        self._dests, self._sources = dests, sources
        self._buffer = bytearray()

    def feed(self, data: bytes) -> list[Message]:
        """The messages that are whole by now."""
        self._buffer += data
        messages = []
        while len(self._buffer) >= HEADER_BYTES:
            length = self._payload_bytes()
            if length is None:
                del self._buffer[0]
                continue
            if len(self._buffer) < HEADER_BYTES + length:
                break
            messages.append(self._take(length))
        return messages

    @property
    def missing(self) -> int:
        """Bytes without which no further message can be whole."""
        if len(self._buffer) < HEADER_BYTES:
            return HEADER_BYTES - len(self._buffer)
        return HEADER_BYTES + (self._payload_bytes() or 0) - len(self._buffer)

    def clear(self) -> None:
        """Forget what has come of a message not yet whole."""
        self._buffer.clear()

    def _payload_bytes(self) -> int | None:
        """Bytes after the header at the front; None if that is no header."""
        number, length, dest, source = struct.unpack_from("<HHBB", self._buffer)
        if number not in _KNOWN or dest & ~_LONG not in self._dests or source not in self._sources:
            return None
        length = length if dest & _LONG else 0
        return length if length in _PAYLOADS.get(number, (0,)) else None

    def _take(self, length: int) -> Message:
        header, payload = self._buffer[:HEADER_BYTES], bytes(self._buffer[HEADER_BYTES:][:length])
        del self._buffer[: HEADER_BYTES + length]
        number, param1, param2, dest, source = struct.unpack("<HBBBB", header)
        if payload:
            param1 = param2 = 0
        return Message(number, param1, param2, payload, dest & ~_LONG, source)


_KNOWN = frozenset(int(one) for one in Id)


def microsteps(angle_deg: float) -> int:
    """The whole number of microsteps nearest to an angle in degrees."""
    return round(Fraction(angle_deg) * _PER_DEG)


def degrees(position: int) -> float:
    """Degrees of a number of microsteps."""
    return position * 360.0 / TURN


@dataclass(frozen=True)
class Status:
    """Where the stage stands and what it does (`Id.STATUS_GET`, `Id.MOVE_COMPLETED`, `Id.MOVE_STOPPED`).

    Attributes
    ----------
    position : int
        Microsteps on the stage's counter.
    bits : int
        See `Bits`.
    """

    position: int
    bits: int

    def encode(self) -> bytes:
        """Payload of 14 bytes; the encoder's count, of which this stage has none, is 0."""
        return struct.pack("<HiiI", CHANNEL, self.position, 0, self.bits)

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """From 14 bytes, or from the 28 that some firmware sends."""
        _, position, _, bits = struct.unpack_from("<HiiI", payload)
        return cls(position, bits)

    @property
    def moving(self) -> bool:
        """Whether it turns."""
        return bool(self.bits & MOVING)

    @property
    def homed(self) -> bool:
        """Whether its counter is of use."""
        return bool(self.bits & Bits.HOMED)

    @property
    def complaints(self) -> str:
        """Faults that it reports, in words; empty if none."""
        return ", ".join(word for bit, word in _COMPLAINTS.items() if self.bits & bit)


@dataclass(frozen=True)
class Velocity:
    """How fast it moves (`Id.VELOCITY_SET`, `Id.VELOCITY_GET`), in the stage's own numbers."""

    acceleration: int
    velocity: int

    @classmethod
    def of(cls, velocity_deg_s: float, acceleration_deg_s2: float) -> Self:
        """From degrees/s and degrees/s²."""
        return cls(round(acceleration_deg_s2 * _ACCELERATION_PER_DEG), _velocity(velocity_deg_s))

    @property
    def velocity_deg_s(self) -> float:
        """Largest speed."""
        return self.velocity / _VELOCITY_PER_DEG

    @property
    def acceleration_deg_s2(self) -> float:
        """Acceleration, and deceleration."""
        return self.acceleration / _ACCELERATION_PER_DEG

    def encode(self) -> bytes:
        """Payload of 14 bytes; the smallest speed is always 0."""
        return struct.pack("<Hiii", CHANNEL, 0, self.acceleration, self.velocity)

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """From the payload."""
        _, _, acceleration, velocity = struct.unpack("<Hiii", payload)
        return cls(acceleration, velocity)


@dataclass(frozen=True)
class Homing:
    """How it looks for its zero (`Id.HOMING_SET`, `Id.HOMING_GET`): in reverse, to the reverse switch.

    Attributes
    ----------
    velocity : int
        In the stage's own numbers.
    offset : int
        Microsteps from the switch to the zero.
    direction, switch : int
        1 forward and 2 reverse; 1 reverse and 4 forward.
    """

    velocity: int
    offset: int
    direction: int = 2
    switch: int = 1

    @classmethod
    def of(cls, velocity_deg_s: float, offset_deg: float) -> Self:
        """From degrees/s and degrees."""
        return cls(_velocity(velocity_deg_s), microsteps(offset_deg))

    @property
    def velocity_deg_s(self) -> float:
        """Speed."""
        return self.velocity / _VELOCITY_PER_DEG

    def encode(self) -> bytes:
        """Payload of 14 bytes."""
        return struct.pack("<HHHii", CHANNEL, self.direction, self.switch, self.velocity, self.offset)

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """From the payload."""
        _, direction, switch, velocity, offset = struct.unpack("<HHHii", payload)
        return cls(velocity, offset, direction, switch)


def _velocity(velocity_deg_s: float) -> int:
    return round(velocity_deg_s * _VELOCITY_PER_DEG)


@dataclass(frozen=True)
class Information:
    """What the stage says it is (`Id.HW_GET_INFO`)."""

    serial: int
    model: str
    firmware: tuple[int, int, int]

    def encode(self) -> bytes:
        """Payload of 84 bytes; hardware type 16 is a stepper motor's driver."""
        major, minor, interim = self.firmware
        return struct.pack(
            "<I8sH4B48s12sHHH",
            *(self.serial, self.model.encode("ascii"), 16, interim, minor, major, 0),
            *(b"APT Stepper Controller", b"", 1, 0, 1),
        )

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """From the payload."""
        serial, model, _, interim, minor, major = struct.unpack_from("<I8sH3B", payload)
        word = model.split(b"\0")[0].decode("ascii", errors="replace").strip()
        return cls(serial, word, (major, minor, interim))


def encode_number(number: int) -> bytes:
    """Payload of a position, a distance or a backlash, in microsteps."""
    return struct.pack("<Hi", CHANNEL, number)


def decode_number(payload: bytes) -> int:
    """Microsteps from such a payload."""
    number: int = struct.unpack("<Hi", payload)[1]
    return number


def decode_complaint(payload: bytes) -> str:
    """Words of `Id.HW_RICH_RESPONSE`."""
    _, code, notes = struct.unpack("<HH64s", payload)
    return f"{notes.split(bytes(1))[0].decode('ascii', errors='replace').strip()} (code {code})"
