"""The driver of the rotary stage arrives where it should, by the shorter way and from below."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pbrdf.errors import InstrumentError
from pbrdf.instruments.apt_messages import TURN, Id, microsteps
from pbrdf.instruments.emulators.clock import VirtualClock
from pbrdf.instruments.emulators.server import PtyServer, SocketServer
from pbrdf.instruments.k10cr1 import K10CR1, nearest_turn, within_counter
from pbrdf.instruments.kinds import Identity
from pbrdf.instruments.movement import travel_time

Bench = Any
"""`StageBench` of the folder's fixtures, which cannot be imported."""

NAME = "generator retarder"


@pytest.fixture
def bench(new_stage_bench: Bench) -> Bench:
    return new_stage_bench()


def test_it_says_what_and_where_it_is(bench: Bench) -> None:
    with PtyServer(bench) as server, bench.open(server.url, serial_number="55000488") as driver:
        assert driver.name == f"{NAME} at {server.url}"
        assert driver.identity == Identity("K10CR1", "55000488", "2.0.3")


def test_opening_moves_nothing_and_gives_all_parameters(bench: Bench) -> None:
    with bench.opened():
        golden = (
            "18 00 00 00 50 01  12 00 00 00 50 01  05 00 00 00 50 01  80 04 01 00 50 01"
            "10 02 01 01 50 01  11 02 01 00 50 01"
            "13 04 0e 00 d0 01 01 00 00 00 00 00 ac 3a 00 00 27 7b 5e 04  14 04 01 00 50 01"
            "40 04 0e 00 d0 01 01 00 02 00 01 00 27 7b 5e 04 55 55 08 00  41 04 01 00 50 01"
            "3a 04 06 00 d0 01 01 00 55 15 02 00  3b 04 01 00 50 01"
        )
        assert bytes(bench.written) == bytes.fromhex(golden)
        bench.clock.sleep(100.0)
        assert bench.stage.angle_deg() == pytest.approx(37.0, abs=1e-5)


def test_home_and_move_over_a_socket(bench: Bench) -> None:
    with SocketServer(bench) as server, bench.open(server.url, reply_timeout_s=1.0) as driver:
        driver.home().wait()
        driver.move_to(22.5).wait()
        assert driver.position_deg() == pytest.approx(22.5, abs=1e-4)


def test_it_arrives_in_the_time_that_the_distance_takes(bench: Bench) -> None:
    with bench.homed() as driver:
        begin = bench.clock.now()
        driver.move_to(90.0).wait()
        assert bench.clock.now() - begin == pytest.approx(travel_time(90.0, 10.0, 10.0), abs=0.15)
        assert bench.stage.angle_deg() == pytest.approx(90.0, abs=1e-4)


def test_a_movement_can_be_looked_at_while_it_lasts(bench: Bench) -> None:
    with bench.homed() as driver:
        movement = driver.move_to(90.0)
        assert not movement.done
        bench.clock.sleep(5.0)
        assert not movement.done
        assert 30.0 < driver.position_deg() < 60.0
        bench.clock.sleep(5.5)
        assert movement.done


def test_rates_are_those_asked_for(bench: Bench) -> None:
    with bench.homed(velocity_deg_s=5.0, acceleration_deg_s2=20.0) as driver:
        begin = bench.clock.now()
        driver.move_to(90.0).wait()
        assert bench.clock.now() - begin == pytest.approx(travel_time(90.0, 5.0, 20.0), abs=0.15)


def test_it_always_arrives_from_lower_angles(bench: Bench) -> None:
    with bench.homed() as driver:
        for target in (50.0, 20.0, 19.0, 350.0, 340.0):
            movement = driver.move_to(target)
            before = math.nan
            while not movement.done:
                before = bench.stage.angle_deg()
                bench.clock.sleep(0.01)
            assert -1.0 < (before - target + 180.0) % 360.0 - 180.0 < 1e-3


@pytest.mark.parametrize(
    ("asked", "way"),
    [([350.0], -10.0), ([170.0], 170.0), ([190.0], -170.0), ([120.0, 240.0, 0.0], 360.0), ([720.0], 0.0)],
)
def test_the_shorter_way_is_taken(bench: Bench, asked: list[float], way: float) -> None:
    with bench.homed() as driver:
        for angle in asked:
            driver.move_to(angle).wait()
            assert driver.position_deg() == pytest.approx(angle, abs=1e-4)
        counter = bench.stage._status().position
        assert counter == pytest.approx(microsteps(way), abs=20)


