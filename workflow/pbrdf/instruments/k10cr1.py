"""Driver of the rotary stage Thorlabs K10CR1."""

from __future__ import annotations

import math
from typing import Self

from pbrdf.errors import InstrumentError
from pbrdf.instruments.apt_link import AptLink
from pbrdf.instruments.apt_messages import (
    TURN,
    Homing,
    Id,
    Information,
    Status,
    Velocity,
    decode_number,
    degrees,
    encode_number,
    microsteps,
)
from pbrdf.instruments.clock import Clock
from pbrdf.instruments.kinds import Identity, Rotator
from pbrdf.instruments.movement import Movement, travel_time

MODEL = "K10CR1"
TOLERANCE_DEG = 0.01

_VELOCITY_DEG_S = 10.0
_ACCELERATION_DEG_S2 = 10.0
_FASTEST_DEG_S, _HARDEST_DEG_S2 = 10.0, 20.0
_HOMING = Homing.of(velocity_deg_s=10.0, offset_deg=4.0)
_BACKLASH_DEG = 1.0
_FURTHEST = 43 * TURN
_HOMING_S = 120.0
_GRACE_S = 1.0
_ENABLED, _PROFILED = 1, 2


class K10CR1(Rotator):
    """A stage that turns without end, its counter lost with its power.

    Made by `open`.

    Notes
    -----
    Angles are those on the stage, positive as its counter goes, and the same after a whole turn: a move takes
    the shorter way, and never leaves the counter's range of 43 turns either way. From higher angles the stage
    itself goes a degree beyond and comes back, so that it always arrives from lower ones. Whether a movement
    has ended is asked; the messages that tell of it are sometimes not sent, and are not waited for.
    """

    def __init__(self, link: AptLink, clock: Clock, information: Information, velocity: Velocity) -> None:
        self._link, self.name, self._clock, self._velocity = link, link.name, clock, velocity
        self.identity = Identity(
            information.model, str(information.serial), ".".join(map(str, information.firmware))
        )
        self._asked = 0
        # on its counter, as the end of a movement showed
        self._stands: int | None = None
        self._target: int | None = None

    @classmethod
    def open(
        cls,
        url: str,
        name: str,
        clock: Clock,
        *,
        serial_number: str | None = None,
        velocity_deg_s: float = _VELOCITY_DEG_S,
        acceleration_deg_s2: float = _ACCELERATION_DEG_S2,
        reply_timeout_s: float = 1.0,
        log: str | None = None,
    ) -> Self:
        """Open a stage, see that it is the right one, and give it its parameters.

        Parameters
        ----------
        url : str
            Its port: what pyserial's `serial_for_url` takes.
        name : str
            What it is in the rig.
        clock : Clock
        serial_number : str, optional
            As engraved; another one's is refused.
        velocity_deg_s, acceleration_deg_s2 : float
            No more than 10 and 20.
        reply_timeout_s : float
            Longest wait for an answer.
        log : str, optional
            File to which all bytes are added.

        Raises
        ------
        InstrumentError
            If a rate is beyond the limits, the port cannot be opened, nothing answers, the model or serial
            number is another, or the stage does not take its parameters. Nothing has moved.
        """
        _refuse_beyond(name, "velocity", velocity_deg_s, _FASTEST_DEG_S, "°/s")
        _refuse_beyond(name, "acceleration", acceleration_deg_s2, _HARDEST_DEG_S2, "°/s²")
        velocity = Velocity.of(velocity_deg_s, acceleration_deg_s2)
        link = AptLink(url, name, clock, reply_timeout_s, log)
        try:
            information = Information.decode(link.ask(Id.HW_REQ_INFO, Id.HW_GET_INFO, param1=0).payload)
            _refuse_other(link.name, information, serial_number)
            stage = cls(link, clock, information, velocity)
            stage._stop_what_moves()
            stage._set_up()
        except BaseException:
            link.close()
            raise
        return stage

    @property
    def homed(self) -> bool:
        """Whether it knows its zero; asks the stage."""
        return self._status().homed

    def home(self, again: bool = False) -> Movement:
        """Begin to look for the zero, if it is not known.

        Parameters
        ----------
        again : bool
            Look for it in any case.
        """
        begun = self._clock.now()
        known = self._status().homed and not again
        if not known:
            self._target = None
            self._link.tell(Id.MOVE_HOME)

        def arrived() -> bool:
            nonlocal begun
            status = self._status()
            # where it was homed before, the bit alone does not show that it is again
            if status.homed and not status.moving and (known or _near(status.position, 0)):
                return True
            # a stage may overlook the message
            if not status.moving and self._clock.now() > begun + _GRACE_S:
                begun = self._clock.now()
                self._link.tell(Id.MOVE_HOME)
            return False

        return Movement(
            self._clock, self.name, "look for the zero", 0.0, arrived, self.stop, longest_s=_HOMING_S
        )

    def move_to(self, angle_deg: float) -> Movement:
        """Begin to turn, the shorter way.

        Raises
        ------
        InstrumentError
            If the angle is no number or the stage does not know its zero; nothing moves then.
        """
        if not math.isfinite(angle_deg):
            raise InstrumentError(self.name, "angle", f"{angle_deg}° is none", "ask for a number of degrees")
        what = f"move to {angle_deg:.3f}°"
        before = self._homed_status(what)
        self._asked, self._stands = microsteps(angle_deg), None
        target = within_counter(nearest_turn(self._asked, before.position))
        expected_s = 0.0
        if target != self._target or not _near(before.position, target):
            self._target = target
            self._link.tell(Id.MOVE_ABSOLUTE, payload=encode_number(target))
            # the answer shows that the order before it was taken
            self._homed_status(what)
            expected_s = self._travel_s(degrees(target - before.position))
        settled_s = self._clock.now() + expected_s + _GRACE_S

        def arrived() -> bool:
            status = self._homed_status(what)
            if status.moving:
                return False
            if _near(status.position, target):
                self._stands = status.position
                return True
            if self._clock.now() > settled_s:
                self._refuse_place(what, status)
            return False

        return Movement(self._clock, self.name, what, expected_s, arrived, self.stop)

    def position_deg(self) -> float:
        """Where it stands, as read back: of the equal angles the one nearest to that asked for last."""
        position, self._stands = self._stands, None
        if position is None:
            position = decode_number(self._link.ask(Id.POSITION_REQ, Id.POSITION_GET).payload)
        return degrees(nearest_turn(position, self._asked))

    def stop(self) -> None:
        """Slow down and stop, so that no step is lost."""
        self._target = None
        self._link.tell(Id.MOVE_STOP, param2=_PROFILED)
        # the answer shows that the order before it was taken
        self._status()

    def close(self) -> None:
        """Let go of the port; may be called twice."""
        self._link.close()

    def _status(self) -> Status:
        return Status.decode(self._link.ask(Id.STATUS_REQ, Id.STATUS_GET).payload)

    def _homed_status(self, what: str) -> Status:
        # an answer without a checksum is not believed at once
        if not (status := self._status()).homed and not (status := self._status()).homed:
            raise InstrumentError(
                self.name,
                what,
                "the stage does not know its zero, which it loses with its power",
                "see to its power, then run again: it looks for its zero at the start",
            )
        return status

    def _refuse_place(self, what: str, status: Status) -> None:
        complaints = f" and reports: {status.complaints}" if status.complaints else ""
        raise InstrumentError(
            self.name,
            what,
            f"it stands still at {degrees(status.position):.4f}° on its counter{complaints}",
            "see that nothing blocks it and that nothing else tells it to move, then run again",
        )

    def _travel_s(self, distance_deg: float) -> float:
        rates = self._velocity.velocity_deg_s, self._velocity.acceleration_deg_s2
        if distance_deg >= 0.0:
            return travel_time(distance_deg, *rates)
        return travel_time(distance_deg - _BACKLASH_DEG, *rates) + travel_time(_BACKLASH_DEG, *rates)

    def _stop_what_moves(self) -> None:
        """Stop a movement that an earlier program began."""
        if not self._status().moving:
            return
        self.stop()
        Movement(
            self._clock, self.name, "stop", _GRACE_S, lambda: not self._status().moving, self.stop
        ).wait()

    def _set_up(self) -> None:
        """Give it all parameters, some of which it may have lost with its power, and read them back."""
        self._link.tell(Id.CHANNEL_SET, param2=_ENABLED)
        enabled = self._link.ask(Id.CHANNEL_REQ, Id.CHANNEL_GET).param2
        self._expect("channel", enabled, _ENABLED)
        for field, first, payload in (
            ("velocity", Id.VELOCITY_SET, self._velocity.encode()),
            ("homing", Id.HOMING_SET, _HOMING.encode()),
            ("backlash", Id.BACKLASH_SET, encode_number(microsteps(_BACKLASH_DEG))),
        ):
            self._link.tell(first, payload=payload)
            # the protocol numbers what sets, what asks and what answers in this order
            self._expect(field, self._link.ask(Id(first + 1), Id(first + 2)).payload, payload)

    def _expect(self, field: str, found: int | bytes, wanted: int | bytes) -> None:
        if found != wanted:
            raise InstrumentError(
                self.name,
                field,
                f"reads back as {_words(found)} and not as {_words(wanted)}",
                "switch it off and on, then run again",
            )


