"""Mistakes of the user: one line with file, field and remedy, an exit code, and nothing half-written."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from small_workflow import ROOT, TRUTH, small_settings, snakemake, write_materials, write_project

from pbrdf.formats.pbsdf import write_pbsdf
from pbrdf.formats.table_data import TableData
from pbrdf.tabulation.axes import table_axes

pytestmark = pytest.mark.workflow

RECEIPT = ("results/plastic/mueller/050.00.json",)


def refusal(folder: Path, *words: str, targets: tuple[str, ...] = ()) -> str:
    """Run, expect a refusal, and give its last line, which holds all `words`."""
    run = snakemake(folder, *targets, "--configfile", "config.yaml")
    assert run.returncode != 0
    line = run.stderr.rstrip().splitlines()[-1]
    assert all(word in line for word in words), run.stderr
    assert "Traceback" not in run.stderr
    return line


def changed(**changes: Any) -> dict[str, Any]:
    return small_settings() | changes


def test_unknown_config_key(tmp_path: Path) -> None:
    write_project(tmp_path, changed(reconstrution={}))
    refusal(tmp_path, "config.yaml", "reconstrution", "did you mean `reconstruction`?")


def test_misspelt_material(tmp_path: Path) -> None:
    write_project(tmp_path, changed(only=["plastik"]))
    refusal(tmp_path, "config.yaml", "only", "plastik", "did you mean `plastic`?")


def test_band_without_filter(tmp_path: Path) -> None:
    settings = small_settings()
    settings["plan"]["bands_nm"] = [450, 700]
    write_project(tmp_path, settings)
    refusal(tmp_path, "plan.bands_nm", "700 nm", "450, 500, 550, 600, 650 nm")


@pytest.mark.parametrize("name", ["../escape", "<script>", "a b", "x" * 65])
def test_name_that_is_no_path(tmp_path: Path, name: str) -> None:
    write_project(tmp_path)
    write_materials(tmp_path, (name, "rig", "monday", "25", "-", "-"))
    refusal(tmp_path, "materials.tsv", "line 2, material", "letters, digits")
    assert not (tmp_path / "captures").exists()


def test_missing_file(tmp_path: Path) -> None:
    write_project(tmp_path)
    write_materials(tmp_path, ("jade", "table", "-", "-", "jade.pbsdf", "-"))
    refusal(tmp_path, "materials.tsv", "jade, path", "jade.pbsdf", "correct the path")


def test_cut_table(tmp_path: Path) -> None:
    write_project(tmp_path)
    axes = table_axes(4, 4, 5)
    shape = (5, *axes.shape, 4, 4)
    table = TableData(
        "made here",
        np.array([450.0, 500, 550, 600, 650]),
        axes.theta_h,
        axes.theta_d,
        axes.phi_d,
        np.ones(shape, np.float32),
    )
    write_pbsdf(tmp_path / "whole.pbsdf", table)
    (tmp_path / "cut.pbsdf").write_bytes((tmp_path / "whole.pbsdf").read_bytes()[:-100])
    write_materials(tmp_path, ("jade", "table", "-", "-", "cut.pbsdf", "-"))
    refusal(tmp_path, "cut.pbsdf")
    assert not (tmp_path / "results/jade/table.zarr").exists()
    assert "cut.pbsdf" in (tmp_path / "logs/import_table/jade.log").read_text(encoding="utf-8")


def test_saturated_photographs(tmp_path: Path) -> None:
    rig = yaml.safe_load((ROOT / "config/rig/virtual.yaml").read_text(encoding="utf-8"))
    glaring = {band: 1e4 * electrons for band, electrons in rig["lamp_electrons_per_s"].items()}
    write_project(tmp_path, lamp_electrons_per_s=glaring)
    receipt = "results/plastic/mueller/030.00.json"
    refusal(tmp_path, "frames.zarr", "saturated", "expose it less", targets=(receipt,))
    assert not (tmp_path / receipt).exists()
    assert not (tmp_path / "results/plastic/mueller/030.00").exists()


def test_calibration_that_is_none(tmp_path: Path) -> None:
    write_project(tmp_path, changed(calibration=TRUTH | {"polarimeter": "my.json"}))
    (tmp_path / "my.json").write_text('{"schema": "pbrdf/polarimeter/1", "zeros_deg": {}}', encoding="utf-8")
    refusal(tmp_path, "my.json", "zeros_deg.generator_polariser", "is missing")
    assert not (tmp_path / "results/calibration/monday/polarimeter.json").exists()


def test_calibration_with_a_number_that_is_none(tmp_path: Path) -> None:
    write_project(tmp_path, changed(calibration=TRUTH | {"camera": "my.json"}))
    (tmp_path / "my.json").write_text('{"schema": "pbrdf/camera/1", "focal_px": [NaN, 1]}', encoding="utf-8")
    refusal(tmp_path, "my.json", "NaN")


def test_sphere_that_the_rig_does_not_have(tmp_path: Path) -> None:
    write_project(tmp_path)
    write_materials(tmp_path, ("jade", "rig", "monday", "25", "-", "-"))
    refusal(tmp_path, "rig.yaml", "spheres", "none called `jade`", "gold, plastic")


def test_states_that_hardly_tell_all_elements(tmp_path: Path) -> None:
    settings = small_settings()
    settings["plan"]["states"]["count"] = 18
    write_project(tmp_path, settings)
    refusal(tmp_path, "config.yaml", "plan.states", "condition", "below 1000")
    assert not (tmp_path / "captures").exists()


def test_kept_image_of_no_light(tmp_path: Path) -> None:
    write_project(tmp_path, changed(reconstruction={"keep_images": ["123.00"]}))
    refusal(tmp_path, "reconstruction.keep_images", "123.00", "030.00, 050.00")


def test_capture_without_lights(tmp_path: Path) -> None:
    write_project(tmp_path)
    (tmp_path / "elsewhere").mkdir()
    write_materials(tmp_path, ("jade", "capture", "monday", "25", "elsewhere", "-"))
    refusal(tmp_path, "elsewhere", "lights", "pbrdf.write_capture")


def test_sphere_of_another_radius(tmp_path: Path) -> None:
    write_project(tmp_path, changed(calibration=TRUTH | {"sphere": "{material}.json"}))
    sphere = {"schema": "pbrdf/sphere/1", "centre_mm": [0, 0, 1000], "radius_mm": 20}
    (tmp_path / "plastic.json").write_text(json.dumps(sphere), encoding="utf-8")
    target = ("results/plastic/sphere.json",)
    refusal(tmp_path, "plastic.json", "radius_mm", "20 mm", "25 mm", targets=target)


def test_truth_of_the_virtual_rig_changed_under_its_photographs(again: Path) -> None:
    rig = yaml.safe_load((again / "rig.yaml").read_text(encoding="utf-8"))
    rig["spheres"]["plastic"]["roughness"] = 0.3
    (again / "rig.yaml").write_text(yaml.safe_dump(rig), encoding="utf-8")
    refusal(again, "frames.zarr", "source", "move the folder away")


def test_lost_frame(again: Path) -> None:
    light = again / "captures/plastic/lights/050.00"
    chunk = light / "frames.zarr/550nm/c.3.1.0.0"
    assert chunk.is_file()
    chunk.unlink()
    shutil.rmtree(again / "results/plastic/mueller")
    refusal(again, "frames.zarr", "550nm", "lacks 1 of 72 frames", targets=RECEIPT)


def test_manifest_that_is_none(again: Path) -> None:
    manifest = again / "captures/plastic/lights/050.00/manifest.json"
    manifest.write_text(json.dumps({"schema": "something/else"}), encoding="utf-8")
    refusal(again, "manifest.json", "schema", "pbrdf/capture/1", targets=RECEIPT)