@given(st.integers(-(2**31), 2**31 - 1), st.integers(-43 * TURN, 43 * TURN))
def test_the_nearest_turn_is_near_and_in_range(position: int, to: int) -> None:
    nearest = nearest_turn(position, to)
    assert (nearest - position) % TURN == 0
    assert abs(nearest - to) <= TURN // 2
    found = within_counter(nearest)
    assert (found - position) % TURN == 0
    assert abs(found) <= 43 * TURN
    assert found == nearest or abs(nearest) > 43 * TURN


def test_it_never_winds_up_beyond_its_counter(bench: Bench) -> None:
    with bench.homed() as driver:
        for step in range(140):
            driver.move_to(120.0 * step).wait()
            assert abs(bench.stage._status().position) <= 43 * TURN
            assert driver.position_deg() == pytest.approx(120.0 * step, abs=1e-4)


def test_the_same_angle_again_is_no_move(bench: Bench) -> None:
    with bench.homed() as driver:
        driver.move_to(30.0).wait()
        bench.written.clear()
        driver.move_to(30.0).wait()
        driver.move_to(390.0).wait()
        assert not bench.wrote(Id.MOVE_ABSOLUTE)
        driver.stop()
        driver.move_to(30.0).wait()
        assert bench.wrote(Id.MOVE_ABSOLUTE)


def test_it_ends_at_the_same_place_however_it_got_there(new_stage_bench: Bench) -> None:
    places = []
    for way in ([36.0, 72.0], [180.0, 300.0, 72.0], [250.0, 370.0, 432.0]):
        bench = new_stage_bench(seed=3, error_usteps=20.0)
        with bench.homed() as driver:
            for angle in way:
                driver.move_to(angle).wait()
            places.append(bench.stage.angle_deg())
    assert places[0] == places[1] == places[2]


def test_it_homes_only_if_it_must(bench: Bench) -> None:
    with PtyServer(bench) as server:
        with bench.open(server.url) as driver:
            assert not driver.homed
            driver.home().wait()
            assert driver.homed
            driver.move_to(20.0).wait()
        with bench.open(server.url) as driver:
            bench.written.clear()
            driver.home().wait()
            assert not bench.wrote(Id.MOVE_HOME)
            assert driver.position_deg() == pytest.approx(20.0, abs=1e-4)
            driver.home(again=True).wait()
            assert bench.wrote(Id.MOVE_HOME)
            assert driver.position_deg() == 0.0


def test_to_be_homed_from_before_is_not_to_be_homed_again(bench: Bench) -> None:
    with bench.homed() as driver:
        driver.move_to(20.0).wait()
        bench.faults.arm("home-ignored")
        driver.home(again=True).wait()
        assert bench.stage.angle_deg() == 0.0


def test_without_its_zero_it_does_not_move(bench: Bench) -> None:
    with bench.opened() as driver:
        bench.written.clear()
        with pytest.raises(InstrumentError, match="does not know its zero"):
            driver.move_to(10.0)
        assert not bench.wrote(Id.MOVE_ABSOLUTE)


@pytest.mark.parametrize("angle", [math.nan, math.inf, -math.inf])
def test_what_is_no_angle_is_refused_before_a_byte_is_written(bench: Bench, angle: float) -> None:
    with bench.homed() as driver:
        bench.written.clear()
        with pytest.raises(InstrumentError, match="angle"):
            driver.move_to(angle)
        assert not bench.written


@pytest.mark.parametrize(
    "rates", [{"velocity_deg_s": 10.1}, {"velocity_deg_s": 0.0}, {"acceleration_deg_s2": 20.5}]
)
def test_rates_beyond_the_stages_are_refused_before_it_is_opened(rates: dict[str, float]) -> None:
    with pytest.raises(InstrumentError, match="out of range"):
        K10CR1.open("/dev/none", NAME, VirtualClock(), **rates)


def test_stop_stops(bench: Bench) -> None:
    with bench.homed() as driver:
        movement = driver.move_to(90.0)
        bench.clock.sleep(3.0)
        driver.stop()
        with pytest.raises(InstrumentError, match=r"stands still at 2\d\.\d+°"):
            movement.wait()


def test_closing_twice_is_no_matter(bench: Bench) -> None:
    with PtyServer(bench) as server:
        driver = bench.open(server.url)
        driver.close()
        driver.close()


def test_a_port_has_one_owner(bench: Bench) -> None:
    with PtyServer(bench) as server, bench.open(server.url), pytest.raises(InstrumentError, match="in use"):
        bench.open(server.url)


def test_every_byte_can_be_logged(bench: Bench, tmp_path: Path) -> None:
    log = tmp_path / "stage.log"
    with bench.homed(log=str(log)) as driver:
        driver.move_to(90.0).wait()
    assert "53 04 06 00 D0 01 01 00  00 80 BB 00" in log.read_text()
