"""Whatever the rotary stage does, its driver arrives where it should or says in a line why it did not."""

from __future__ import annotations

from typing import Any

import pytest

from pbrdf.errors import InstrumentError
from pbrdf.instruments.apt_messages import CHANNEL, TURN, Id, Message, encode_number
from pbrdf.instruments.emulators.server import PtyServer
from pbrdf.instruments.movement import travel_time

Bench = Any
"""`StageBench` of the folder's fixtures, which cannot be imported."""

NAME = "generator retarder"


@pytest.fixture
def bench(new_stage_bench: Bench) -> Bench:
    return new_stage_bench()


@pytest.mark.parametrize(
    "fault",
    [
        "home-ignored",
        "home-silent",
        "completed-dropped",
        "completed-short",
        "completed-moving",
        "garbage",
        "split",
        "merged",
        "interleaved",
        "long-update",
    ],
)
@pytest.mark.parametrize("after", range(0, 30, 5))
def test_it_arrives_in_spite_of(bench: Bench, fault: str, after: int) -> None:
    bench.faults.arm(fault, after=after)
    with bench.homed() as driver:
        for angle in (36.0, 10.0, 200.0):
            driver.move_to(angle).wait()
            assert driver.position_deg() == pytest.approx(angle, abs=1e-4)
            assert bench.stage.angle_deg() == pytest.approx(angle, abs=1e-4)


@pytest.mark.parametrize(
    "fault", ["completed-dropped", "completed-short", "completed-moving", "split", "merged", "interleaved"]
)
def test_it_arrives_although_this_happens_always(bench: Bench, fault: str) -> None:
    bench.faults.arm(fault, count=-1)
    with bench.homed(reply_timeout_s=1.0) as driver:
        driver.move_to(36.0).wait()
        assert driver.position_deg() == pytest.approx(36.0, abs=1e-4)


def test_the_head_of_a_message_without_its_end_costs_one_answer(bench: Bench) -> None:
    with bench.homed() as driver:
        bench.faults.arm("garbage", value="81 04 0e 00 81 50 01 00")
        driver.move_to(36.0).wait()
        assert driver.position_deg() == pytest.approx(36.0, abs=1e-4)


def test_updates_that_an_earlier_program_switched_on_are_switched_off(bench: Bench) -> None:
    bench.stage.receive(Message(Id.HW_START_UPDATES).encode())
    with bench.homed() as driver:
        driver.move_to(36.0).wait()
        bench.clock.sleep(10.0)
        assert bench.stage.due() == b""


def test_a_movement_that_an_earlier_program_began_is_stopped(bench: Bench) -> None:
    bench.stage.receive(Message(Id.MOVE_HOME, CHANNEL).encode())
    bench.clock.sleep(60.0)
    bench.stage.receive(Message(Id.MOVE_ABSOLUTE, payload=encode_number(TURN)).encode())
    bench.clock.sleep(5.0)
    with bench.opened() as driver:
        assert 40.0 <= bench.stage.angle_deg() < 50.0
        driver.move_to(30.0).wait()
        assert driver.position_deg() == pytest.approx(30.0, abs=1e-4)


@pytest.mark.parametrize("value", [-50, -1, 1, 50])
def test_a_small_final_error_is_read_back(new_stage_bench: Bench, value: int) -> None:
    bench = new_stage_bench(error_usteps=0.0)
    with bench.homed() as driver:
        bench.faults.arm("final-error", value=value)
        driver.move_to(36.0).wait()
        assert driver.position_deg() == pytest.approx(36.0 + value * 360.0 / TURN, abs=1e-5)
        assert driver.position_deg() != 36.0


def test_a_large_final_error_is_an_error(bench: Bench) -> None:
    with bench.homed() as driver:
        bench.faults.arm("final-error", value=5000)
        with pytest.raises(InstrumentError, match=r"move to 36\.000°: it stands still at 36\.036"):
            driver.move_to(36.0).wait()


def test_a_stall_is_stopped_and_named(bench: Bench) -> None:
    with bench.homed() as driver:
        bench.faults.arm("stall")
        begin = bench.clock.now()
        with pytest.raises(InstrumentError, match=r"move to 36\.000°: has not ended in time"):
            driver.move_to(36.0).wait()
        assert bench.clock.now() - begin < 2.0 * travel_time(36.0, 10.0, 10.0) + 6.0
        assert bench.wrote(Id.MOVE_STOP)
        driver.move_to(36.0).wait()
        assert bench.stage.angle_deg() == pytest.approx(36.0, abs=1e-4)


def test_rates_lost_with_the_power_are_given_again(bench: Bench) -> None:
    bench.faults.arm("zero-parameters")
    bench.stage.power_up()
    with bench.homed() as driver:
        driver.move_to(36.0).wait()
        assert bench.stage.angle_deg() == pytest.approx(36.0, abs=1e-4)


