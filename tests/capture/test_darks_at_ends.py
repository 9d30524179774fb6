"""Where somebody covers the lamp by hand, dark frames are taken at start and end of a run only."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from capture_content import capture_content

from pbrdf.capture.frames import read_manifest
from pbrdf.capture.run import capture
from pbrdf.capture.status import capture_status
from pbrdf.commands.photographs import _how_taken
from pbrdf.errors import InputError
from pbrdf.instruments.interface import FrameFormat, Setting, Taken
from pbrdf.settings.plan import CapturePlan, Light, Metering

STATES = tuple((0.0, 25.0 * n, 5.0 * n, 90.0) for n in range(3))
PLAN = CapturePlan(
    (Light("008.00", 8.0), Light("041.00", 41.0)), (450,), STATES, (0.005, 0.08), darks=3, references=(1,)
)
FRAMES = 2 * PLAN.frames_per_light()


class Interruption(Exception):
    """What stands for a pulled plug."""


@dataclass
class CappedRig:
    """Tells how often somebody put the cap on."""

    stops_before: int = 10**9
    identity: str = "capped"
    frame_format: FrameFormat = field(default_factory=lambda: FrameFormat(8, 8, "uint16", 14, 2, 65532.0))
    asked: list[str] = field(default_factory=list)

    @property
    def covered(self) -> int:
        dark = ["dark" in name for name in ["", *self.asked]]
        return sum(b and not a for a, b in pairwise(dark))

    def expose(self, frame_id: str, setting: Setting) -> Taken:
        return self._frame(frame_id)

    def expose_dark(self, frame_id: str, exposure_s: float) -> Taken:
        return self._frame(frame_id)

    def _frame(self, frame_id: str) -> Taken:
        if len(self.asked) == self.stops_before:
            raise Interruption
        self.asked.append(frame_id)
        pixels = np.random.default_rng(list(frame_id.encode())).integers(100, 2000, (8, 8))
        return Taken(pixels.astype(np.uint16), {})


def photograph(folder: Path, rig: CappedRig, plan: CapturePlan = PLAN) -> list[Path]:
    return capture(plan, "gold", rig, folder, darks_at_ends=True)


def test_half_of_the_dark_frames_come_first_and_half_last(tmp_path: Path) -> None:
    rig = CappedRig()
    photograph(tmp_path, rig)
    dark = [index for index, name in enumerate(rig.asked) if "dark" in name]
    # three an exposure and light: two before, one after
    assert dark == [*range(8), *range(FRAMES - 4, FRAMES)]
    assert rig.covered == 2
    assert len(set(rig.asked)) == FRAMES


def test_every_light_has_frames_of_its_own(tmp_path: Path) -> None:
    manifests = photograph(tmp_path, CappedRig())
    assert [read_manifest(path)["frames"] for path in manifests] == [PLAN.frames_per_light()] * 2
    assert all(read_manifest(path)["darks_at_ends"] for path in manifests)


@pytest.mark.parametrize("stops_before", [0, 3, 8, 15, 16, FRAMES - 4, FRAMES - 1])
def test_no_light_is_whole_before_the_end_and_a_resumed_run_gets_there(
    tmp_path: Path, stops_before: int
) -> None:
    photograph(tmp_path / "undisturbed", CappedRig())
    with pytest.raises(Interruption):
        photograph(tmp_path / "resumed", CappedRig(stops_before))
    assert list(tmp_path.glob("resumed/lights/*/manifest.json")) == []
    rig = CappedRig()
    photograph(tmp_path / "resumed", rig)
    assert len(rig.asked) == FRAMES - stops_before
    assert rig.covered <= 2
    assert capture_content(tmp_path / "resumed") == capture_content(tmp_path / "undisturbed")


def test_lights_that_are_added_have_their_own_start_and_end(tmp_path: Path) -> None:
    photograph(tmp_path, CappedRig(), replace(PLAN, lights=PLAN.lights[:1]))
    rig = CappedRig()
    photograph(tmp_path, rig)
    assert {name[:6] for name in rig.asked} == {"041.00"}
    assert rig.covered == 2


def test_metering_precedes_the_first_cover(tmp_path: Path) -> None:
    plan = replace(PLAN, metering=Metering(0.0001, 0.8))
    rig = CappedRig()
    photograph(tmp_path, rig, plan)
    metered = [index for index, name in enumerate(rig.asked) if "/meter/" in name]
    assert metered == list(range(len(metered)))
    assert len(rig.asked) == FRAMES + len(metered)
    assert rig.covered == 2


def test_frames_of_the_two_ways_do_not_mix(tmp_path: Path) -> None:
    photograph(tmp_path, CappedRig())
    with pytest.raises(InputError, match="darks_at_ends"):
        capture(PLAN, "gold", CappedRig(), tmp_path)


@pytest.mark.parametrize(
    ("at_ends", "metering", "told"),
    [
        (False, None, ""),
        (True, None, "; dark frames are from start and end of the run only"),
        (False, Metering(0.0001, 0.8), "; exposures were metered: 5 to 80 ms"),
    ],
)
def test_the_status_says_how_frames_were_taken(
    tmp_path: Path, at_ends: bool, metering: Metering | None, told: str
) -> None:
    capture(replace(PLAN, metering=metering), "gold", CappedRig(), tmp_path, darks_at_ends=at_ends)
    assert _how_taken(list(capture_status(tmp_path))) == told
