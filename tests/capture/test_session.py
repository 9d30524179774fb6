"""Targets of a session, photographed on a virtual rig of a few pixels."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pbrdf.capture.frames import read_manifest
from pbrdf.capture.session import capture_target, virtual_target
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FrameStore
from pbrdf.instruments.virtual_rig import VirtualRig
from pbrdf.settings.checked import check
from pbrdf.settings.plan import CapturePlan, Light
from pbrdf.settings.rig import read_rig
from pbrdf.settings.targets import AMBIENT, session_plans

SOURCE = Path(__file__).resolve().parents[2] / "config/rig/virtual.yaml"
PLAN = CapturePlan(
    (Light("180.00", 180.0),), (550,), ((0.0, 0.0, 0.0, 90.0), (0.0, 0.0, 0.0, 0.0)), (0.005,), 1
)


def small_rig(**changes: Any) -> dict[str, Any]:
    rig = read_rig(SOURCE).with_no_sphere()
    camera = {**rig["camera"], "rows": 20, "columns": 20, "focal_px": 800, "principal_px": [9.5, 9.5]}
    return {**rig, "camera": camera, **changes}


def test_every_planned_target_is_known_and_has_frames_of_its_own() -> None:
    config = check({"materials": "m.tsv"}, "config", "config.yaml")
    rig = small_rig()
    plans = session_plans(replace(PLAN, lights=(Light("060.00", 60.0),)), config, "config.yaml")
    subjects = [virtual_target(name, rig, config["session"], SOURCE) for name in plans]
    assert len({subject.name for subject in subjects}) == len(plans)
    assert len({VirtualRig(rig, subject).identity for subject in subjects}) == len(plans)
    for (name, plan), subject in zip(plans.items(), subjects, strict=True):
        image = subject.mueller_image(plan.lights[0].angle_deg, plan.bands_nm[0])
        assert (image.shape, image.dtype) == ((20, 20, 16), np.dtype(np.float32)), name
        assert image[..., 0].max() > 0, name


def test_what_the_lamp_does_not_light_needs_no_arm(tmp_path: Path) -> None:
    """The angle 0 of ambient targets is beyond every arm's limits, and means nothing."""
    plan = replace(PLAN, lights=(AMBIENT,), states_deg=PLAN.states_deg[:1])
    capture_target(plan, small_rig(), SOURCE, "flat", {}, tmp_path)
    assert read_manifest(tmp_path / "lights/000.00/manifest.json")["frames"] == 2


def test_a_target_is_captured_as_a_material_is(tmp_path: Path) -> None:
    """One light, its manifest, and frames in which a crossed polariser darkens the lamp."""
    capture_target(PLAN, small_rig(), SOURCE, "LPV", {}, tmp_path)
    manifest = read_manifest(tmp_path / "lights/180.00/manifest.json")
    assert (manifest["material"], manifest["angle_deg"], manifest["frames"]) == ("LPV", 180.0, 3)
    everything = slice(None)
    frames = FrameStore.open(tmp_path / "lights/180.00/frames.zarr").read_band(550, everything, everything)
    crossed, parallel = (
        np.asarray(frames[state, 0], dtype=np.float64)[8:12, 8:12].mean() for state in (0, 1)
    )
    assert parallel > 20 * crossed


def test_an_arm_that_does_not_reach_the_light_is_refused(tmp_path: Path) -> None:
    rig = small_rig(arm={"radius_mm": 800, "limits_deg": [5, 175]})
    with pytest.raises(InputError) as refused:
        capture_target(PLAN, rig, "rig.yaml", "air", {}, tmp_path)
    assert (refused.value.source, refused.value.field) == ("rig.yaml", "arm.limits_deg")
    assert "180°" in refused.value.problem
    assert not list(tmp_path.iterdir())


def test_a_real_rig_must_name_its_instruments(tmp_path: Path) -> None:
    with pytest.raises(InputError) as refused:
        capture_target(PLAN, small_rig(kind="real"), "rig.yaml", "air", {}, tmp_path)
    assert (refused.value.source, refused.value.field) == ("rig.yaml", "instruments")
