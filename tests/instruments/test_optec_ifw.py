from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from pbrdf.errors import InstrumentError
from pbrdf.instruments.emulators.clock import VirtualClock
from pbrdf.instruments.emulators.faults import Faults
from pbrdf.instruments.emulators.optec_ifw import EmulatedIFW
from pbrdf.instruments.emulators.server import PtyServer
from pbrdf.instruments.optec_ifw import LONGEST_S, OptecIFW

Open = Callable[..., OptecIFW]


class _Heard(EmulatedIFW):
    """A wheel that remembers what it was sent."""

    heard = b""

    def receive(self, data: bytes) -> bytes:
        self.heard += data
        return super().receive(data)


class _Bench:
    """A wheel, its wire, and drivers that are closed in the end."""

    def __init__(self) -> None:
        self.clock, self.faults = VirtualClock(), Faults()
        self.drivers: list[OptecIFW] = []
        self.plug(_Heard(self.clock, self.faults))

    def plug(self, wheel: _Heard) -> None:
        self.wheel = wheel
        self.server = PtyServer(wheel)

    def open(self, **options: Any) -> OptecIFW:
        fast = {"turn_s": 1.2, "home_s": 5.0, "reply_timeout_s": 0.5, "poll_timeout_s": 0.003}
        driver = OptecIFW.open(self.server.url, "filter wheel", self.clock, **(fast | options))
        self.drivers.append(driver)
        return driver

    def close(self) -> None:
        for driver in self.drivers:
            driver.close()
        self.server.close()


@pytest.fixture
def bench() -> Iterator[_Bench]:
    one = _Bench()
    yield one
    one.close()


def test_a_wheel_is_found_homed_turned_and_read_back(bench: _Bench) -> None:
    driver = bench.open()
    assert driver.name == f"filter wheel at {bench.server.url}"
    assert (driver.identity.model, driver.identity.serial, driver.identity.firmware) == (
        "Optec IFW",
        "20731",
        "2.04",
    )
    assert driver.slots == 5
    driver.home().wait()
    assert driver.slot() == 1
    for slot in (3, 5, 1, 2, 4):
        driver.select(slot).wait()
        assert driver.slot() == bench.wheel.slot_in_beam() == slot


@pytest.mark.parametrize(
    ("wheel", "firmware", "slots", "model"),
    [
        ("A", "2.04", 5, "Optec IFW"),
        ("E", "4.00", 5, "Optec IFW"),
        ("F", "2.04", 8, "Optec IFW"),
        ("H", "2.04", 8, "Optec IFW"),
        ("I", "2.04", 7, "Optec IFW"),
        ("K", "2.04", 7, "Optec IFW"),
        ("A", "3.01", 9, "Optec IFW3"),
        ("C", "3.01", 6, "Optec IFW3"),
        ("G", "3.01", 5, "Optec IFW3"),
    ],
)
def test_the_letter_of_the_wheel_tells_its_slots(
    bench: _Bench, wheel: str, firmware: str, slots: int, model: str
) -> None:
    bench.server.close()
    bench.plug(_Heard(bench.clock, bench.faults, wheel=wheel, firmware=firmware))
    driver = bench.open()
    assert (driver.slots, driver.identity.model) == (slots, model)
    driver.select(slots).wait()
    assert driver.slot() == slots


@pytest.mark.parametrize("slot", [-1, 0, 6, 8, 10])
def test_a_slot_beyond_the_wheel_is_refused_before_a_byte_is_written(bench: _Bench, slot: int) -> None:
    driver = bench.open()
    before = bench.wheel.heard
    with pytest.raises(InstrumentError, match=rf"slot: {slot} is not one of 1 to 5; name a slot"):
        driver.select(slot)
    driver.slot()
    assert bench.wheel.heard == before + b"WFILTR"


def test_a_wheel_remembers_where_it_stood(bench: _Bench) -> None:
    first = bench.open()
    first.select(4).wait()
    first.close()
    assert bench.open().slot() == 4


def test_nothing_is_sent_before_a_movement_has_ended(bench: _Bench) -> None:
    driver = bench.open()
    movement = driver.select(3)
    before = bench.wheel.heard
    for act in (driver.slot, driver.home, lambda: driver.select(2)):
        with pytest.raises(InstrumentError, match="cannot be sent before WGOTO3 has ended; await"):
            act()
    assert bench.wheel.heard == before
    assert bench.wheel.slot_in_beam() is None
    movement.wait()
    assert driver.slot() == 3


