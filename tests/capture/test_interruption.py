"""Captures that end before their time."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pbrdf.capture.interruption import Interrupted, interruptible, sole_owner
from pbrdf.capture.run import capture
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FrameStore
from pbrdf.instruments.interface import FrameFormat, Setting, Taken
from pbrdf.settings.plan import CapturePlan, Light

PLAN = CapturePlan((Light("008.00", 8.0),), (450,), ((0.0, 0.0, 0.0, 90.0),) * 4, (0.01, 0.04), darks=1)


@dataclass
class SignalledRig:
    """Gets a signal while it takes one of its frames."""

    when: int = -1
    signals: tuple[signal.Signals, ...] = (signal.SIGINT,)
    identity: str = "signalled"
    frame_format: FrameFormat = field(default_factory=lambda: FrameFormat(8, 8, "uint16", 14, 2, 65532.0))
    asked: list[str] = field(default_factory=list)

    def expose(self, frame_id: str, setting: Setting) -> Taken:
        return self._frame(frame_id)

    def expose_dark(self, frame_id: str, exposure_s: float) -> Taken:
        return self._frame(frame_id)

    def _frame(self, frame_id: str) -> Taken:
        if len(self.asked) == self.when:
            for one in self.signals:
                signal.raise_signal(one)
        self.asked.append(frame_id)
        return Taken(np.full((8, 8), len(self.asked), np.uint16), {})


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_run_after_the_frame_in_hand(tmp_path: Path, number: signal.Signals) -> None:
    before = signal.getsignal(number)
    with pytest.raises(Interrupted, match="3 of 10 frames are taken; run it again: it resumes"):
        capture(PLAN, "gold", SignalledRig(when=2, signals=(number,)), tmp_path)
    assert signal.getsignal(number) is before
    rig = SignalledRig()
    capture(PLAN, "gold", rig, tmp_path)
    assert len(rig.asked) == 7


def test_a_second_signal_drops_the_frame(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        capture(PLAN, "gold", SignalledRig(when=2, signals=(signal.SIGINT,) * 2), tmp_path)
    rig = SignalledRig()
    capture(PLAN, "gold", rig, tmp_path)
    assert len(rig.asked) == 8


def test_nobody_asks_in_another_thread() -> None:
    with interruptible() as ended:
        assert not ended()
        signal.raise_signal(signal.SIGINT)
        assert ended()


OWNER = """
import sys, time
from pathlib import Path
from pbrdf.capture.interruption import sole_owner
with sole_owner(Path(sys.argv[1])):
    print("mine", flush=True)
    time.sleep(60)
"""


def test_a_folder_has_one_capture_until_that_is_killed(tmp_path: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", OWNER, str(tmp_path)], stdout=subprocess.PIPE) as owner:
        assert owner.stdout is not None
        assert owner.stdout.readline() == b"mine\n"
        with pytest.raises(InputError, match="another capture is at work there"):
            capture(PLAN, "gold", SignalledRig(), tmp_path)
        owner.kill()
    with sole_owner(tmp_path):
        assert list(tmp_path.iterdir()) == []


def test_a_damaged_frame_of_a_light_that_is_not_whole_is_taken_again(tmp_path: Path) -> None:
    with pytest.raises(Interrupted):
        capture(PLAN, "gold", SignalledRig(when=4), tmp_path)
    store = FrameStore.open(tmp_path / "lights/008.00/frames.zarr", writable=True)
    store.write_frame(450, 1, 0, np.full((8, 8), 7, np.uint16))
    store.file_at("450nm", (0, 1)).write_bytes(b"torn")
    rig = SignalledRig()
    capture(PLAN, "gold", rig, tmp_path)
    assert sorted(rig.asked)[:2] == ["008.00/450nm/s00/e1", "008.00/450nm/s01/e0"]
    assert len(rig.asked) == 10 - 5 + 2


@pytest.mark.parametrize("fails_at", [5, 6], ids=["frame", "journal"])
def test_a_full_disk_is_said_in_words_and_loses_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fails_at: int
) -> None:
    calls = 0

    def full(descriptor: int) -> None:
        nonlocal calls
        calls += 1
        if calls == fails_at:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(InputError, match="disk: is full; make room and run again: it resumes"):
            capture(PLAN, "gold", SignalledRig(), tmp_path)
    rig: Any = SignalledRig()
    capture(PLAN, "gold", rig, tmp_path)
    assert len(rig.asked) == (7 if fails_at == 6 else 8)