@pytest.mark.parametrize(("after", "field"), [(0, "velocity"), (1, "homing"), (2, "backlash")])
def test_parameters_that_are_not_taken_are_named(bench: Bench, after: int, field: str) -> None:
    bench.faults.arm("zero-parameters")
    bench.stage.power_up()
    bench.faults.arm("parameters-kept", after=after)
    with pytest.raises(InstrumentError, match=f"{field}: reads back as"), bench.opened():
        pass


def test_a_zero_lost_on_the_way_is_named_and_found_again(bench: Bench) -> None:
    with PtyServer(bench) as server:
        with bench.open(server.url) as driver:
            driver.home().wait()
            bench.faults.arm("homed-lost", after=1)
            driver.move_to(36.0).wait()
            with pytest.raises(
                InstrumentError, match="does not know its zero, which it loses with its power"
            ):
                driver.move_to(72.0).wait()
        with bench.open(server.url) as driver:
            driver.home().wait()
            driver.move_to(72.0).wait()
            assert bench.stage.angle_deg() == pytest.approx(72.0, abs=1e-4)


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("wrong-model", "model: is 'K10CR2' and not K10CR1"),
        ("wrong-serial", "serial number: is 55999999 and not 55000488"),
    ],
)
def test_another_stage_is_refused_before_anything_moves(bench: Bench, fault: str, message: str) -> None:
    bench.faults.arm(fault)
    with pytest.raises(InstrumentError, match=message), bench.opened(serial_number="55000488"):
        pass
    assert bench.written == bytes.fromhex("18 00 00 00 50 01  12 00 00 00 50 01  05 00 00 00 50 01")


def test_a_refused_port_is_free_again(bench: Bench) -> None:
    bench.faults.arm("wrong-model")
    with PtyServer(bench) as server:
        with pytest.raises(InstrumentError, match="K10CR2"):
            bench.open(server.url)
        bench.open(server.url).close()


@pytest.mark.parametrize("after", range(14))
def test_a_message_lost_while_it_is_opened_or_homed_is_said_again(bench: Bench, after: int) -> None:
    bench.faults.arm("silent", after=after)
    with bench.homed() as driver:
        assert driver.homed


def test_a_zero_that_is_never_found_is_named(bench: Bench) -> None:
    with bench.opened() as driver:
        bench.faults.arm("home-ignored", count=-1)
        begin = bench.clock.now()
        with pytest.raises(InstrumentError, match="look for the zero: has not ended in time"):
            driver.home().wait()
        assert 120.0 <= bench.clock.now() - begin < 125.0


def test_an_order_that_is_lost_is_named(bench: Bench) -> None:
    with bench.homed() as driver:
        bench.faults.arm("silent", after=1)
        with pytest.raises(InstrumentError, match=r"move to 36\.000°: it stands still at 0\.0000°"):
            driver.move_to(36.0).wait()


def test_silence_is_named(bench: Bench) -> None:
    bench.faults.arm("silent", count=-1)
    with pytest.raises(InstrumentError, match=f"{NAME} at .*: answer: none to HW_REQ_INFO"), bench.opened():
        pass


def test_a_complaint_is_passed_on(bench: Bench) -> None:
    with bench.homed() as driver:
        bench.faults.arm("complaint")
        with pytest.raises(InstrumentError, match=r"the motor has lost its supply \(code 12\)"):
            driver.move_to(36.0)


def test_a_channel_that_is_switched_off_meanwhile_is_named(bench: Bench) -> None:
    with bench.homed() as driver:
        bench.stage.receive(Message(Id.CHANNEL_SET, CHANNEL, 2).encode())
        with pytest.raises(InstrumentError, match=r"stands still at 0\.0000°"):
            driver.move_to(36.0).wait()


def test_a_pulled_cable_is_named_and_the_stage_works_at_its_new_port(bench: Bench) -> None:
    server = PtyServer(bench)
    driver = bench.open(server.url)
    driver.home().wait()
    movement = driver.move_to(90.0)
    server.unplug()
    with pytest.raises(InstrumentError, match=f"{NAME} at {server.url}: port: is lost"):
        movement.wait()
    with pytest.raises(InstrumentError, match="port: is lost"):
        driver.stop()
    old = server.url
    # whoever asks next is given the old name, so that the stage comes back under another
    with PtyServer(bench) as other:
        server.plug_in()
        assert {old, other.url} != {server.url}
        driver.close()
        with bench.open(server.url) as again:
            assert again.homed
            again.move_to(45.0).wait()
            assert again.position_deg() == pytest.approx(45.0, abs=1e-4)
    server.close()


def test_a_port_that_is_not_there_is_named(bench: Bench) -> None:
    with pytest.raises(InstrumentError, match=f"{NAME} at /dev/none: port: cannot be opened"):
        bench.open("/dev/none")