def test_serial_mode_is_left_so_that_the_buttons_work_again(bench: _Bench) -> None:
    driver = bench.open()
    driver.close()
    driver.close()
    again = bench.open()
    assert b"WEXITS" in bench.wheel.heard
    assert again.slot() == 1


def test_a_second_program_is_refused(bench: _Bench) -> None:
    bench.open()
    with pytest.raises(InstrumentError, match="is in use by another program"):
        bench.open()


def test_another_wheel_or_controller_than_asked_for_is_refused(bench: _Bench) -> None:
    with pytest.raises(InstrumentError, match=r"serial number: is 20731, not 17; correct the rig file"):
        bench.open(serial_number="17")
    with pytest.raises(InstrumentError, match=r"wheel: is A, not B; correct the rig file"):
        bench.open(wheel="B")
    bench.open(serial_number="20731", wheel="A")


def test_every_byte_can_be_logged(bench: _Bench, tmp_path: Path) -> None:
    bench.open(log=tmp_path / "wheel.log").select(2).wait()
    assert "WGOTO2" in (tmp_path / "wheel.log").read_text()


@pytest.mark.parametrize("count", [1, 3])
def test_a_call_for_serial_mode_that_is_not_answered_is_repeated(bench: _Bench, count: int) -> None:
    bench.faults.arm("silent-start", count=count)
    assert bench.open(reply_timeout_s=0.05).slot() == 1


def test_a_port_where_nobody_answers_is_refused(bench: _Bench) -> None:
    bench.faults.arm("silent-start", count=-1)
    with pytest.raises(InstrumentError, match="WSMODE: has not been answered; see that the wheel has power"):
        bench.open(reply_timeout_s=0.05)


def test_noise_at_opening_does_not_matter(bench: _Bench) -> None:
    bench.faults.arm("garbage", value="ff 00 8f")
    bench.faults.arm("garbage", value="ff 57 0d 0a 2a 0d")
    assert bench.open().slot() == 1
    bench.drivers.pop().close()
    assert bench.open().slot() == 1


def test_a_wheel_that_still_turns_for_a_program_that_has_ended_is_opened(bench: _Bench) -> None:
    killed = bench.open(reply_timeout_s=0.05)
    killed.select(3)
    killed._port.close()
    with pytest.raises(InstrumentError, match="WSMODE"):
        bench.open(reply_timeout_s=0.05)
    bench.clock.sleep(10.0)
    assert bench.open(reply_timeout_s=0.05).slot() == 3


@pytest.mark.parametrize("end", [0, 1, 2, 3, 4, 5])
def test_either_order_of_line_ends_is_read(bench: _Bench, end: int) -> None:
    bench.faults.arm("cr-lf", after=end, count=-1 if end == 0 else 1)
    driver = bench.open()
    driver.select(3).wait()
    driver.home().wait()
    assert driver.slot() == 1


WORDS = {
    1: "found no first slot in 2600 steps",
    2: "finds the pulses of its SBIG input out of bounds",
    3: "does not know the wheel",
    4: "could not leave its slot",
    5: "calls the slot invalid",
    6: "did not reach the slot",
    7: "has no such slot in this wheel",
    8: "has no 12 V",
}


@pytest.mark.parametrize("number", WORDS)
@pytest.mark.parametrize("when", ["", "-at-once"])
@pytest.mark.parametrize(("command", "fault"), [("WGOTO3", "goto-error"), ("WHOMES", "home-error")])
def test_every_error_is_told_in_words(
    bench: _Bench, number: int, when: str, command: str, fault: str
) -> None:
    driver = bench.open()
    bench.faults.arm(fault + when, value=number)
    movement = driver.select(3) if command == "WGOTO3" else driver.home()
    with pytest.raises(InstrumentError, match=rf"{command}: ER={number}: {WORDS[number]}; \w+"):
        movement.wait()


@pytest.mark.parametrize("number", [1, 4, 6, 8])
def test_a_wheel_that_has_lost_its_place_is_homed_before_it_turns_again(bench: _Bench, number: int) -> None:
    driver = bench.open()
    bench.faults.arm("goto-error", value=number)
    with pytest.raises(InstrumentError):
        driver.select(3).wait()
    before = bench.wheel.heard
    with pytest.raises(InstrumentError, match="slot: the wheel has lost its place; home it first"):
        driver.select(3)
    assert bench.wheel.heard == before
    driver.home().wait()
    driver.select(3).wait()
    assert driver.slot() == 3


