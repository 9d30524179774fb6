from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from pbrdf.errors import InstrumentError
from pbrdf.instruments.emulators.clock import VirtualClock
from pbrdf.instruments.emulators.faults import Faults
from pbrdf.instruments.emulators.grbl import EmulatedGrbl
from pbrdf.instruments.emulators.server import PtyServer
from pbrdf.instruments.grbl import Drive, GrblTable
from pbrdf.instruments.grbl_words import ALARMS, ERRORS
from pbrdf.instruments.manual import Operator
from pbrdf.instruments.movement import travel_time

DRIVE = Drive(250.0, 10.0, 5.0, (0.0, 180.0), run_up_deg=1.0, home_deg=2.0)
PLAY_DEG = 0.4


class _Heard(EmulatedGrbl):
    """A board that remembers what it was sent."""

    heard = b""

    def receive(self, data: bytes) -> bytes:
        self.heard += data
        return super().receive(data)


class _Bench:
    """A board, its wire, and drivers that are closed in the end."""

    def __init__(self) -> None:
        self.clock, self.faults = VirtualClock(), Faults()
        self.drivers: list[GrblTable] = []
        self.plug()

    def plug(self, **options: Any) -> None:
        options = {"switch_deg": 2.0, "start_deg": 30.0, "play_deg": PLAY_DEG} | options
        self.board = _Heard(self.clock, self.faults, **options)
        self.server = PtyServer(self.board)

    def replug(self, **options: Any) -> None:
        self.server.close()
        self.plug(**options)

    def open(self, drive: Drive = DRIVE, **options: Any) -> GrblTable:
        fast = {"reply_timeout_s": 0.5, "poll_timeout_s": 0.003}
        driver = GrblTable.open(self.server.url, "table", self.clock, drive=drive, **(fast | options))
        self.drivers.append(driver)
        return driver

    def homed(self, **options: Any) -> GrblTable:
        driver = self.open(**options)
        driver.home().wait()
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


class _Person(Operator):
    """An operator who does what is asked."""

    def __init__(self, act: Callable[[], None] = lambda: None) -> None:
        super().__init__()
        self.asked: list[str] = []
        self._act = act

    def ask(self, instrument: str, task: str) -> str:
        self.asked.append(task)
        self._act()
        return ""


def test_a_table_is_found_homed_turned_and_read_back(bench: _Bench) -> None:
    driver = bench.homed()
    assert driver.name == f"table at {bench.server.url}"
    assert (driver.identity.model, driver.identity.firmware) == ("Grbl", "1.1h.20190825")
    assert driver.position_deg() == pytest.approx(2.0, abs=1e-9)
    for angle in (90.0, 45.0, 45.004, 180.0, 3.0, 120.5):
        driver.move_to(angle).wait()
        assert driver.position_deg() == pytest.approx(angle, abs=0.5 / 250.0 + 5e-4)
        assert bench.board.angle_deg() == pytest.approx(angle, abs=0.5 / 250.0 + 1e-9)


def test_settings_are_set_and_read_back(bench: _Bench) -> None:
    bench.open()
    for line in (b"$1=255\n", b"$22=1\n", b"$110=600\n", b"$120=5\n"):
        assert line in bench.board.heard
    assert b"$100=" not in bench.board.heard
    bench.board.heard = b""
    bench.drivers.pop().close()
    bench.open()
    # memory wears: what is right already is not written
    assert b"=" not in bench.board.heard


def test_a_setting_that_does_not_take_is_refused(bench: _Bench) -> None:
    bench.faults.arm("setting-kept", after=2)
    with pytest.raises(InstrumentError, match=r"\$110: is 500\.0 after it was set to 600; see"):
        bench.open()


def test_settings_that_are_no_numbers_do_not_matter(bench: _Bench) -> None:
    class Hal(_Heard):
        def receive(self, data: bytes) -> bytes:
            more = b"$70=\r\n$73=lab\r\n$302=192.168.5.1\r\n" if data == b"$$\n" else b""
            return more + super().receive(data)

    bench.server.close()
    bench.board = Hal(bench.clock, bench.faults)
    bench.server = PtyServer(bench.board)
    bench.open()


