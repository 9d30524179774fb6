"""What a plan will cost, counted by hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from pbrdf.capture import preview as module
from pbrdf.capture.preview import preview
from pbrdf.instruments.interface import FrameFormat
from pbrdf.settings.plan import CapturePlan, Light, Metering, brightest_states

FORM = FrameFormat(100, 200, "uint16", 14, 2, 65532.0)
STATES = ((0.0, 0.0, 0.0, 90.0), (0.0, 350.0, 5.0, 90.0))
PLAN = CapturePlan((Light("008.00", 8.0), Light("018.00", 18.0)), (450, 550, 650), STATES, (0.01, 0.24), 2)


def test_frames_hours_and_room_are_counted(tmp_path: Path) -> None:
    told = preview(PLAN, FORM, tmp_path / "not there yet")
    assert told.frames == 2 * (3 * 2 + 2) * 2
    exposures = 0.01 + 0.24 + 2 * module.FRAME_S
    # ten degrees, the shorter way, at 10 °/s and 10 °/s²: one second up, one down
    band = module.WHEEL_S + 2.0 + 2 * exposures
    arm = 10.0 / 10.0 + 10.0 / 20.0
    assert told.hours == pytest.approx((2 * (3 * band + 2 * exposures) + arm) / 3600.0)
    assert told.gigabytes == pytest.approx(0.6 * told.frames * 40_000 / 1e9)


def test_hours_of_metered_exposures_are_at_most(tmp_path: Path) -> None:
    metered = replace(PLAN, metering=Metering(0.001, 0.8))
    fixed, told = preview(PLAN, FORM, tmp_path), preview(metered, FORM, tmp_path)
    assert told.frames == fixed.frames
    # one of the two states shows all known elements brightest, so that nothing turns
    states = len(brightest_states(STATES))
    more = 2 * 3 * (module.WHEEL_S + 2.0 * (states - 1) + states * (module.FRAME_S + 0.01))
    assert told.hours == pytest.approx(fixed.hours + more / 3600.0)
    assert " about " in str(fixed)
    assert " at most " in str(told)
    assert str(told).endswith(", exposures metered")


def test_too_little_room_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module.shutil, "disk_usage", lambda path: SimpleNamespace(free=10**5))
    line = str(preview(PLAN, FORM, tmp_path))
    assert line.startswith("32 frames, about ")
    assert line.endswith("free: too little")
