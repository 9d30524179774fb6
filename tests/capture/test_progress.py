from __future__ import annotations

import io

import pytest

from pbrdf.capture.progress import Progress


class Clock:
    """A clock that moves when it is told to."""

    now = 1000.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr("pbrdf.capture.progress.time", clock)
    return clock


def _lines(clock: Clock, total: int, seconds_a_step: float, steps: int, skipped: int = 0) -> list[str]:
    stream = io.StringIO()
    progress = Progress("capture of gold", total, stream=stream)
    for _ in range(skipped):
        progress.skip()
    for _ in range(steps):
        clock.now += seconds_a_step
        progress.step()
    return stream.getvalue().splitlines()


@pytest.mark.parametrize(
    ("seconds_a_step", "left"),
    [
        (5.0, "45 s left"),
        (10.0, "1 min 30 s left"),
        (60.0, "9 min 0 s left"),
        (400.0, "1 h 0 min left"),
        (3600.0, "9 h 0 min left"),
    ],
)
def test_time_left_has_its_unit(clock: Clock, seconds_a_step: float, left: str) -> None:
    (line,) = _lines(clock, total=10, seconds_a_step=seconds_a_step, steps=1)
    assert line.startswith("capture of gold: 1 of 10 frames (10 %), ")
    assert line.endswith(left)


def test_a_line_comes_every_five_seconds_and_at_the_end(clock: Clock) -> None:
    lines = _lines(clock, total=12, seconds_a_step=1.0, steps=12)
    assert [line.split(" (")[0] for line in lines] == [
        "capture of gold: 5 of 12 frames",
        "capture of gold: 10 of 12 frames",
        "capture of gold: 12 of 12 frames",
    ]
    assert lines[0].endswith("1.0 frames/s, 7 s left")
    assert lines[-1].endswith("0 s left")


def test_short_work_says_nothing(clock: Clock) -> None:
    assert _lines(clock, total=3, seconds_a_step=0.1, steps=3) == []


def test_what_was_there_before_says_nothing_of_the_time_left(clock: Clock) -> None:
    """Ninety frames of an earlier run take no time; the ten that are missing take 5 s each."""
    (line,) = _lines(clock, total=100, seconds_a_step=5.0, steps=1, skipped=90)
    assert line == "capture of gold: 91 of 100 frames (91 %), 0.2 frames/s, 45 s left"
