"""What the workflow does with photographs that are there: nothing, or what is left to do."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml
from small_workflow import small_settings, snakemake

pytestmark = pytest.mark.workflow

CONFIG = ("--configfile", "config.yaml")
LIGHTS = "captures/plastic/lights"


def frames(folder: Path) -> dict[str, int]:
    """When each frame was written, ns."""
    return {str(path): path.stat().st_mtime_ns for path in folder.glob(f"{LIGHTS}/*/frames.zarr/*/c.*")}


def test_a_forced_capture_writes_no_frame_again(again: Path) -> None:
    manifests = {path: path.read_bytes() for path in again.glob(f"{LIGHTS}/*/manifest.json")}
    before = frames(again)
    run = snakemake(again, "capture", *CONFIG, "-F")
    assert run.returncode == 0, run.stderr
    assert frames(again) == before
    assert {path: path.read_bytes() for path in manifests} == manifests


def test_a_finished_light_is_worked_on_while_others_are_missing(again: Path) -> None:
    (again / f"{LIGHTS}/090.00/manifest.json").unlink()
    (again / "results/plastic/slices/050.00.json").unlink()
    run = snakemake(again, "results/plastic/slices/050.00.json", *CONFIG)
    assert run.returncode == 0, run.stderr
    assert set(re.findall(r"^rule (\w+):", run.stderr, re.MULTILINE)) <= {"reconstruct_kept", "slice"}
    assert not (again / f"{LIGHTS}/090.00/manifest.json").exists()


def test_a_plan_that_adds_exposures_extends_what_was_taken(again: Path) -> None:
    settings = small_settings()
    settings["plan"] |= {"exposures_ms": [5, 20, 80]}
    (again / "config.yaml").write_text(yaml.safe_dump(settings), encoding="utf-8")
    before = len(frames(again))
    run = snakemake(again, "capture", *CONFIG)
    assert run.returncode == 0, run.stderr
    assert len(frames(again)) == before * 3 // 2
