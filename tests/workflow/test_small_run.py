"""The whole chain on a small virtual rig: what is made, what reruns, what comes from outside."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from small_workflow import (
    TRUTH,
    rules_due,
    small_settings,
    snakemake,
    table_errors,
    write_materials,
    write_project,
)

import pbrdf
from pbrdf.formats.capture_store import FrameStore
from pbrdf.formats.mueller_exr import read_mueller_exr
from pbrdf.formats.table_data import Origin

pytestmark = pytest.mark.workflow

CONFIG = ("--configfile", "config.yaml")


def test_every_stage_leaves_what_it_promises(finished: Path) -> None:
    made = finished / "results"
    for name in (
        "calibration/monday/camera.json",
        "calibration/monday/polarimeter.json",
        "plastic/sphere.json",
        "plastic/mueller/050.00/550nm.exr",
        "plastic/slices/030.00.json",
        "plastic/table.zarr/zarr.json",
        "plastic/fit/baek2018.json",
        "plastic/comparison.json",
        "plastic/comparison.csv",
        "comparison.json",
        "comparison.csv",
        "plastic/plastic.pbsdf",
        "plastic/plastic_filled.pbsdf",
        "report/plastic.html",
        "report/index.html",
    ):
        assert (made / name).exists(), name
    assert not (made / "plastic/mueller/030.00").exists(), "images of lights that are not kept go"
    assert (made / "plastic/mueller/030.00.json").exists()


def test_page_says_that_calibrations_were_given(finished: Path) -> None:
    document = json.loads((finished / "results/calibration/monday/lights.json").read_text(encoding="utf-8"))
    assert document["source"] == "file"
    report = finished / "results/report"
    assert "lights</a> file" in (report / "plastic.html").read_text(encoding="utf-8")
    assert "Given as a file" in (report / "calibration_monday_lights.html").read_text(encoding="utf-8")


def test_page_names_digests_settings_and_versions(finished: Path) -> None:
    page = (finished / "results/report/plastic.html").read_text(encoding="utf-8")
    for name in (
        "calibration lights (SHA-256)",
        "reconstruction: margin_px",
        "tabulation: fill_sigma",
        "numpy",
    ):
        assert f"<dt>{name}</dt>" in page
    assert "<dt>fit baek2018</dt><dd>downsample 1, thinning nodes, cost norms" in page


def test_table_is_the_truth_where_it_was_measured(finished: Path) -> None:
    for error in table_errors(finished, "plastic").values():
        # 40 px across and lights 20° apart: this is about conventions and scale, not about finesse
        assert np.median(error) < 0.1


def test_raw_export_holds_measured_nodes_only(finished: Path) -> None:
    table = pbrdf.open_table(finished / "results/plastic/table.zarr").data
    raw = pbrdf.open_table(finished / "results/plastic/plastic.pbsdf").data
    filled = pbrdf.open_table(finished / "results/plastic/plastic_filled.pbsdf").data
    measured = table.origin == Origin.MEASURED
    np.testing.assert_array_equal(np.isfinite(raw.mueller[..., 0, 0]), measured)
    np.testing.assert_array_equal(filled.mueller, table.mueller)


def test_second_run_has_nothing_to_do(finished: Path) -> None:
    run = snakemake(finished, *CONFIG)
    assert run.returncode == 0, run.stderr
    assert "Nothing to be done" in run.stderr + run.stdout


def test_another_polarimeter_reruns_from_reconstruction_on(again: Path) -> None:
    document = json.loads((again / "results/calibration/monday/polarimeter.json").read_text(encoding="utf-8"))
    document["zeros_deg"]["generator_retarder"] += 0.5
    (again / "my.json").write_text(json.dumps(document), encoding="utf-8")
    settings = small_settings() | {"calibration": TRUTH | {"polarimeter": "my.json"}}
    (again / "config.yaml").write_text(yaml.safe_dump(settings), encoding="utf-8")
    due = rules_due(again)
    assert "capture_material" not in due
    assert {"take_calibration", "reconstruct", "slice", "tabulate", "fit", "material_page"} <= due

    run = snakemake(again, *CONFIG)
    assert run.returncode == 0, run.stderr
    given = json.loads((again / "results/calibration/monday/polarimeter.json").read_text(encoding="utf-8"))
    assert given["zeros_deg"] == document["zeros_deg"]


def test_changed_model_setting_reruns_the_fit_alone(again: Path) -> None:
    settings = small_settings()
    settings["fitting"]["seed"] = 7
    (again / "config.yaml").write_text(yaml.safe_dump(settings), encoding="utf-8")
    comparing = {"compare_fits", "compare_materials"}
    assert rules_due(again) == {"fit", "material_page", "index_page", "report_folder"} | comparing


def plan_with(**changes: Any) -> dict[str, Any]:
    settings = small_settings()
    settings["plan"] |= changes
    return settings


@pytest.mark.parametrize(
    "settings",
    [
        plan_with(bands_nm=[450, 500, 550, 600]),
        plan_with(states={"count": 40, "step_deg": 4.5, "ratio": 5}),
        plan_with(exposures_ms=[5, 60]),
        plan_with(darks=3),
    ],
    ids=["bands", "states", "exposures", "darks"],
)
def test_changed_plan_is_seen_and_never_mixes_with_what_was_taken(
    again: Path, settings: dict[str, Any]
) -> None:
    (again / "config.yaml").write_text(yaml.safe_dump(settings), encoding="utf-8")
    run = snakemake(again, *CONFIG)
    assert run.returncode != 0
    assert "the frames there were taken with" in run.stderr.rstrip().splitlines()[-1]


def test_added_light_is_the_only_one_worked_on(again: Path) -> None:
    settings = plan_with(lights_deg=[30, 50, 70, 80, 90])
    (again / "config.yaml").write_text(yaml.safe_dump(settings), encoding="utf-8")
    # measuring is an invocation of its own: within one, all that follows a job that ran runs again
    assert snakemake(again, "capture", *CONFIG).returncode == 0
    run = snakemake(again, *CONFIG, "--dry-run")
    assert re.findall(r"wildcards: material=plastic, light=(\S+)", run.stderr + run.stdout) == [
        "080.00",
        "080.00",
    ]


def test_the_supplements_mapping_gives_a_table_of_the_same_material(again: Path) -> None:
    settings = small_settings()
    settings["tabulation"] |= {"mapping": "paper", "slips": ["theta_h"]}
    (again / "config.yaml").write_text(yaml.safe_dump(settings), encoding="utf-8")
    run = snakemake(again, "results/plastic/table.json", *CONFIG)
    assert run.returncode == 0, run.stderr
    table = pbrdf.open_table(again / "results/plastic/table.zarr").data
    assert np.degrees(table.theta_h[-1]) == pytest.approx((11 / 12) ** 2 * 90)
    assert (table.origin == Origin.MEASURED).any()
    for error in table_errors(again, "plastic").values():
        # lights 20° apart are up to 10° from a bin's own
        assert np.median(error) < 0.2


def test_another_sphere_in_the_rig_is_no_reason(again: Path) -> None:
    rig = yaml.safe_load((again / "rig.yaml").read_text(encoding="utf-8"))
    rig["spheres"]["jade"] = rig["spheres"]["plastic"]
    (again / "rig.yaml").write_text(f"# a comment\n{yaml.safe_dump(rig)}", encoding="utf-8")
    assert rules_due(again) == set()


def test_image_kept_later_is_made(again: Path) -> None:
    settings = small_settings() | {"reconstruction": {"keep_images": ["050.00", "070.00"]}}
    (again / "config.yaml").write_text(yaml.safe_dump(settings), encoding="utf-8")
    run = snakemake(again, *CONFIG)
    assert run.returncode == 0, run.stderr
    assert (again / "results/plastic/mueller/070.00/550nm.exr").is_file()


def test_one_core_makes_lost_results_again_with_the_same_bytes(again: Path) -> None:
    results = again / "results/plastic"
    before = {path: path.read_bytes() for path in results.rglob("*") if path.suffix in (".json", ".pbsdf")}
    shutil.rmtree(results)
    run = snakemake(again, *CONFIG, "--cores", "1")
    assert run.returncode == 0, run.stderr
    assert {path: path.read_bytes() for path in before} == before


def test_photographs_from_anywhere_give_the_same_table(finished: Path, tmp_path: Path) -> None:
    write_project(tmp_path)
    for light in sorted((finished / "captures/plastic/lights").iterdir()):
        store = FrameStore.open(light / "frames.zarr")
        header, everything = store.header, slice(None)
        dark = store.read_dark(everything, everything)
        pbrdf.write_capture(
            tmp_path / "elsewhere",
            material="jade",
            angle_deg=header.angle_deg,
            frames={nm: store.read_band(nm, everything, everything) for nm in header.bands_nm},
            states_deg=header.states_deg,
            exposures_s=header.exposures_s,
            dark=dark,
            saturation=header.saturation,
            adc_bits=header.adc_bits,
            shift=header.shift,
        )
    write_materials(tmp_path, ("jade", "capture", "monday", "25", "elsewhere", "-"))
    run = snakemake(tmp_path, "results/jade/table.json", *CONFIG)
    assert run.returncode == 0, run.stderr
    theirs = pbrdf.open_table(tmp_path / "results/jade/table.zarr").data
    ours = pbrdf.open_table(finished / "results/plastic/table.zarr").data
    np.testing.assert_array_equal(theirs.mueller, ours.mueller)


def test_kept_image_holds_sphere_and_its_place(finished: Path) -> None:
    image = read_mueller_exr(finished / "results/plastic/mueller/050.00/650nm.exr")
    assert image.mueller.shape == image.variance.shape
    assert 40 <= image.mueller.shape[1] <= 48
    assert image.first[0] < 6
    assert image.header["units"] == "DN/s"
    np.testing.assert_array_equal(np.isfinite(image.mueller).all(axis=0), image.missing == 0)
