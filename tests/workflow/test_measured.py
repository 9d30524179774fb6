"""A run in which everything is measured: what it makes, and what reruns when one thing is measured again."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from small_workflow import measured_settings, rules_due, snakemake, table_errors

from pbrdf.calibration.documents import KINDS

pytestmark = pytest.mark.workflow

CONFIG = ("--configfile", "config.yaml")
DOCUMENTS = {kind: f"calibration/monday/{kind}.json" for kind in KINDS} | {"sphere": "plastic/sphere.json"}


@pytest.fixture
def again(measured: Path, tmp_path: Path) -> Path:
    """A copy of the finished folder, times of files included."""
    folder = tmp_path / "again"
    shutil.copytree(measured, folder)
    return folder


def document(folder: Path, kind: str) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((folder / "results" / DOCUMENTS[kind]).read_text(encoding="utf-8"))
    return content


@pytest.mark.parametrize("kind", KINDS)
def test_every_calibration_is_measured_and_says_of_what(measured: Path, kind: str) -> None:
    content = document(measured, kind)
    assert content["source"] == "measured"
    assert not content["verdict"].startswith("unusable")
    assert content["inputs"]


def test_the_page_says_that_all_was_measured(measured: Path) -> None:
    page = (measured / "results/report/plastic.html").read_text(encoding="utf-8")
    assert all(f"{kind}</a> measured" in page for kind in KINDS)


@pytest.mark.parametrize("kind", KINDS)
def test_every_calibration_has_a_page_with_pictures(measured: Path, kind: str) -> None:
    link = f"calibration_{'plastic' if kind == 'sphere' else 'monday'}_{kind}.html"
    report = measured / "results/report"
    assert "<img" in (report / link).read_text(encoding="utf-8")
    for page in ("index.html", "plastic.html"):
        assert f'href="{link}"' in (report / page).read_text(encoding="utf-8")


def test_retardances_are_the_rigs(measured: Path) -> None:
    rig = yaml.safe_load((measured / "rig.yaml").read_text(encoding="utf-8"))
    band = document(measured, "polarimeter")["bands"]["550"]
    for module in ("generator", "analyser"):
        waves = rig["polarimeter"][f"{module}_retardance_waves"]["550"]
        assert band[f"{module}_retardance_deg"] == pytest.approx(360 * waves, abs=0.05)


def test_second_run_has_nothing_to_do(measured: Path) -> None:
    assert rules_due(measured) == set()


def retake(folder: Path, target: str) -> None:
    """Take a target's photographs anew, as an operator would: move them away and let the rig take them."""
    shutil.rmtree(folder / f"captures/_sessions/monday/{target}")
    manifest = f"captures/_sessions/monday/{target}/lights/180.00/manifest.json"
    run = snakemake(folder, manifest, *CONFIG)
    assert run.returncode == 0, run.stderr


def test_the_same_photographs_taken_again_rerun_nothing(again: Path) -> None:
    """Their manifest is the same, whenever it was written."""
    retake(again, "LPH")
    assert rules_due(again) == set()


def test_another_lamp_reference_reruns_what_depends_on_the_polarimeter(again: Path) -> None:
    manifest = again / "captures/_sessions/monday/LPH/lights/180.00/manifest.json"
    content = json.loads(manifest.read_text(encoding="utf-8"))
    manifest.write_text(json.dumps(content | {"digest": "of other frames"}), encoding="utf-8")
    rules = rules_due(again)
    assert {"calibrate_polarimeter", "reconstruct", "slice", "tabulate", "fit"} <= rules
    assert not rules & {
        "calibrate_camera",
        "calibrate_flat",
        "locate_sphere",
        "capture_material",
        "capture_target",
    }


def test_a_calibration_that_comes_out_the_same_stops_the_rerun(again: Path) -> None:
    """Made again in an invocation of its own, as everything that is measured."""
    sphere = again / "results/plastic/sphere.json"
    before = sphere.read_bytes()
    sphere.unlink()
    run = snakemake(again, "results/plastic/sphere.json", *CONFIG)
    assert run.returncode == 0, run.stderr
    assert sphere.read_bytes() == before
    assert rules_due(again) == set()


def test_lights_without_the_arms_radius_are_refused(again: Path) -> None:
    changed = measured_settings()
    del changed["session"]["arm"]
    (again / "config.yaml").write_text(yaml.safe_dump(changed), encoding="utf-8")
    run = snakemake(again, *CONFIG)
    assert run.returncode != 0
    line = run.stderr.rstrip().splitlines()[-1]
    assert line.startswith("results/calibration/monday/lights.json: verdict: unusable")
    assert "Traceback" not in run.stderr


def test_table_is_the_truth_where_it_was_measured(measured: Path) -> None:
    (error,) = table_errors(measured, "plastic").values()
    assert np.median(error) < 0.1