def test_targets_are_approached_from_below(bench: _Bench) -> None:
    driver = bench.homed()
    bench.board.heard = b""
    driver.move_to(100.0).wait()
    driver.move_to(101.0).wait()
    driver.move_to(60.0).wait()
    moves = [line for line in bench.board.heard.decode().split("\n") if "G1X" in line]
    zero = 2.0 - (1.0 - 200.0)
    targets = [float(move.replace("?", "").split("X")[1].split("F")[0]) + zero for move in moves]
    assert targets == pytest.approx([99.0, 100.0, 101.0, 59.0, 60.0])
    assert bench.board.angle_deg() == pytest.approx(60.0, abs=1e-9)


def test_ok_is_not_taken_for_the_end_of_a_movement(bench: _Bench) -> None:
    driver = bench.homed()
    begun = bench.clock.now()
    movement = driver.move_to(92.0)
    assert not movement.done
    movement.wait()
    expected = travel_time(89.0, 10.0, 5.0) + travel_time(1.0, 10.0, 5.0)
    assert bench.clock.now() - begun == pytest.approx(expected, abs=0.2)


@pytest.mark.parametrize("angle", [-1.0, -1e-9, 180.001, 360.0])
def test_an_angle_beyond_the_limits_is_refused_before_a_byte_is_written(bench: _Bench, angle: float) -> None:
    driver = bench.homed()
    bench.board.heard = b""
    with pytest.raises(
        InstrumentError, match=r"angle: .*° is not within 0° to 180°; choose one where it hits"
    ):
        driver.move_to(angle)
    driver.position_deg()
    assert bench.board.heard == b"?"


def test_the_run_up_does_not_leave_the_limits_either(bench: _Bench) -> None:
    driver = bench.homed()
    with pytest.raises(InstrumentError, match=r"angle: 0\.5° cannot be approached from 1° below: limit 0°"):
        driver.move_to(0.5)
    assert bench.board.angle_deg() == 2.0
    driver.move_to(1.0).wait()


def test_an_angle_means_nothing_before_homing(bench: _Bench) -> None:
    driver = bench.open()
    bench.board.heard = b""
    for act in (driver.position_deg, lambda: driver.move_to(90.0)):
        with pytest.raises(InstrumentError, match="angle: its zero is not known; home it first"):
            act()
    assert bench.board.heard == b""


def test_offsets_left_in_the_boards_memory_do_not_move_targets(bench: _Bench) -> None:
    driver = bench.homed()
    bench.board.heard = b""
    driver.move_to(90.0).wait()
    assert b"G21G90G94G53G1X" in bench.board.heard


def test_a_table_without_a_switch_is_put_at_its_zero_by_the_operator(bench: _Bench) -> None:
    drive = Drive(250.0, 10.0, 5.0, (0.0, 180.0), home_deg=30.0, has_switch=False)
    bench.replug(settings={22: 1})
    person = _Person()
    driver = bench.open(drive, operator=person)
    driver.home().wait()
    assert person.asked == ["Turn the arm to 30°, from lower angles."]
    assert b"$X\n" in bench.board.heard
    assert b"$H" not in bench.board.heard
    driver.move_to(100.0).wait()
    assert bench.board.angle_deg() == pytest.approx(100.0)


def test_a_table_with_neither_switch_nor_operator_is_refused(bench: _Bench) -> None:
    driver = bench.open(Drive(250.0, 10.0, 5.0, (0.0, 180.0), has_switch=False))
    with pytest.raises(InstrumentError, match="there is neither a switch nor an operator"):
        driver.home()


