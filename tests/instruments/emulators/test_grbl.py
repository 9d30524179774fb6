from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from pbrdf.instruments.emulators.clock import VirtualClock
from pbrdf.instruments.emulators.faults import Faults
from pbrdf.instruments.emulators.grbl import UNLOCK, EmulatedGrbl
from pbrdf.instruments.movement import travel_time


def _board(**options: Any) -> tuple[EmulatedGrbl, VirtualClock]:
    clock = VirtualClock()
    settings = {110: 600.0, 120: 5.0} | options.pop("settings", {})
    return EmulatedGrbl(clock, Faults(), settings=settings, **options), clock


def test_a_reset_is_followed_by_the_banner() -> None:
    board, _ = _board()
    assert board.receive(b"\x18") == b"\r\nGrbl 1.1h ['$' for help]\r\n"


def test_a_board_with_homing_wakes_locked() -> None:
    board, _ = _board(settings={22: 1})
    assert board.receive(b"\x18").endswith(UNLOCK.encode() + b"\r\n")
    assert board.receive(b"?").startswith(b"<Alarm|MPos:0.000,0.000,0.000|FS:0,0")
    assert board.receive(b"G0X1\n") == b"error:9\r\n"
    assert board.receive(b"$X\n") == b"[MSG:Caution: Unlocked]\r\nok\r\n"
    assert board.receive(b"?").startswith(b"<Idle|")


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        (b"\n", b"ok\r\n"),
        (b"G21 G90 (metric)\n", b"ok\r\n"),
        (b"g1 x10 f600 ; comment\n", b"ok\r\n"),
        (b"G1X10\n", b"error:22\r\n"),
        (b"10\n", b"error:1\r\n"),
        (b"GX\n", b"error:2\r\n"),
        (b"G77\n", b"error:20\r\n"),
        (b"M77\n", b"error:20\r\n"),
        (b"G0G1X1F1\n", b"error:21\r\n"),
        (b"G0X1X2\n", b"error:25\r\n"),
        (b"G4\n", b"error:28\r\n"),
        (b"G0X1I2\n", b"error:36\r\n"),
        (b"$H\n", b"error:5\r\n"),
        (b"$nonsense\n", b"error:3\r\n"),
        (b"$999=1\n", b"error:3\r\n"),
        (b"$100=x\n", b"error:2\r\n"),
        (b"$100=-1\n", b"error:4\r\n"),
        (b"$20=1\n", b"error:10\r\n"),
        (b"$100=68.267\n", b"ok\r\n"),
    ],
)
def test_lines_are_answered_as_by_the_firmware(line: bytes, answer: bytes) -> None:
    board, _ = _board()
    assert board.receive(line) == answer


def test_settings_are_printed_as_by_the_firmware() -> None:
    board, _ = _board()
    board.receive(b"$100=68.2667\n")
    said = board.receive(b"$$\n").decode().split("\r\n")
    assert {"$0=10", "$11=0.010", "$100=68.267", "$110=600.000", "$120=5.000", "ok"} <= set(said)


def test_settings_are_not_written_while_it_moves() -> None:
    board, _ = _board()
    board.receive(b"G0X100\n")
    assert board.receive(b"$100=1\n") == b"error:8\r\n"


def test_ok_comes_before_the_movement_has_ended() -> None:
    board, clock = _board()
    assert board.receive(b"G1X90F600\n") == b"ok\r\n"
    assert board.receive(b"?").startswith(b"<Run|MPos:0.000,")
    clock.sleep(0.5 * travel_time(90.0, 10.0, 5.0))
    assert board.receive(b"?").startswith(b"<Run|MPos:45.000,0.000,0.000|FS:600,0")
    clock.sleep(0.5 * travel_time(90.0, 10.0, 5.0))
    assert board.receive(b"?").startswith(b"<Idle|MPos:90.000,0.000,0.000|FS:0,0")