def test_an_unknown_error_is_told_with_its_number(bench: _Bench) -> None:
    driver = bench.open()
    bench.faults.arm("goto-error", value=9)
    with pytest.raises(InstrumentError, match="WGOTO3: ER=9: tells an unknown error"):
        driver.select(3).wait()


def test_a_wheel_without_12_v_refuses_to_move(bench: _Bench) -> None:
    driver = bench.open()
    bench.faults.arm("power-off", count=2)
    with pytest.raises(InstrumentError, match="ER=8: has no 12 V; plug in its power supply"):
        driver.home().wait()
    with pytest.raises(InstrumentError, match="has lost its place"):
        driver.select(2)


def test_a_slow_homing_is_awaited(bench: _Bench) -> None:
    driver = bench.open()
    bench.faults.arm("slow-home", value=15.0)
    driver.home().wait()
    assert bench.clock.now() >= 20.0


def test_a_late_end_of_a_turn_is_awaited(bench: _Bench) -> None:
    driver = bench.open()
    bench.faults.arm("late-star", value=12.0)
    driver.select(2).wait()
    assert bench.clock.now() >= 12.6
    assert driver.slot() == 2


def test_a_turn_that_never_ends_is_given_up(bench: _Bench) -> None:
    driver = bench.open(poll_timeout_s=0.001)
    bench.faults.arm("late-star", value=1e9)
    with pytest.raises(InstrumentError, match="turn to slot 2: has not ended in time; see"):
        driver.select(2).wait()
    assert LONGEST_S <= bench.clock.now() <= LONGEST_S + 2.0
    with pytest.raises(InstrumentError, match="home it first"):
        driver.select(2)


def test_a_wheel_that_slipped_is_noticed_by_its_read_back(bench: _Bench) -> None:
    driver = bench.open()
    bench.faults.arm("wrong-slot")
    with pytest.raises(InstrumentError, match="WGOTO3: ended in slot 4, not 3; see that the wheel"):
        driver.select(3).wait()
    with pytest.raises(InstrumentError, match="home it first"):
        driver.select(3)


def test_a_wheel_that_was_reset_out_of_serial_mode_is_told_from_a_dead_one(bench: _Bench) -> None:
    driver = bench.open(reply_timeout_s=0.05)
    bench.faults.arm("reset")
    with pytest.raises(
        InstrumentError, match=r"WFILTR: was not answered: the wheel had left serial mode; see"
    ):
        driver.slot()
    with pytest.raises(InstrumentError, match="home it first"):
        driver.select(2)
    driver.home().wait()
    driver.select(2).wait()
    bench.faults.arm("dead")
    with pytest.raises(InstrumentError, match=r"WFILTR: was not answered; see to its power"):
        driver.slot()


def test_a_reset_during_a_turn_is_given_up_in_time(bench: _Bench) -> None:
    driver = bench.open(poll_timeout_s=0.001)
    bench.faults.arm("reset")
    with pytest.raises(InstrumentError, match="turn to slot 4: has not ended in time"):
        driver.select(4).wait()


def test_an_unplugged_wheel_is_an_error_and_can_be_opened_under_its_new_port(bench: _Bench) -> None:
    driver = bench.open()
    driver.select(4).wait()
    bench.server.unplug()
    with pytest.raises(InstrumentError, match=r"port: has gone .*; see to its cable"):
        driver.slot()
    driver.close()
    bench.server.plug_in()
    assert bench.open().slot() == 4


def test_another_instrument_at_the_port_is_refused(bench: _Bench) -> None:
    class Parrot(_Heard):
        def receive(self, data: bytes) -> bytes:
            return b"!\r\n" if data == b"WSMODE" else b"Z\r\n"

    bench.server.close()
    bench.plug(Parrot(bench.clock, bench.faults))
    with pytest.raises(InstrumentError, match="WIDENT: was answered by `Z`; see that the port is an Optec"):
        bench.open()


def test_old_firmware_tells_neither_number_nor_version(bench: _Bench) -> None:
    class Old(_Heard):
        def receive(self, data: bytes) -> bytes:
            return b"" if data[:2] in (b"WV", b"WN") else super().receive(data)

    bench.server.close()
    bench.plug(Old(bench.clock, bench.faults))
    driver = bench.open(reply_timeout_s=0.05)
    assert (driver.identity.serial, driver.identity.firmware, driver.slots) == ("", "", 5)
