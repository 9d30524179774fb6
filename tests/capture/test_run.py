from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from capture_content import capture_content
from numpy.typing import NDArray

from pbrdf.capture.frames import read_manifest
from pbrdf.capture.journal import checksum
from pbrdf.capture.progress import Progress
from pbrdf.capture.run import capture
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FrameStore
from pbrdf.instruments.interface import FrameFormat, Setting, Taken
from pbrdf.settings.plan import CapturePlan, Light

STATES = tuple((0.0, 25.0 * n, 5.0 * n, 90.0) for n in range(3))
PLAN = CapturePlan((Light("008.00", 8.0), Light("041.00", 41.0)), (450, 650), STATES, (0.005, 0.08), darks=2)
FRAMES = 2 * (2 * 3 + 2) * 2
REPEATING = replace(PLAN, references=(1, 3), reference_state=2)


class Interruption(Exception):
    """What stands for a pulled plug."""


@dataclass
class FakeRig:
    """Frames are a function of their name alone; it may stop before one of them."""

    stops_before: int = FRAMES
    identity: str = "fake 1"
    frame_format: FrameFormat = field(default_factory=lambda: FrameFormat(4, 5, "uint16", 14, 2, 65532.0))
    asked: list[str] = field(default_factory=list)
    settings: list[Setting] = field(default_factory=list)
    dark_exposures: list[float] = field(default_factory=list)

    def expose(self, frame_id: str, setting: Setting) -> Taken:
        self.settings.append(setting)
        return self._frame(frame_id)

    def expose_dark(self, frame_id: str, exposure_s: float) -> Taken:
        self.dark_exposures.append(exposure_s)
        return self._frame(frame_id)

    def _frame(self, frame_id: str) -> Taken:
        if len(self.asked) == self.stops_before:
            raise Interruption
        self.asked.append(frame_id)
        return Taken(_pixels(frame_id, self.frame_format), {"wheel_slot": 3})


def _pixels(frame_id: str, form: FrameFormat) -> NDArray[Any]:
    rng = np.random.default_rng(list(frame_id.encode()))
    return rng.integers(0, 65533, (form.rows, form.columns)).astype(form.dtype)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("undisturbed")
    capture(PLAN, "gold", FakeRig(), folder)
    return folder


def test_every_frame_is_taken_once_in_the_order_of_the_plan(tmp_path: Path) -> None:
    rig = FakeRig()
    manifests = capture(PLAN, "gold", rig, tmp_path)
    assert manifests == [tmp_path / "lights" / light.id / "manifest.json" for light in PLAN.lights]
    expected = []
    for light in ("008.00", "041.00"):
        expected += [
            f"{light}/{nm}nm/s{state:02d}/e{exposure}"
            for nm in (450, 650)
            for state in range(3)
            for exposure in range(2)
        ]
        expected += [f"{light}/dark/e{exposure}/r{repeat}" for exposure in range(2) for repeat in range(2)]
    assert rig.asked == expected
    assert rig.settings[:3] == [
        Setting(PLAN.lights[0], 450, STATES[0], 0.005, 0),
        Setting(PLAN.lights[0], 450, STATES[0], 0.08, 0),
        Setting(PLAN.lights[0], 450, STATES[1], 0.005, 1),
    ]
    assert rig.dark_exposures == [0.005, 0.005, 0.08, 0.08] * 2


def test_progress_tells_rate_time_left_and_the_share_that_is_saturated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("pbrdf.capture.run.Progress", partial(Progress, every_s=0.0))
    rig = FakeRig(frame_format=FrameFormat(4, 5, "uint16", 14, 2, saturation=32766.0))
    capture(PLAN, "gold", rig, tmp_path)
    told = capsys.readouterr().err.splitlines()
    share = 100 * np.mean(_pixels("008.00/450nm/s00/e0", rig.frame_format) >= 32766)
    assert told[0].startswith(f"capture of gold: 1 of {FRAMES} frames (3 %), ")
    assert told[0].endswith(f" left, {share:.2g} % saturated at the shortest exposure")
    assert " frames/s, " in told[0]


def test_frames_lie_where_the_store_says(undisturbed: Path) -> None:
    form = FakeRig().frame_format
    store = FrameStore.open(undisturbed / "lights/041.00/frames.zarr")
    whole = (slice(0, 4), slice(0, 5))
    assert (store.header.source, store.header.material) == ("fake 1", "gold")
    for nm in (450, 650):
        band = store.read_band(nm, *whole)
        for state, exposure in np.ndindex(3, 2):
            taken = _pixels(f"041.00/{nm}nm/s{state:02d}/e{exposure}", form)
            assert np.array_equal(band[state, exposure], taken)
    dark = store.mean_dark(*whole)
    for exposure in range(2):
        pair = [_pixels(f"041.00/dark/e{exposure}/r{repeat}", form) for repeat in range(2)]
        assert np.array_equal(dark[exposure], np.mean(pair, axis=0, dtype=np.float64).astype(np.float32))


