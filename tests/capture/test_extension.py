"""A plan that adds to a light, against the same plan carried out at once."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from capture_content import capture_content

from pbrdf.capture import extension
from pbrdf.capture.run import capture
from pbrdf.errors import InputError
from pbrdf.instruments.interface import FrameFormat, Setting, Taken
from pbrdf.settings.plan import CapturePlan, Light

STATES = tuple((0.0, 25.0 * n, 5.0 * n, 90.0) for n in range(3))
SMALL = CapturePlan(
    (Light("008.00", 8.0),), (550,), STATES, (0.02,), darks=2, references=(1, 3), reference_state=2
)
MORE = [{"bands_nm": (450, 550)}, {"exposures_s": (0.005, 0.02)}, {"exposures_s": (0.02, 0.08)}]
MORE += [{"bands_nm": (450, 550, 650), "exposures_s": (0.005, 0.02, 0.08)}]


@dataclass
class TellingRig:
    """Frames tell what was asked for, so that a frame in a wrong place shows."""

    identity: str = "telling"
    frame_format: FrameFormat = field(default_factory=lambda: FrameFormat(4, 5, "uint16", 14, 2, 65532.0))
    asked: list[str] = field(default_factory=list)

    def expose(self, frame_id: str, setting: Setting) -> Taken:
        self.asked.append(frame_id)
        return self._frame(setting.band_nm, int(setting.state_deg[1]), setting.position, setting.exposure_s)

    def expose_dark(self, frame_id: str, exposure_s: float) -> Taken:
        self.asked.append(frame_id)
        return self._frame(0, int(frame_id[-1]), 0, exposure_s)

    def _frame(self, band_nm: int, state: int, position: int, exposure_s: float) -> Taken:
        told = [band_nm, state, position, round(1e6 * exposure_s) % 65521]
        return Taken(np.resize(told, (4, 5)).astype(np.uint16), {})


@pytest.mark.parametrize("more", MORE)
def test_what_a_plan_adds_is_taken_and_the_rest_stays(tmp_path: Path, more: dict[str, Any]) -> None:
    plan = replace(SMALL, **more)
    capture(SMALL, "gold", TellingRig(), tmp_path / "grown")
    rig = TellingRig()
    capture(plan, "gold", rig, tmp_path / "grown")
    assert len(rig.asked) == plan.frames_per_light() - SMALL.frames_per_light()
    capture(plan, "gold", TellingRig(), tmp_path / "at once")
    assert capture_content(tmp_path / "grown") == capture_content(tmp_path / "at once")


def test_what_the_journal_told_of_a_frame_goes_with_it(tmp_path: Path) -> None:
    capture(SMALL, "gold", TellingRig(), tmp_path)
    journal = tmp_path / "lights/008.00/journal.jsonl"
    before = json.loads(journal.read_text(encoding="utf-8").splitlines()[0])
    capture(replace(SMALL, exposures_s=(0.005, 0.02)), "gold", TellingRig(), tmp_path)
    after = json.loads(journal.read_text(encoding="utf-8").splitlines()[0])
    assert (before["frame"], after["frame"]) == ("550nm/s00/e0", "550nm/s00/e1")
    assert before | {"frame": ""} == after | {"frame": ""}


def test_a_plan_that_adds_and_takes_away_is_refused(tmp_path: Path) -> None:
    capture(SMALL, "gold", TellingRig(), tmp_path)
    before = capture_content(tmp_path)
    with pytest.raises(InputError, match="exposures_s"):
        capture(replace(SMALL, bands_nm=(450, 550), exposures_s=(0.04,)), "gold", TellingRig(), tmp_path)
    assert capture_content(tmp_path) == before


def test_an_extension_that_is_killed_leaves_the_light_as_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    capture(SMALL, "gold", TellingRig(), tmp_path)
    before = capture_content(tmp_path)
    with monkeypatch.context() as patch:
        patch.setattr(extension, "_link", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            capture(replace(SMALL, **MORE[0]), "gold", TellingRig(), tmp_path)
    assert capture_content(tmp_path) == before


def test_a_folder_that_a_killed_process_moved_aside_comes_back(tmp_path: Path) -> None:
    capture(SMALL, "gold", TellingRig(), tmp_path)
    before = capture_content(tmp_path)
    light = tmp_path / "lights/008.00"
    light.rename(light.with_name(".008.00.4711.old"))
    rig = TellingRig()
    capture(SMALL, "gold", rig, tmp_path)
    assert rig.asked == []
    assert capture_content(tmp_path) == before


def test_what_a_killed_process_was_writing_goes(tmp_path: Path) -> None:
    capture(SMALL, "gold", TellingRig(), tmp_path)
    before = capture_content(tmp_path)
    lights = tmp_path / "lights"
    for left in (".008.00.4711.part", ".008.00.4711.old", "008.00/.frames.zarr.4711.part"):
        (lights / left).mkdir()
        (lights / left / "zarr.json").write_text("{}", encoding="utf-8")
    (lights / "008.00/.manifest.json.x7.part").write_text("{", encoding="utf-8")
    capture(SMALL, "gold", TellingRig(), tmp_path)
    assert capture_content(tmp_path) == before
