"""An emulated rotary stage Thorlabs K10CR1, which speaks the APT protocol."""

from __future__ import annotations

import random
import struct
from collections.abc import Callable
from enum import Enum, auto

from pbrdf.instruments.apt_messages import (
    CHANNEL,
    HOST,
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
from pbrdf.instruments.clock import Clock
from pbrdf.instruments.emulators.faults import Faults
from pbrdf.instruments.emulators.rotation import Rotation

_UPDATE_S = 0.1
_SWITCH = -microsteps(4.0)
_PIECES = 3

_POWER_UP: dict[Id, bytes] = {
    Id.VELOCITY_SET: Velocity.of(10.0, 10.0).encode(),
    Id.JOG_SET: struct.pack("<HHiiiiH", CHANNEL, 2, microsteps(5.0), 0, 15020, 73_300_775, 2),
    Id.LIMITS_SET: struct.pack("<HHHiiH", CHANNEL, 4, 1, 0, 0, 1),
    Id.BACKLASH_SET: encode_number(microsteps(1.0)),
    Id.HOMING_SET: Homing.of(10.0, 4.0).encode(),
}


class _Errand(Enum):
    HOME = auto()
    MOVE = auto()


class K10CR1Emulator:
    """A stage (`pbrdf.instruments.emulators.server.Device`).

    Parameters
    ----------
    clock : Clock
    faults : Faults
        See below.
    serial_number : int
    model : str
    power_up_deg : float
        Where it stands at first, in degrees from its zero.
    error_usteps : float
        Standard deviation of the final error, in microsteps.
    seed : int
        The final error is a function of it and of the angle asked for.

    Notes
    -----
    A stop is at once, profiled or not. Homing is always in reverse, to the reverse switch. While it turns,
    both moving bits are set. What it does not know it ignores, as the stage does.

    Faults, with the occasion that counts:

    ================== ============ ======================================================================
    fault              occasion     what happens
    ================== ============ ======================================================================
    home-ignored       home order   nothing
    home-silent        home reached HOMED is not sent
    completed-dropped  arrival      MOVE_COMPLETED is not sent
    completed-short    arrival      it is sent without its payload
    completed-moving   arrival      it says that the stage still moves
    final-error        move order   it ends ``value`` (50) microsteps from where it would
    stall              move order   it says that it moves and does not, until it is stopped
    homed-lost         move order   its power fails and comes back: it forgets its counter and its zero
    zero-parameters    power-up     rates, homing and backlash are 0
    parameters-kept    setting      the parameters stay as they are
    garbage            message      ``value`` (bytes in hexadecimal) before its answer
    silent             message      it is neither obeyed nor answered
    complaint          question     HW_RICHRESPONSE in place of the answer
    split              answer       it comes in three pieces
    merged             answer       a status update follows in the same piece
    interleaved        answer       a status update comes before it
    long-update        update       it has 28 bytes
    wrong-model        information  the model is ``value`` (K10CR2)
    wrong-serial       information  the serial number is ``value`` (55999999)
    ================== ============ ======================================================================

    A cable is pulled at the server (`pbrdf.instruments.emulators.server.PtyServer.unplug`).
    """

    def __init__(
        self,
        clock: Clock,
        faults: Faults,
        *,
        serial_number: int = 55_000_488,
        model: str = "K10CR1",
        power_up_deg: float = 37.0,
        error_usteps: float = 2.0,
        seed: int = 0,
    ) -> None:
        self._clock, self._faults = clock, faults
        self._serial_number, self._model = serial_number, model
        self._error_usteps, self._seed = error_usteps, seed
        self._reader = MessageReader(dests=(STAGE,), sources=(HOST,))
        self._rotation = Rotation(microsteps(power_up_deg))
        self._answers: dict[int, Callable[[Message], bytes]] = {
            Id.HW_REQ_INFO: self._information,
            Id.HW_START_UPDATES: self._start_updates,
            Id.HW_STOP_UPDATES: self._stop_updates,
            Id.CHANNEL_SET: self._set_channel,
            Id.CHANNEL_REQ: self._channel,
            Id.POSITION_SET: self._set_position,
            Id.POSITION_REQ: self._position,
            Id.STATUS_BITS_REQ: self._status_bits,
            Id.STATUS_REQ: self._status_update,
            Id.MOVE_HOME: self._home,
            Id.MOVE_RELATIVE: self._move_relative,
            Id.MOVE_ABSOLUTE: self._move_absolute,
            Id.MOVE_STOP: self._stop,
        }
        for first in _POWER_UP:
            self._answers[first] = self._set_parameters
            self._answers[first + 1] = self._parameters
        self._waiting: list[bytes] = []
        self.power_up()

    def power_up(self) -> None:
        """Come up, or come up again: what it knew is lost, and it stands where it stood."""
        now = self._clock.now()
        self._rotation.halt(now)
        self._zero = self._rotation.position(now)
        self._homed = False
        self._enabled = True
        self._errand: _Errand | None = None
        self._next_update: float | None = None
        self._stored = dict(_POWER_UP)
        if self._faults.strikes("zero-parameters"):
            for first in (Id.VELOCITY_SET, Id.HOMING_SET, Id.BACKLASH_SET):
                self._stored[first] = struct.pack("<H", CHANNEL) + bytes(len(_POWER_UP[first]) - 2)

    def angle_deg(self) -> float:
        """Where the optics stand, in degrees from the true zero: at least 0, less than 360."""
        return degrees(self._rotation.position(self._clock.now()) % TURN)

    def receive(self, data: bytes) -> bytes:
        """See `pbrdf.instruments.emulators.server.Device`."""
        said = b"".join(self._waiting) + self._announcement()
        self._waiting.clear()
        for message in self._reader.feed(data):
            said += self._answer(message)
        return said

    def due(self) -> bytes:
        """See `pbrdf.instruments.emulators.server.Device`."""
        if self._waiting:
            return self._waiting.pop(0)
        return self._announcement() + self._update_in_time()

    def _answer(self, message: Message) -> bytes:
        rubbish = self._rubbish()
        answer = self._answers.get(message.id)
        if answer is None or self._faults.strikes("silent"):
            return rubbish
        said = answer(message)
        return rubbish + self._disturbed(said) if said else rubbish

    def _disturbed(self, said: bytes) -> bytes:
        """An answer as the wire makes of it."""
        if self._faults.strikes("complaint"):
            notes = b"the motor has lost its supply"
            said = _sent(Id.HW_RICH_RESPONSE, payload=struct.pack("<HH64s", 0, 12, notes))
        if self._faults.strikes("interleaved"):
            said = self._update() + said
        if self._faults.strikes("merged"):
            said += self._update()
        if self._faults.strikes("split"):
            size = -(-len(said) // _PIECES)
            said, *self._waiting = (said[start : start + size] for start in range(0, len(said), size))
        return said

    def _rubbish(self) -> bytes:
        """What stands in the line before an answer: noise, and an update whose beginning was not heard."""
        struck = self._faults.value("garbage", absent=None, struck="")
        if struck is None:
            return b""
        return bytes.fromhex(struck) or random.Random(self._seed).randbytes(13) + self._update()[5:]

    def _announcement(self) -> bytes:
        """That it has arrived, if it has since it was last asked."""
        now = self._clock.now()
        if self._errand is None or self._rotation.moving(now):
            return b""
        errand, self._errand = self._errand, None
        if errand is _Errand.MOVE:
            return self._completed()
        self._zero = self._rotation.position(now)
        self._homed = True
        return b"" if self._faults.strikes("home-silent") else _sent(Id.MOVE_HOMED, CHANNEL)

    def _completed(self) -> bytes:
        if self._faults.strikes("completed-dropped"):
            return b""
        if self._faults.strikes("completed-short"):
            return _sent(Id.MOVE_COMPLETED, CHANNEL)
        status = self._status()
        if self._faults.strikes("completed-moving"):
            status = Status(status.position, status.bits | Bits.MOVING_CW | Bits.MOVING_CCW)
        return _sent(Id.MOVE_COMPLETED, payload=status.encode())

    def _update_in_time(self) -> bytes:
        if self._next_update is None or self._clock.now() < self._next_update:
            return b""
        self._next_update = self._clock.now() + _UPDATE_S
        return self._update()

    def _update(self) -> bytes:
        payload = self._status().encode()
        if self._faults.strikes("long-update"):
            payload += bytes(14)
        return _sent(Id.STATUS_GET, payload=payload)

    def _status(self) -> Status:
        now = self._clock.now()
        bits = (Bits.ENABLED if self._enabled else 0) | (Bits.HOMED if self._homed else 0)
        if self._rotation.moving(now):
            bits |= Bits.MOVING_CW | Bits.MOVING_CCW
            bits |= Bits.HOMING if self._errand is _Errand.HOME else 0
        return Status(self._rotation.position(now) - self._zero, bits)

    def _information(self, _: Message) -> bytes:
        model = self._faults.value("wrong-model", absent=self._model, struck="K10CR2")
        number = self._faults.value("wrong-serial", absent=self._serial_number, struck=55_999_999)
        return _sent(Id.HW_GET_INFO, payload=Information(int(number), model, (2, 0, 3)).encode())

    def _start_updates(self, _: Message) -> bytes:
        self._next_update = self._clock.now() + _UPDATE_S
        return b""

    def _stop_updates(self, _: Message) -> bytes:
        self._next_update = None
        return b""

    def _set_channel(self, message: Message) -> bytes:
        self._enabled = message.param2 == 1
        return b""

    def _channel(self, _: Message) -> bytes:
        return _sent(Id.CHANNEL_GET, CHANNEL, 1 if self._enabled else 2)

    def _set_parameters(self, message: Message) -> bytes:
        if not self._faults.strikes("parameters-kept"):
            self._stored[Id(message.id)] = message.payload
        return b""

    def _parameters(self, message: Message) -> bytes:
        return _sent(Id(message.id + 1), payload=self._stored[Id(message.id - 1)])

    def _set_position(self, message: Message) -> bytes:
        self._zero = self._rotation.position(self._clock.now()) - decode_number(message.payload)
        return b""

    def _position(self, _: Message) -> bytes:
        return _sent(Id.POSITION_GET, payload=encode_number(self._status().position))

    def _status_bits(self, _: Message) -> bytes:
        return _sent(Id.STATUS_BITS_GET, payload=struct.pack("<HI", CHANNEL, self._status().bits))

    def _status_update(self, _: Message) -> bytes:
        return self._update()

    def _home(self, _: Message) -> bytes:
        if self._enabled and not self._faults.strikes("home-ignored"):
            now = self._clock.now()
            homing = Homing.decode(self._stored[Id.HOMING_SET])
            position = self._rotation.position(now)
            switch = position - (position - _SWITCH) % TURN
            self._homed, self._errand = False, _Errand.HOME
            self._rotation.begin(now, (switch, switch + homing.offset), *self._rates(homing.velocity_deg_s))
        return b""

    def _move_relative(self, message: Message) -> bytes:
        return self._move(self._status().position + decode_number(message.payload))

    def _move_absolute(self, message: Message) -> bytes:
        return self._move(decode_number(message.payload))

    def _move(self, target: int) -> bytes:
        if self._faults.strikes("homed-lost"):
            self.power_up()
        elif self._enabled:
            now = self._clock.now()
            speed, acceleration = self._rates()
            if self._faults.strikes("stall"):
                speed = 0.0
            back = decode_number(self._stored[Id.BACKLASH_SET])
            falling = target < self._status().position
            stops = (target - back, target) if falling else (target,)
            self._errand = _Errand.MOVE
            self._rotation.begin(
                now, [stop + self._zero for stop in stops], speed, acceleration, self._final_error(target)
            )
        return b""

    def _rates(self, velocity_deg_s: float | None = None) -> tuple[float, float]:
        """Speed and acceleration in microsteps."""
        stored = Velocity.decode(self._stored[Id.VELOCITY_SET])
        speed = stored.velocity_deg_s if velocity_deg_s is None else velocity_deg_s
        return speed * TURN / 360.0, stored.acceleration_deg_s2 * TURN / 360.0

    def _final_error(self, target: int) -> int:
        """The same for the same angle, however many turns it is wound up."""
        chance = random.Random(f"{self._seed}/{target % TURN}")
        usual = round(chance.gauss(0.0, self._error_usteps))
        return usual + int(self._faults.value("final-error", absent=0, struck=50))

    def _stop(self, _: Message) -> bytes:
        self._rotation.halt(self._clock.now())
        self._errand = None
        return _sent(Id.MOVE_STOPPED, payload=self._status().encode())


def _sent(number: Id, param1: int = 0, param2: int = 0, payload: bytes = b"") -> bytes:
    return Message(number, param1, param2, payload, dest=HOST, source=STAGE).encode()