def test_another_board_than_asked_for_is_refused(bench: _Bench) -> None:
    bench.replug(remembers="TABLE-7")
    assert bench.open(serial_number="TABLE-7").identity.serial == "TABLE-7"
    bench.drivers.pop().close()
    with pytest.raises(InstrumentError, match=r"serial number: is `TABLE-7`, not `TABLE-8`; correct"):
        bench.open(serial_number="TABLE-8")


def test_other_firmware_is_refused(bench: _Bench) -> None:
    bench.replug(banner="Grbl 0.9j ['$' for help]")
    with pytest.raises(InstrumentError, match=r"firmware: is Grbl 0\.9j; install GRBL 1\.1"):
        bench.open()


def test_grblhal_is_taken_too(bench: _Bench) -> None:
    bench.replug(banner="GrblHAL 1.1f ['$' or '$HELP' for help]")
    assert bench.open().identity.model == "GrblHAL"


def test_a_second_program_is_refused(bench: _Bench) -> None:
    bench.open()
    with pytest.raises(InstrumentError, match="is in use by another program"):
        bench.open()


def test_every_byte_can_be_logged(bench: _Bench, tmp_path: Path) -> None:
    bench.open(log=tmp_path / "table.log")
    assert "Grbl 1.1h" in (tmp_path / "table.log").read_text()


def test_a_board_that_still_boots_is_reset_again(bench: _Bench) -> None:
    bench.faults.arm("silent-start", count=3)
    bench.open(reply_timeout_s=0.05)


def test_a_port_where_nobody_answers_is_refused(bench: _Bench) -> None:
    bench.faults.arm("silent-start", count=-1)
    with pytest.raises(InstrumentError, match="reset: was not answered; see that the board has power"):
        bench.open(reply_timeout_s=0.05)


def test_noise_at_opening_does_not_matter(bench: _Bench) -> None:
    bench.faults.arm("garbage")
    assert bench.open().identity.model == "Grbl"


@pytest.mark.parametrize("number", [*ERRORS, 79])
def test_every_refusal_is_told_in_words(bench: _Bench, number: int) -> None:
    driver = bench.homed()
    bench.faults.arm("error", value=number)
    words = ERRORS.get(number, "an error of its own").replace("$", r"\$")
    with pytest.raises(InstrumentError, match=rf"G1X.*: error:{number}: {words}; see"):
        driver.move_to(90.0)


@pytest.mark.parametrize("number", [*ALARMS, 17])
def test_an_alarm_in_mid_move_is_told_in_words_and_the_zero_is_lost(bench: _Bench, number: int) -> None:
    driver = bench.homed()
    bench.faults.arm("alarm", value=number)
    words = ALARMS.get(number, "an alarm of its own")
    with pytest.raises(
        InstrumentError, match=rf"alarm: ALARM:{number}: {words}; remove the cause, then home"
    ):
        driver.move_to(90.0).wait()
    with pytest.raises(InstrumentError, match="its zero is not known; home it first"):
        driver.position_deg()
    with pytest.raises(InstrumentError, match="its zero is not known; home it first"):
        driver.move_to(90.0)
    driver.home().wait()
    driver.move_to(90.0).wait()
    assert bench.board.angle_deg() == pytest.approx(90.0)


def test_soft_limits_of_the_board_are_told(bench: _Bench) -> None:
    bench.replug(settings={20: 1, 22: 1, 130: 60.0})
    driver = bench.homed()
    driver.move_to(50.0).wait()
    with pytest.raises(InstrumentError, match=r"ALARM:2: the target lies beyond its own soft limits"):
        driver.move_to(100.0)
    driver.home().wait()
    driver.move_to(50.0).wait()
    assert bench.board.angle_deg() == pytest.approx(50.0)


def test_a_reset_in_mid_move_is_noticed_and_the_zero_is_lost(bench: _Bench) -> None:
    driver = bench.homed()
    bench.faults.arm("reset")
    with pytest.raises(InstrumentError, match=r"reset: it was reset while it worked; .* then home it"):
        driver.move_to(90.0).wait()
    with pytest.raises(InstrumentError, match="its zero is not known; home it first"):
        driver.move_to(45.0)
    driver.home().wait()
    driver.move_to(90.0).wait()
    assert bench.board.angle_deg() == pytest.approx(90.0)


