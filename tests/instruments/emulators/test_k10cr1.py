"""An emulated stage moves as a real one does, and says what a real one says."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable

import numpy as np
import pytest

from pbrdf.instruments.apt_messages import (
    CHANNEL,
    HOST,
    STAGE,
    TURN,
    Homing,
    Id,
    Information,
    Message,
    MessageReader,
    Status,
    Velocity,
    encode_number,
    microsteps,
)
from pbrdf.instruments.emulators.clock import ScaledClock, VirtualClock
from pbrdf.instruments.emulators.faults import Faults
from pbrdf.instruments.emulators.k10cr1 import K10CR1Emulator
from pbrdf.instruments.movement import travel_time


class Bench:
    """A stage, its clock, its faults, and what it has said."""

    def __init__(self, **parameters: float) -> None:
        self.clock, self.faults = VirtualClock(), Faults()
        self.stage = K10CR1Emulator(self.clock, self.faults, **parameters)
        self.reader = MessageReader(dests=(HOST,), sources=(STAGE,))

    def say(self, number: Id, param1: int = CHANNEL, param2: int = 0, payload: bytes = b"") -> list[Message]:
        data = self.stage.receive(Message(number, param1, param2, payload).encode())
        return self.reader.feed(data)

    def after(self, seconds: float) -> list[Message]:
        self.clock.sleep(seconds)
        return self.reader.feed(self.stage.due())

    def status(self) -> Status:
        return Status.decode(self.say(Id.STATUS_REQ)[-1].payload)

    def homed(self) -> Bench:
        self.say(Id.MOVE_HOME)
        self.after(60.0)
        return self

    def go(self, angle_deg: float) -> None:
        self.say(Id.MOVE_ABSOLUTE, payload=encode_number(microsteps(angle_deg)))


@pytest.fixture
def bench() -> Bench:
    return Bench(error_usteps=0.0).homed()


def numbers(messages: list[Message]) -> list[int]:
    return [message.id for message in messages]


def test_at_power_up_it_does_not_know_where_it_stands() -> None:
    bench = Bench(power_up_deg=123.0)
    assert bench.status() == Status(0, 0x8000_0000)
    assert bench.stage.angle_deg() == pytest.approx(123.0, abs=1e-5)


def test_homing_ends_at_the_true_zero() -> None:
    bench = Bench(power_up_deg=123.0)
    assert bench.say(Id.MOVE_HOME) == []
    assert bench.status().bits == 0x8000_0230
    assert bench.after(1.0) == []
    assert numbers(bench.after(60.0)) == [Id.MOVE_HOMED]
    assert bench.after(1.0) == []
    assert bench.status() == Status(0, 0x8000_0400)
    assert bench.stage.angle_deg() == 0.0


def test_homing_takes_the_way_to_the_switch_and_back() -> None:
    bench = Bench(power_up_deg=123.0)
    bench.say(Id.MOVE_HOME)
    expected = travel_time(127.0, 10.0, 10.0) + travel_time(4.0, 10.0, 10.0)
    assert bench.after(expected - 0.01) == []
    assert numbers(bench.after(0.02)) == [Id.MOVE_HOMED]


def test_the_zero_follows_the_offset_from_the_switch() -> None:
    bench = Bench(power_up_deg=20.0)
    bench.say(Id.HOMING_SET, payload=Homing.of(10.0, 5.0).encode())
    assert bench.homed().stage.angle_deg() == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize("distance_deg", [0.5, 5.0, 22.5, 36.0, 90.0, 360.0])
def test_a_move_takes_the_time_of_a_trapezoid(bench: Bench, distance_deg: float) -> None:
    bench.go(distance_deg)
    assert bench.after(travel_time(distance_deg, 10.0, 10.0) - 0.01) == []
    assert numbers(bench.after(0.02)) == [Id.MOVE_COMPLETED]
    assert bench.status() == Status(microsteps(distance_deg), 0x8000_0400)


def test_speed_and_acceleration_are_kept(bench: Bench) -> None:
    bench.go(90.0)
    angles = []
    for _ in range(100):
        angles.append(bench.stage.angle_deg())
        bench.clock.sleep(0.1)
    speeds = np.diff(angles) / 0.1
    assert np.all(speeds >= 0.0) and speeds.max() == pytest.approx(10.0, abs=1e-3)
    assert np.abs(np.diff(speeds) / 0.1).max() <= 10.0 + 1e-2


def test_from_higher_angles_it_goes_beyond_and_comes_back(bench: Bench) -> None:
    bench.go(30.0)
    bench.after(60.0)
    bench.go(20.0)
    bench.clock.sleep(travel_time(11.0, 10.0, 10.0))
    assert bench.stage.angle_deg() == pytest.approx(19.0, abs=1e-4)
    assert bench.status().moving
    assert numbers(bench.after(travel_time(1.0, 10.0, 10.0) + 0.01)) == [Id.MOVE_COMPLETED]
    assert bench.stage.angle_deg() == pytest.approx(20.0, abs=1e-5)


def test_a_relative_move_adds_up(bench: Bench) -> None:
    for _ in range(3):
        bench.say(Id.MOVE_RELATIVE, payload=encode_number(microsteps(150.0)))
        bench.after(60.0)
    assert bench.status().position == microsteps(450.0)
    assert bench.stage.angle_deg() == pytest.approx(90.0, abs=1e-5)


def test_the_counter_can_be_set_without_moving(bench: Bench) -> None:
    bench.say(Id.POSITION_SET, payload=encode_number(1000))
    assert bench.status().position == 1000
    assert bench.stage.angle_deg() == 0.0


def test_final_error_depends_on_seed_and_angle_alone() -> None:
    def ends(angles_deg: list[float], seed: int) -> dict[float, int]:
        bench, found = Bench(seed=seed).homed(), {}
        for angle_deg in angles_deg:
            bench.go(angle_deg)
            bench.after(120.0)
            found[angle_deg] = bench.status().position - microsteps(angle_deg)
        return found

    once = ends([10.0, 20.0, 370.0, -350.0], seed=1)
    assert ends([20.0, -350.0, 10.0, 370.0], seed=1) == once
    assert once[10.0] == once[370.0] == once[-350.0]
    assert ends([10.0, 20.0, 30.0], seed=2) != ends([10.0, 20.0, 30.0], seed=1)


def test_final_errors_spread_as_asked() -> None:
    bench = Bench(error_usteps=5.0).homed()
    errors = []
    for step in range(1, 400):
        bench.go(0.5 * step)
        bench.after(10.0)
        errors.append(bench.status().position - microsteps(0.5 * step))
    assert np.mean(errors) == pytest.approx(0.0, abs=0.8)
    assert np.std(errors) == pytest.approx(5.0, abs=0.6)


def test_a_stop_leaves_it_where_it_is(bench: Bench) -> None:
    bench.go(90.0)
    bench.clock.sleep(4.0)
    (stopped,) = bench.say(Id.MOVE_STOP, param2=2)
    assert stopped.id == Id.MOVE_STOPPED
    status = Status.decode(stopped.payload)
    assert not status.moving and status.homed
    assert status.position == pytest.approx(microsteps(35.0), abs=2)
    assert bench.after(60.0) == []
    assert bench.status() == status


def test_a_stop_while_homing_leaves_it_without_its_zero() -> None:
    bench = Bench()
    bench.say(Id.MOVE_HOME)
    bench.clock.sleep(1.0)
    bench.say(Id.MOVE_STOP, param2=1)
    bench.after(60.0)
    assert not bench.status().homed


def test_updates_come_on_their_own_when_wanted(bench: Bench) -> None:
    bench.say(Id.HW_START_UPDATES, 0)
    assert bench.after(0.05) == []
    assert numbers(bench.after(0.06)) == [Id.STATUS_GET]
    assert bench.after(0.05) == []
    bench.say(Id.HW_STOP_UPDATES, 0)
    assert bench.after(1.0) == []


def test_a_channel_switched_off_does_not_move(bench: Bench) -> None:
    bench.say(Id.CHANNEL_SET, CHANNEL, 2)
    assert bench.say(Id.CHANNEL_REQ)[0].param2 == 2
    bench.go(10.0)
    bench.after(60.0)
    assert bench.status() == Status(0, 0x400)


@pytest.mark.parametrize(
    ("first", "payload"),
    [
        (Id.VELOCITY_SET, Velocity.of(5.0, 7.0).encode()),
        (Id.HOMING_SET, Homing.of(5.0, 3.0).encode()),
        (Id.BACKLASH_SET, encode_number(77)),
        (Id.JOG_SET, struct.pack("<HHiiiiH", CHANNEL, 1, 2, 3, 4, 5, 1)),
        (Id.LIMITS_SET, struct.pack("<HHHiiH", CHANNEL, 1, 1, 5, 6, 1)),
    ],
)
def test_parameters_are_kept_until_the_power_fails(bench: Bench, first: Id, payload: bytes) -> None:
    before = bench.say(Id(first + 1))
    bench.say(first, payload=payload)
    (answer,) = bench.say(Id(first + 1))
    assert (answer.id, answer.payload) == (first + 2, payload)
    bench.stage.power_up()
    assert bench.say(Id(first + 1)) == before
    assert bench.status() == Status(0, 0x8000_0000)


def test_what_it_does_not_know_it_ignores(bench: Bench) -> None:
    assert bench.say(Id.HW_DISCONNECT) == []
    assert bench.stage.receive(b"\x99\x77\x01\x00\x50\x01") == b""
    assert bench.status() == Status(0, 0x8000_0400)


def test_orders_in_pieces_and_together_are_understood(bench: Bench) -> None:
    order = Message(Id.MOVE_ABSOLUTE, payload=encode_number(1000)).encode()
    question = Message(Id.POSITION_REQ, CHANNEL).encode()
    assert bench.stage.receive(order[:7]) == b""
    (answer,) = bench.reader.feed(bench.stage.receive(order[7:] + question))
    assert answer.id == Id.POSITION_GET
    bench.after(1.0)
    assert bench.status().position == 1000


FAULTS_OF_A_MOVE: dict[str, Callable[[list[Message]], bool]] = {
    "completed-dropped": lambda said: said == [],
    "completed-short": lambda said: said[0].payload == b"" and said[0].param1 == CHANNEL,
    "completed-moving": lambda said: Status.decode(said[0].payload).bits == 0x8000_0430,
}


@pytest.mark.parametrize("fault", FAULTS_OF_A_MOVE)
def test_faults_of_completion_strike_once(bench: Bench, fault: str) -> None:
    bench.faults.arm(fault)
    bench.go(5.0)
    assert FAULTS_OF_A_MOVE[fault](bench.after(10.0))
    assert bench.status() == Status(microsteps(5.0), 0x8000_0400)
    bench.go(10.0)
    assert Status.decode(bench.after(10.0)[0].payload) == bench.status()


@pytest.mark.parametrize("value", [-50, -1, 1, 50])
def test_a_final_error_is_as_large_as_asked(bench: Bench, value: int) -> None:
    bench.faults.arm("final-error", value=value)
    bench.go(5.0)
    bench.after(10.0)
    assert bench.status().position == microsteps(5.0) + value


def test_a_stall_lasts_until_it_is_stopped(bench: Bench) -> None:
    bench.faults.arm("stall")
    bench.go(5.0)
    bench.after(1e6)
    assert bench.status() == Status(0, 0x8000_0430)
    bench.say(Id.MOVE_STOP, param2=2)
    assert bench.status() == Status(0, 0x8000_0400)


def test_without_rates_it_says_that_it_moves_and_does_not() -> None:
    clock, faults = VirtualClock(), Faults([{"fault": "zero-parameters"}])
    bench = Bench()
    bench.stage = K10CR1Emulator(clock, faults)
    for order, payload in ((Id.MOVE_HOME, b""), (Id.MOVE_ABSOLUTE, encode_number(TURN))):
        bench.say(order, payload=payload)
        clock.sleep(1e6)
        assert bench.status().moving
        assert bench.stage.angle_deg() == pytest.approx(37.0, abs=1e-5)


def test_homing_may_be_overlooked_or_end_in_silence() -> None:
    bench = Bench()
    bench.faults.arm("home-ignored")
    bench.say(Id.MOVE_HOME)
    assert not bench.status().moving
    bench.faults.arm("home-silent")
    bench.say(Id.MOVE_HOME)
    assert bench.after(60.0) == []
    assert bench.status().homed


def test_power_that_fails_takes_the_zero_with_it(bench: Bench) -> None:
    bench.go(5.0)
    bench.after(10.0)
    bench.faults.arm("homed-lost")
    bench.go(10.0)
    assert bench.status() == Status(0, 0x8000_0000)
    assert bench.stage.angle_deg() == pytest.approx(5.0, abs=1e-5)


def test_an_update_may_come_before_or_with_an_answer(bench: Bench) -> None:
    bench.faults.arm("interleaved")
    assert numbers(bench.say(Id.POSITION_REQ)) == [Id.STATUS_GET, Id.POSITION_GET]
    bench.faults.arm("merged")
    assert numbers(bench.say(Id.POSITION_REQ)) == [Id.POSITION_GET, Id.STATUS_GET]


def test_an_update_may_be_long(bench: Bench) -> None:
    bench.faults.arm("long-update")
    (update,) = bench.say(Id.STATUS_REQ)
    assert len(update.payload) == 28
    assert Status.decode(update.payload) == bench.status()


def test_an_answer_may_come_in_pieces(bench: Bench) -> None:
    question = Message(Id.POSITION_REQ, CHANNEL).encode()
    whole = bench.stage.receive(question)
    bench.faults.arm("split")
    pieces = [bench.stage.receive(question), bench.stage.due(), bench.stage.due()]
    assert all(pieces) and b"".join(pieces) == whole
    bench.faults.arm("split")
    # who asks again in between gets the rest first
    assert bench.stage.receive(question) + bench.stage.receive(question) == whole + whole


def test_rubbish_may_come_first(bench: Bench) -> None:
    question = Message(Id.POSITION_REQ, CHANNEL).encode()
    whole = bench.stage.receive(question)
    bench.faults.arm("garbage", value="00 ff 81 04")
    assert bench.stage.receive(question) == b"\x00\xff\x81\x04" + whole
    bench.faults.arm("garbage")
    assert bench.stage.receive(question).endswith(whole)


def test_it_may_be_silent_or_complain(bench: Bench) -> None:
    bench.faults.arm("silent")
    assert bench.say(Id.POSITION_REQ) == []
    bench.faults.arm("complaint")
    assert numbers(bench.say(Id.POSITION_REQ)) == [Id.HW_RICH_RESPONSE]


def test_it_may_be_another(bench: Bench) -> None:
    def information() -> Information:
        return Information.decode(bench.say(Id.HW_REQ_INFO, 0)[0].payload)

    assert information() == Information(55_000_488, "K10CR1", (2, 0, 3))
    bench.faults.arm("wrong-model")
    assert information().model == "K10CR2"
    bench.faults.arm("wrong-serial")
    assert information().serial == 55_999_999


def test_parameters_may_be_deaf(bench: Bench) -> None:
    bench.faults.arm("parameters-kept")
    before = bench.say(Id.VELOCITY_REQ)
    bench.say(Id.VELOCITY_SET, payload=Velocity.of(1.0, 1.0).encode())
    assert bench.say(Id.VELOCITY_REQ) == before


def test_a_scaled_clock_is_faster_than_the_wall() -> None:
    clock, wall = ScaledClock(100.0), time.monotonic()
    begin = clock.now()
    clock.sleep(2.0)
    passed = clock.now() - begin
    assert 2.0 <= passed <= 100.0 * (time.monotonic() - wall)
