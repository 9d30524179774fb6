"""Exposures that are chosen by what the camera sees, and kept."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from capture_content import capture_content
from numpy.typing import NDArray

from pbrdf.capture.frames import read_manifest
from pbrdf.capture.metering import bright_level
from pbrdf.capture.run import capture
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FrameStore
from pbrdf.instruments.emulators.rig import emulated_rig
from pbrdf.instruments.interface import FrameFormat, Setting, Taken
from pbrdf.instruments.virtual_rig import VirtualRig
from pbrdf.instruments.virtual_sphere import VirtualSphere
from pbrdf.settings.plan import CapturePlan, Light, Metering
from pbrdf.settings.rig import read_rig

SOURCE = Path(__file__).resolve().parents[2] / "config/rig/virtual.yaml"
STATES = tuple((0.0, 25.0 * n % 360, 5.0 * n, 90.0) for n in range(36))
PLAN = CapturePlan(
    (Light("008.00", 8.0), Light("041.00", 41.0)),
    (450, 650),
    STATES,
    (0.1, 0.4, 1.6),
    darks=2,
    metering=Metering(shortest_s=0.0001, fill=0.8),
)
FULL = 65532.0
OFFSET = 192.0


class Interruption(Exception):
    """What stands for a pulled plug."""


@dataclass
class LampRig:
    """Sees a bright area, by light and band, in every state, and a hot pixel in a dark surround."""

    dn_per_s: dict[tuple[str, int], float] = field(default_factory=dict)
    stops_before: int = 10**9
    identity: str = "lamp"
    frame_format: FrameFormat = field(default_factory=lambda: FrameFormat(12, 12, "uint16", 14, 2, FULL))
    asked: list[str] = field(default_factory=list)

    @property
    def metering(self) -> list[str]:
        return [name for name in self.asked if "/meter/" in name]

    def expose(self, frame_id: str, setting: Setting) -> Taken:
        dn_per_s = self.dn_per_s.get((setting.light.id, setting.band_nm), 1e6)
        return self._frame(frame_id, dn_per_s * setting.exposure_s)

    def expose_dark(self, frame_id: str, exposure_s: float) -> Taken:
        return self._frame(frame_id, 0.0)

    def _frame(self, frame_id: str, signal_dn: float) -> Taken:
        if len(self.asked) == self.stops_before:
            raise Interruption
        self.asked.append(frame_id)
        picture = np.full((12, 12), OFFSET)
        picture[4:8, 4:8] += signal_dn
        picture[1, 1] = FULL
        noise = np.random.default_rng(list(frame_id.encode())).integers(0, 4, picture.shape)
        return Taken(np.minimum(picture + noise, FULL).astype(np.uint16), {})


def exposures(folder: Path, light: str) -> tuple[float, ...]:
    return FrameStore.open(folder / "lights" / light / "frames.zarr").header.exposures_s


def test_the_brightest_band_of_each_light_is_just_under_saturation(tmp_path: Path) -> None:
    dn_per_s = {("008.00", 450): 3e5, ("008.00", 650): 2e6, ("041.00", 450): 8e6, ("041.00", 650): 4e4}
    rig = LampRig(dn_per_s)
    capture(PLAN, "gold", rig, tmp_path)
    for light, brightest in (("008.00", 2e6), ("041.00", 8e6)):
        ladder = exposures(tmp_path, light)
        assert brightest * ladder[0] == pytest.approx(0.8 * FULL, rel=0.02)
        assert [b / a for a, b in pairwise(ladder)] == pytest.approx([4.0, 4.0], rel=1e-6)
        for nm in (450, 650):
            frames = FrameStore.open(tmp_path / "lights" / light / "frames.zarr").read_band(
                nm, slice(4, 8), slice(4, 8)
            )
            assert frames[:, 0].max() < FULL
    assert len(rig.asked) - len(rig.metering) == 2 * PLAN.frames_per_light()


def test_what_was_metered_stands_in_manifest_and_journal(tmp_path: Path) -> None:
    manifest = capture(PLAN, "gold", LampRig({("008.00", 650): 2e6}), tmp_path)[0]
    content = read_manifest(manifest)
    assert content["metered_dn_per_s"] == pytest.approx(2e6, rel=0.02)
    assert content["exposures_s"] == list(exposures(tmp_path, "008.00"))
    lines = (manifest.parent / "journal.jsonl").read_text(encoding="utf-8").splitlines()
    assert {json.loads(line)["exposure_s"] for line in lines} == set(content["exposures_s"])


@pytest.mark.parametrize(
    ("dn_per_s", "ladder"), [(0.0, (0.1, 0.4, 1.6)), (1e3, (0.1, 0.4, 1.6)), (1e12, (1e-4, 4e-4, 1.6e-3))]
)
def test_exposures_stay_within_the_plans_range(
    tmp_path: Path, dn_per_s: float, ladder: tuple[float, ...]
) -> None:
    sources = {(light.id, nm): dn_per_s for light in PLAN.lights for nm in PLAN.bands_nm}
    capture(PLAN, "gold", LampRig(sources), tmp_path)
    assert exposures(tmp_path, "008.00") == pytest.approx(ladder)


def test_a_pixel_that_is_bright_alone_does_not_count() -> None:
    frame = np.full((9, 9), 100, np.uint16)
    frame[2, 2] = 65532
    assert bright_level(frame) == 100
    frame[5:8, 5:8] = 3000
    assert bright_level(frame) == 3000


def metered_frames(tmp_path: Path) -> int:
    rig = LampRig()
    capture(replace(PLAN, lights=PLAN.lights[:1]), "gold", rig, tmp_path / "counted")
    return len(rig.metering)


def test_a_run_interrupted_anywhere_ends_in_the_same_bytes_and_meters_no_light_twice(tmp_path: Path) -> None:
    capture(PLAN, "gold", LampRig(), tmp_path / "undisturbed")
    metered = metered_frames(tmp_path)
    light = metered + PLAN.frames_per_light()
    for stops_before in (0, 3, metered, metered + 1, light, light + metered - 1, light + metered):
        folder = tmp_path / str(stops_before)
        first, second = LampRig(stops_before=stops_before), LampRig()
        with pytest.raises(Interruption):
            capture(PLAN, "gold", first, folder)
        capture(PLAN, "gold", second, folder)
        assert capture_content(folder) == capture_content(tmp_path / "undisturbed")
        known = [stops_before >= metered, stops_before >= light + metered]
        assert len(second.metering) == metered * known.count(False)


def test_a_lamp_that_is_brighter_now_changes_no_exposure(tmp_path: Path) -> None:
    plan = replace(PLAN, lights=PLAN.lights[:1])
    stopped = LampRig(stops_before=metered_frames(tmp_path) + 40)
    with pytest.raises(Interruption):
        capture(plan, "gold", stopped, tmp_path / "taken")
    before = exposures(tmp_path / "taken", "008.00")
    rig = LampRig({("008.00", 450): 9e6})
    capture(plan, "gold", rig, tmp_path / "taken")
    assert exposures(tmp_path / "taken", "008.00") == before
    assert rig.metering == []


@pytest.mark.parametrize("change", [{"bands_nm": (450, 550, 650)}, {"exposures_s": (0.1, 0.4, 1.6, 6.4)}])
def test_what_a_plan_adds_joins_what_was_metered(tmp_path: Path, change: dict[str, Any]) -> None:
    capture(PLAN, "gold", LampRig(), tmp_path)
    before, more = exposures(tmp_path, "041.00"), replace(PLAN, **change)
    rig = LampRig()
    capture(more, "gold", rig, tmp_path)
    assert rig.metering == []
    assert len(rig.asked) == 2 * (more.frames_per_light() - PLAN.frames_per_light())
    assert exposures(tmp_path, "041.00")[:3] == pytest.approx(before, rel=1e-6)


@pytest.mark.parametrize(
    ("taken", "wanted", "told"),
    [
        ({}, {"metering": Metering(0.0001, 0.5)}, r"exposures_s\[0\]"),
        ({}, {"exposures_s": (0.1, 0.8, 6.4)}, r"exposures_s\[1\]"),
        ({}, {"metering": None}, "exposures_s"),
        ({"metering": None}, {}, "fixed exposures, now they are to be metered"),
    ],
)
def test_another_ladder_is_refused_before_a_frame_is_taken(
    tmp_path: Path, taken: dict[str, Any], wanted: dict[str, Any], told: str
) -> None:
    capture(replace(PLAN, **taken), "gold", LampRig(), tmp_path)
    before, rig = capture_content(tmp_path), LampRig()
    with pytest.raises(InputError, match=told):
        capture(replace(PLAN, **wanted), "gold", rig, tmp_path)
    assert rig.asked == []
    assert capture_content(tmp_path) == before


def virtual_lights(folder: Path, material: str) -> list[NDArray[np.uint16]]:
    """Frames (state, exposure, row, column) of lights on the virtual rig, metered over its wires."""
    settings = read_rig(SOURCE)
    camera = {**settings["camera"], "rows": 48, "columns": 48, "focal_px": 800, "principal_px": [23.6, 23.9]}
    rig = {**settings, "camera": camera}
    angles = (20.0, 80.0, 140.0)
    plan = replace(
        PLAN,
        exposures_s=(0.25, 1.0, 4.0),
        lights=tuple(Light(f"{angle:06.2f}", angle) for angle in angles),
        bands_nm=(450,),
        darks=1,
    )
    with emulated_rig(rig, VirtualRig(rig, VirtualSphere(rig, material, 25.0, SOURCE))) as ready:
        ready.require(plan)
        manifests = capture(plan, material, ready, folder)
    whole = (slice(0, 48), slice(0, 48))
    return [FrameStore.open(path.parent / "frames.zarr").read_band(450, *whole) for path in manifests]


@pytest.mark.parametrize("material", ["plastic", "gold"])
def test_a_sphere_fills_the_range_of_the_shortest_exposure_in_all_states(
    tmp_path: Path, material: str
) -> None:
    for frames in virtual_lights(tmp_path, material):
        brightest = max(bright_level(frame) for frame in frames[:, 0])
        assert 0.78 * FULL < brightest < 0.9 * FULL
        assert float(np.mean(frames[:, 0] >= FULL)) < 1e-3
