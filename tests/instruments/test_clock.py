from __future__ import annotations

import threading
import time

import pytest

from pbrdf.instruments.clock import WallClock
from pbrdf.instruments.emulators.clock import VirtualClock


def test_virtual_time_passes_by_sleep_alone_and_costs_none() -> None:
    clock, begun = VirtualClock(), time.monotonic()
    clock.sleep(3600.0)
    assert clock.now() == 3600.0
    assert time.monotonic() - begun < 0.5


def test_virtual_time_never_goes_back() -> None:
    clock = VirtualClock()
    clock.sleep(1.0)
    clock.sleep(-5.0)
    assert clock.now() == 1.0


def test_virtual_sleeps_of_several_threads_add_up() -> None:
    clock = VirtualClock()
    threads = [threading.Thread(target=lambda: [clock.sleep(0.25) for _ in range(1000)]) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert clock.now() == 1000.0


def test_the_wall_clock_waits() -> None:
    clock = WallClock()
    before = clock.now()
    clock.sleep(0.02)
    clock.sleep(-1.0)
    assert clock.now() - before == pytest.approx(0.02, abs=0.5)
    assert clock.now() - before >= 0.02