def test_the_journal_tells_what_was_asked(undisturbed: Path) -> None:
    lines = (undisturbed / "lights/008.00/journal.jsonl").read_text(encoding="utf-8").splitlines()
    third = json.loads(lines[2])
    assert third["frame"] == "450nm/s01/e0"
    assert third["state_deg"] == [0.0, 25.0, 5.0, 90.0]
    assert third["exposure_s"] == 0.005
    assert third["wheel_slot"] == 3
    assert datetime.fromisoformat(third["begun"]) <= datetime.fromisoformat(third["ended"])
    assert third["checksum"] == checksum(_pixels("008.00/450nm/s01/e0", FakeRig().frame_format))


@pytest.mark.parametrize("stops_before", [0, 1, 7, 13, 16, 17, 31])
def test_an_interrupted_run_ends_in_the_same_bytes(
    tmp_path: Path, undisturbed: Path, stops_before: int
) -> None:
    with pytest.raises(Interruption):
        capture(PLAN, "gold", FakeRig(stops_before), tmp_path)
    rig = FakeRig()
    capture(PLAN, "gold", rig, tmp_path)
    assert len(rig.asked) == FRAMES - stops_before
    assert capture_content(tmp_path) == capture_content(undisturbed)


def test_a_frame_stored_without_its_line_is_taken_again(tmp_path: Path, undisturbed: Path) -> None:
    with pytest.raises(Interruption):
        capture(PLAN, "gold", FakeRig(5), tmp_path)
    journal = tmp_path / "lights/008.00/journal.jsonl"
    journal.write_bytes(journal.read_bytes()[:-9])
    rig = FakeRig()
    capture(PLAN, "gold", rig, tmp_path)
    assert len(rig.asked) == FRAMES - 4
    assert capture_content(tmp_path) == capture_content(undisturbed)


def test_an_interrupted_light_has_no_manifest(tmp_path: Path) -> None:
    with pytest.raises(Interruption):
        capture(PLAN, "gold", FakeRig(20), tmp_path)
    assert [path.parent.name for path in tmp_path.glob("lights/*/manifest.json")] == ["008.00"]


def test_a_store_whose_making_was_interrupted_does_not_stand_in_the_way(
    tmp_path: Path, undisturbed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise Interruption

    with monkeypatch.context() as patch:
        patch.setattr("zarr.Group.create_array", interrupted)
        with pytest.raises(Interruption):
            capture(PLAN, "gold", FakeRig(), tmp_path)
    capture(PLAN, "gold", FakeRig(), tmp_path)
    assert capture_content(tmp_path) == capture_content(undisturbed)


def test_nothing_is_taken_twice(tmp_path: Path) -> None:
    capture(PLAN, "gold", FakeRig(), tmp_path)
    before = capture_content(tmp_path)
    rig = FakeRig()
    capture(PLAN, "gold", rig, tmp_path)
    assert rig.asked == []
    assert capture_content(tmp_path) == before


def test_a_lost_manifest_is_rebuilt_from_the_journal(tmp_path: Path) -> None:
    manifest = capture(PLAN, "gold", FakeRig(), tmp_path)[0]
    before = manifest.read_bytes()
    manifest.unlink()
    rig = FakeRig()
    capture(PLAN, "gold", rig, tmp_path)
    assert rig.asked == []
    assert manifest.read_bytes() == before


def test_lights_may_be_added(tmp_path: Path) -> None:
    capture(replace(PLAN, lights=PLAN.lights[:1]), "gold", FakeRig(), tmp_path)
    rig = FakeRig()
    capture(PLAN, "gold", rig, tmp_path)
    assert {name[:6] for name in rig.asked} == {"041.00"}


@pytest.mark.parametrize(
    ("plan", "rig", "field", "values"),
    [
        ({"bands_nm": (450, 550)}, {}, "bands_nm[1]", ("650", "550")),
        ({"bands_nm": (450,)}, {}, "bands_nm", ("[450, 650]", "[450]")),
        (
            {"states_deg": (*STATES[:2], (0.0, 1.0, 2.0, 90.0))},
            {},
            "states_deg[2]",
            ("[0.0, 50.0, 10.0, 90.0]", "[0.0, 1.0, 2.0, 90.0]"),
        ),
        ({"exposures_s": (0.005, 0.09)}, {}, "exposures_s[1]", ("0.08", "0.09")),
        ({"darks": 4}, {}, "darks", ("2", "4")),
        ({"references": (3,)}, {}, "references", ("[]", "[3]")),
        ({"lights": (Light("008.00", 8.004),)}, {}, "angle_deg", ("8.0", "8.004")),
        ({}, {"identity": "fake 2"}, "source", ("fake 1", "fake 2")),
        ({}, {"frame_format": FrameFormat(4, 6, "uint16", 14, 2, 65532.0)}, "columns", ("5", "6")),
        ({}, {"frame_format": FrameFormat(4, 5, "uint8", 14, 2, 65532.0)}, "dtype", ("uint16", "uint8")),
    ],
)
def test_what_contradicts_taken_frames_is_refused_and_changes_nothing(
    tmp_path: Path, plan: dict[str, Any], rig: dict[str, Any], field: str, values: tuple[str, str]
) -> None:
    capture(PLAN, "gold", FakeRig(), tmp_path)
    before = capture_content(tmp_path)
    other = FakeRig(**rig)
    with pytest.raises(InputError) as refused:
        capture(replace(PLAN, **plan), "gold", other, tmp_path)
    assert refused.value.field == field
    for value in values:
        assert value in refused.value.problem
    assert other.asked == []
    assert (capture_content(tmp_path)) == before


def test_another_material_does_not_join(tmp_path: Path) -> None:
    capture(PLAN, "gold", FakeRig(), tmp_path)
    with pytest.raises(InputError, match=r"material: .* gold, now it is jade"):
        capture(PLAN, "jade", FakeRig(), tmp_path)


def test_a_journal_of_frames_that_are_gone_is_refused(tmp_path: Path) -> None:
    capture(PLAN, "gold", FakeRig(), tmp_path)
    here = tmp_path / "lights/008.00"
    (here / "frames.zarr").rename(tmp_path / "elsewhere")
    with pytest.raises(InputError) as refused:
        capture(PLAN, "gold", FakeRig(), tmp_path)
    assert refused.value.source == str(here / "journal.jsonl")
    assert "records 16 frames, and frames.zarr is gone" in refused.value.problem
    assert not (here / "frames.zarr").exists()


def test_the_first_state_is_taken_again_where_the_plan_says(tmp_path: Path) -> None:
    rig = FakeRig(stops_before=100)
    capture(replace(REPEATING, lights=PLAN.lights[:1], bands_nm=(450,)), "gold", rig, tmp_path)
    names = ("s00", "r00", "s01", "s02", "r01")
    expected = [f"008.00/450nm/{name}/e{exposure}" for name in names for exposure in range(2)]
    assert rig.asked == [*expected, *(f"008.00/dark/e{e}/r{r}" for e in range(2) for r in range(2))]
    assert [setting.state_deg for setting in rig.settings[::2]] == [
        STATES[state] for state in (0, 2, 1, 2, 2)
    ]
    assert [setting.position for setting in rig.settings] == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4]


