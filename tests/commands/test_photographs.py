"""Commands on photographs and the rig, on the default config."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pbrdf.capture.arrays import write_capture
from pbrdf.cli import main


@pytest.fixture(autouse=True)
def in_the_project(pytestconfig: pytest.Config, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(pytestconfig.rootpath)


def test_a_preview_tells_frames_hours_and_room_and_takes_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["capture", "gold", "plastic", "--preview", "--captures", str(tmp_path)]) == 0
    gold, plastic = capsys.readouterr().out.splitlines()
    assert gold.startswith("gold: 11144 frames, about ")
    assert plastic.removeprefix("plastic") == gold.removeprefix("gold")
    assert not list(tmp_path.iterdir())


def test_a_light_that_was_never_taken_is_not_taken_anew(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["capture", "gold", "--retake", "041.00", "--captures", str(tmp_path)]) == 2
    assert "lights/041.00: light: does not exist" in capsys.readouterr().err.splitlines()[-1]
    assert not list(tmp_path.iterdir())


def test_a_check_moves_every_instrument_and_shows_a_frame(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["rig", "check", "--exposure-ms", "8"]) == 0
    told = capsys.readouterr().out
    for word in ("generator retarder", "analyser retarder", "filter wheel", "arm", "camera", "focus measure"):
        assert f"\n{word}" in f"\n{told}"


def test_status_tells_what_is_whole_and_what_is_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for angle_deg in (8.0, 41.0):
        manifest = write_capture(
            tmp_path / "jade",
            material="jade",
            angle_deg=angle_deg,
            frames={550: np.ones((2, 2, 4, 4), np.uint16)},
            states_deg=[(0.0, 0.0, 0.0, 90.0), (0.0, 25.0, 5.0, 90.0)],
            exposures_s=(0.01, 0.04),
        )
    journal = manifest.with_name("journal.jsonl")
    journal.write_text("".join(journal.read_text(encoding="utf-8").splitlines(True)[:3]), encoding="utf-8")
    manifest.unlink()
    assert main(["status", str(tmp_path / "jade")]) == 0
    first, second = capsys.readouterr().out.splitlines()
    assert first.endswith("jade: 1 of 2 lights begun are whole")
    assert second.strip() == "041.00: 3 of 4 frames (75 %)"


@pytest.mark.parametrize("harm", ["gone", "changed"])
def test_a_frame_of_a_whole_light_that_is_not_what_was_taken_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], harm: str
) -> None:
    write_capture(
        tmp_path / "jade",
        material="jade",
        angle_deg=41.0,
        frames={550: np.ones((2, 2, 4, 4), np.uint16)},
        states_deg=[(0.0, 0.0, 0.0, 90.0), (0.0, 25.0, 5.0, 90.0)],
        exposures_s=(0.01, 0.04),
    )
    assert main(["status", "--verify", str(tmp_path / "jade")]) == 0
    assert capsys.readouterr().out.splitlines()[1].strip() == "every frame is what its journal says"
    frame = next(path for path in sorted((tmp_path / "jade").rglob("c.1.0.*")))
    if harm == "gone":
        frame.unlink()
    else:
        content = bytearray(frame.read_bytes())
        content[-6] ^= 1
        frame.write_bytes(content)
    assert main(["status", "--verify", str(tmp_path / "jade")]) == 2
    told = capsys.readouterr().err.splitlines()[-1]
    assert "lights/041.00: 1 of its frames are gone or changed" in told
    assert "--retake 041.00" in told


def test_status_of_nothing_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["status", str(tmp_path)]) == 2
    assert "there are none" in capsys.readouterr().err
