"""The emulated GRBL board is taken for a real one by pygrbl-streamer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from pbrdf.instruments.emulators.clock import ScaledClock
from pbrdf.instruments.emulators.faults import Faults
from pbrdf.instruments.emulators.grbl import EmulatedGrbl
from pbrdf.instruments.emulators.server import PtyServer


def test_pygrbl_streamer_homes_turns_and_resets_the_table(session: Callable[..., dict[str, Any]]) -> None:
    board = EmulatedGrbl(ScaledClock(50.0), Faults(), settings={22: 1}, start_deg=40.0, switch_deg=2.0)
    with PtyServer(board) as server:
        said = session("session_grbl.py", server.url)
    assert said["connected"]
    assert said["state"] == ["IDLE", "IDLE"]
    assert said["homed"]
    assert said["settings"] == [True, True]
    assert said["streamed"]
    assert said["place"].startswith("<Idle|MPos:-79.000,0.000,0.000|FS:0,0")
    assert not said["refused"]
    assert said["errors"] == ["error:20"]
    assert said["many"]
    assert said["reset"]
    assert said["alarms"] == []
    assert board.angle_deg() == pytest.approx(2.0 + 199 % 7)