def test_repeats_lie_where_the_store_says(tmp_path: Path) -> None:
    capture(REPEATING, "gold", FakeRig(stops_before=100), tmp_path)
    folder = tmp_path / "lights/041.00"
    store, whole = FrameStore.open(folder / "frames.zarr"), (slice(0, 4), slice(0, 5))
    assert store.header.references == (1, 3)
    for nm in (450, 650):
        for repeat, frames in enumerate(store.read_references(nm, *whole)):
            for exposure in range(2):
                taken = _pixels(f"041.00/{nm}nm/r{repeat:02d}/e{exposure}", FakeRig().frame_format)
                assert np.array_equal(frames[exposure], taken)
    manifest = read_manifest(folder / "manifest.json")
    assert manifest["references"] == [1, 3]
    assert manifest["frames"] == REPEATING.frames_per_light()
    lines = (folder / "journal.jsonl").read_text(encoding="utf-8").splitlines()
    third = json.loads(lines[2])
    assert (third["frame"], third["state_deg"]) == ("450nm/r00/e0", list(STATES[2]))


@pytest.mark.parametrize("stops_before", [2, 3, 9, 10, 23])
def test_a_run_interrupted_among_repeats_ends_in_the_same_bytes(tmp_path: Path, stops_before: int) -> None:
    frames = 2 * REPEATING.frames_per_light()
    capture(REPEATING, "gold", FakeRig(frames), tmp_path / "undisturbed")
    with pytest.raises(Interruption):
        capture(REPEATING, "gold", FakeRig(stops_before), tmp_path / "interrupted")
    rig = FakeRig(frames)
    capture(REPEATING, "gold", rig, tmp_path / "interrupted")
    assert len(rig.asked) == frames - stops_before
    assert capture_content(tmp_path / "interrupted") == capture_content(tmp_path / "undisturbed")


def test_a_lost_repeat_is_taken_again(tmp_path: Path) -> None:
    capture(REPEATING, "gold", FakeRig(stops_before=100), tmp_path)
    before = capture_content(tmp_path)
    (tmp_path / "lights/008.00/frames.zarr/650nm_reference/c.1.0.0.0").unlink()
    rig = FakeRig()
    capture(REPEATING, "gold", rig, tmp_path)
    assert rig.asked == ["008.00/650nm/r01/e0"]
    assert capture_content(tmp_path) == before


def test_frames_with_repeats_are_not_joined_by_frames_without(tmp_path: Path) -> None:
    capture(REPEATING, "gold", FakeRig(stops_before=100), tmp_path)
    with pytest.raises(InputError, match=r"references: .* \[1, 3\], now it is \[\]"):
        capture(PLAN, "gold", FakeRig(), tmp_path)
