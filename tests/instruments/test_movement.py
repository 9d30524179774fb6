from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pbrdf.errors import InstrumentError
from pbrdf.instruments.emulators.clock import VirtualClock
from pbrdf.instruments.movement import POLL_S, SPARE_S, Movement, travel_time, travelled

LENGTHS = st.floats(1e-3, 1e3)
SPEEDS = st.floats(0.1, 50.0)


@pytest.mark.parametrize(
    ("distance", "seconds"), [(5.0, math.sqrt(2.0)), (22.5, 3.25), (36.0, 4.6), (90.0, 10.0), (360.0, 37.0)]
)
def test_travel_at_10_deg_s_and_10_deg_s2_takes_the_times_of_the_kinematics(
    distance: float, seconds: float
) -> None:
    assert travel_time(distance, 10.0, 10.0) == pytest.approx(seconds, rel=1e-12)
    assert travel_time(-distance, 10.0, 10.0) == travel_time(distance, 10.0, 10.0)


@given(LENGTHS, SPEEDS, SPEEDS)
def test_a_travel_begins_at_nothing_and_ends_at_its_distance(
    distance: float, speed: float, acceleration: float
) -> None:
    total = travel_time(distance, speed, acceleration)
    assert travelled(0.0, distance, speed, acceleration) == 0.0
    assert travelled(total, distance, speed, acceleration) == pytest.approx(distance, rel=1e-12)
    assert travelled(total + 1.0, -distance, speed, acceleration) == pytest.approx(-distance, rel=1e-12)
    assert travelled(0.5 * total, distance, speed, acceleration) == pytest.approx(0.5 * distance, rel=1e-9)


@given(LENGTHS, SPEEDS, SPEEDS)
def test_a_travel_exceeds_neither_its_speed_nor_its_acceleration(
    distance: float, speed: float, acceleration: float
) -> None:
    times = np.linspace(0.0, travel_time(distance, speed, acceleration), 201)
    way = np.array([travelled(t, distance, speed, acceleration) for t in times])
    speeds = np.diff(way) / np.diff(times)
    changes = np.diff(speeds) / np.diff(times)[1:]
    assert speeds.min() >= 0.0
    assert speeds.max() <= speed * (1.0 + 1e-6)
    assert np.abs(changes).max() <= acceleration * (1.0 + 1e-4)


class _Stage:
    def __init__(self, clock: VirtualClock, arrives_s: float) -> None:
        self.clock, self.arrives_s = clock, arrives_s
        self.asked = self.stopped = 0

    def arrived(self) -> bool:
        self.asked += 1
        return self.clock.now() >= self.arrives_s

    def stop(self) -> None:
        self.stopped += 1

    def movement(self, expected_s: float, longest_s: float | None = None) -> Movement:
        return Movement(
            self.clock, "stage at port", "move to 45.000°", expected_s, self.arrived, self.stop, longest_s
        )


def test_a_movement_is_asked_for_when_it_should_have_ended_and_not_before() -> None:
    clock = VirtualClock()
    stage = _Stage(clock, 10.0)
    stage.movement(10.0).wait()
    assert (stage.asked, clock.now()) == (1, 10.0)


def test_a_late_movement_is_polled_until_it_ends() -> None:
    clock = VirtualClock()
    stage = _Stage(clock, 12.0)
    stage.movement(10.0).wait()
    assert clock.now() == pytest.approx(12.0, abs=POLL_S)
    assert stage.stopped == 0


def test_an_ended_movement_is_not_asked_again() -> None:
    stage = _Stage(VirtualClock(), 0.0)
    movement = stage.movement(0.0)
    assert movement.done
    movement.wait()
    assert stage.asked == 1


@pytest.mark.parametrize(("longest_s", "deadline"), [(None, 20.0 + SPARE_S), (30.0, 30.0)])
def test_a_stuck_movement_is_stopped_and_refused(longest_s: float | None, deadline: float) -> None:
    clock = VirtualClock()
    stage = _Stage(clock, math.inf)
    with pytest.raises(InstrumentError, match=r"stage at port: move to 45\.000°: has not ended in time; see"):
        stage.movement(10.0, longest_s).wait()
    assert stage.stopped == 1
    assert clock.now() == pytest.approx(deadline, abs=2 * POLL_S)