def nearest_turn(position: int, to: int) -> int:
    """Of the positions that are the same but for whole turns, the one nearest to another; in microsteps."""
    return position + (to - position + TURN // 2) // TURN * TURN


def within_counter(position: int) -> int:
    """The same but for whole turns, and no further than the counter goes; in microsteps."""
    fewest, most = -((position + _FURTHEST) // TURN), (_FURTHEST - position) // TURN
    return position + min(max(0, fewest), most) * TURN


def _near(position: int, target: int) -> bool:
    return abs(degrees(position - target)) < TOLERANCE_DEG


def _words(value: int | bytes) -> str:
    return value.hex(" ") if isinstance(value, bytes) else str(value)


def _refuse_beyond(instrument: str, field: str, value: float, most: float, unit: str) -> None:
    if not 0.0 < value <= most:
        raise InstrumentError(
            instrument, field, f"{value:g} {unit} is out of range", f"choose more than 0 and at most {most:g}"
        )


def _refuse_other(instrument: str, information: Information, serial_number: str | None) -> None:
    if information.model != MODEL:
        raise InstrumentError(
            instrument, "model", f"is {information.model!r} and not {MODEL}", "name the stage's port"
        )
    if serial_number is not None and str(information.serial) != serial_number:
        raise InstrumentError(
            instrument,
            "serial number",
            f"is {information.serial} and not {serial_number}",
            "name the port of the stage that the rig file means, or correct the number there",
        )