def test_a_reset_between_moves_is_noticed_by_the_next(bench: _Bench) -> None:
    driver = bench.homed()
    bench.faults.arm("reset")
    driver.move_to(90.0)
    bench.clock.sleep(100.0)
    with pytest.raises(InstrumentError, match="it was reset while it worked"):
        driver.move_to(45.0)
    with pytest.raises(InstrumentError, match="its zero is not known"):
        driver.move_to(45.0)


@pytest.mark.parametrize("number", [6, 7, 8, 9])
def test_homing_that_fails_is_told_and_can_be_tried_again(bench: _Bench, number: int) -> None:
    driver = bench.open()
    bench.faults.arm("homing-alarm", value=number)
    with pytest.raises(InstrumentError, match=rf"ALARM:{number}: {ALARMS[number]}"):
        driver.home().wait()
    driver.home().wait()
    assert driver.position_deg() == pytest.approx(2.0)


def test_a_board_that_refuses_to_home_is_told(bench: _Bench) -> None:
    driver = bench.open()
    bench.faults.arm("error", value=5)
    with pytest.raises(InstrumentError, match=r"\$H: error:5: it refuses to look for its zero"):
        driver.home().wait()


def test_a_hold_that_somebody_pressed_ends_in_an_error_and_keeps_the_zero(bench: _Bench) -> None:
    driver = bench.homed()
    bench.faults.arm("hold")
    with pytest.raises(InstrumentError, match=r"move to 90\.000°: has not ended in time; see"):
        driver.move_to(90.0).wait()
    driver.move_to(90.0).wait()
    assert bench.board.angle_deg() == pytest.approx(90.0)


def test_a_stop_forgets_the_movement_and_keeps_the_zero(bench: _Bench) -> None:
    driver = bench.homed()
    driver.move_to(90.0)
    bench.clock.sleep(3.0)
    driver.stop()
    here = driver.position_deg()
    assert 2.0 < here < 89.0
    assert bench.board.angle_deg() == pytest.approx(here, abs=1e-3)
    bench.clock.sleep(100.0)
    assert driver.position_deg() == here
    driver.move_to(90.0).wait()
    assert bench.board.angle_deg() == pytest.approx(90.0)


def test_a_stop_while_it_looks_for_its_zero_leaves_it_unknown(bench: _Bench) -> None:
    driver = bench.open()
    driver.home()
    driver.stop()
    with pytest.raises(InstrumentError, match="its zero is not known"):
        driver.position_deg()
    driver.home().wait()


def test_a_lost_answer_is_told_with_its_line(bench: _Bench) -> None:
    driver = bench.homed(reply_timeout_s=0.1)
    bench.faults.arm("lost-ok")
    with pytest.raises(InstrumentError, match=r"G1X.*: was not answered; see to the board's power"):
        driver.move_to(90.0)


def test_a_dead_board_is_told(bench: _Bench) -> None:
    driver = bench.homed(reply_timeout_s=0.1)
    bench.faults.arm("dead", after=1)
    with pytest.raises(InstrumentError, match="was not answered"):
        driver.move_to(90.0).wait()
    with pytest.raises(InstrumentError, match=r"\?: was not answered"):
        driver.position_deg()


def test_an_unplugged_board_is_an_error_and_can_be_opened_under_its_new_port(bench: _Bench) -> None:
    driver = bench.homed()
    bench.server.unplug()
    with pytest.raises(InstrumentError, match=r"port: has gone .*; see to its cable"):
        driver.move_to(90.0)
    driver.close()
    bench.server.plug_in()
    again = bench.homed()
    again.move_to(90.0).wait()
    assert bench.board.angle_deg() == pytest.approx(90.0)