def test_blocks_follow_each_other() -> None:
    board, clock = _board()
    board.receive(b"G1X20F600\nG1X5\nG91X1\n")
    clock.sleep(travel_time(20.0, 10.0, 5.0))
    assert b"MPos:20.000" in board.receive(b"?")
    clock.sleep(travel_time(15.0, 10.0, 5.0))
    assert b"MPos:5.000" in board.receive(b"?")
    clock.sleep(travel_time(1.0, 10.0, 5.0))
    assert board.receive(b"?").startswith(b"<Idle|MPos:6.000")


def test_a_dwell_is_answered_when_all_has_ended() -> None:
    board, clock = _board()
    board.receive(b"G1X20F600\n")
    assert board.receive(b"G4P0.5\nG0X0\n") == b""
    clock.sleep(travel_time(20.0, 10.0, 5.0) + 0.5)
    assert board.due() == b"ok\r\nok\r\n"


def test_inches_are_understood() -> None:
    board, clock = _board()
    board.receive(b"G20G0X1\n")
    clock.sleep(100.0)
    assert b"MPos:25.400" in board.receive(b"?")


def test_a_hold_slows_down_and_a_start_goes_on() -> None:
    board, clock = _board()
    board.receive(b"G1X90F600\n")
    clock.sleep(4.0)
    board.receive(b"!")
    assert board.receive(b"?").startswith(b"<Hold:1|")
    clock.sleep(2.0)
    assert board.receive(b"?").startswith(b"<Hold:0|MPos:40.000")
    board.receive(b"~")
    clock.sleep(100.0)
    assert board.receive(b"?").startswith(b"<Idle|MPos:90.000")


def test_a_reset_in_motion_is_an_alarm_and_after_a_hold_is_none() -> None:
    board, clock = _board()
    board.receive(b"G1X90F600\n")
    clock.sleep(4.0)
    assert board.receive(b"\x18").startswith(b"ALARM:3\r\n")
    board.receive(b"$X\nG1X90F600\n")
    clock.sleep(1.0)
    board.receive(b"!")
    clock.sleep(10.0)
    assert b"ALARM" not in board.receive(b"\x18")


def test_homing_is_silent_until_it_has_ended() -> None:
    board, clock = _board(settings={22: 1}, start_deg=40.0, switch_deg=1.5)
    assert board.receive(b"$H\n") == b""
    assert board.receive(b"???") == b""
    clock.sleep(100.0)
    said = board.due()
    assert said.startswith(b"ok\r\n<Idle|MPos:-199.000,")
    assert said.count(b"<") == 1
    assert board.angle_deg() == 1.5


def test_soft_limits_are_kept() -> None:
    board, clock = _board(settings={22: 1, 20: 1})
    board.receive(b"$H\n")
    clock.sleep(100.0)
    board.due()
    assert board.receive(b"G0X5\n").startswith(b"ALARM:2\r\n")
    assert board.receive(b"?G0X-5\n") == b""
    assert b"Grbl" in board.receive(b"\x18")


def test_the_arm_stands_elsewhere_where_it_came_from_above() -> None:
    board, clock = _board(play_deg=0.25)
    board.receive(b"G0X50\n")
    clock.sleep(100.0)
    assert board.angle_deg() == 50.0
    board.receive(b"G0X20\n")
    clock.sleep(100.0)
    assert board.angle_deg() == 20.25


def test_the_error_of_a_place_depends_on_seed_and_target_alone() -> None:
    targets = [float(t) for t in np.random.default_rng(1).permutation(300)]
    found: dict[int, list[float]] = {}
    for seed, order in ((1, targets), (2, targets), (1, targets[::-1])):
        board, clock = _board(error_deg=0.01, seed=seed)
        errors = {}
        for target in order:
            board.receive(f"G0X{target}\n".encode())
            clock.sleep(1000.0)
            errors[target] = board.angle_deg() - target
        found.setdefault(seed, [errors[t] for t in targets])
        assert found[seed] == [errors[t] for t in targets]
    assert found[1] != found[2]
    assert np.std(found[1]) == pytest.approx(0.01, rel=0.15)


def test_lines_may_come_in_pieces() -> None:
    board, _ = _board()
    assert b"".join(board.receive(bytes([one])) for one in b"G1 X10 F600\r\n") == b"ok\r\nok\r\n"
