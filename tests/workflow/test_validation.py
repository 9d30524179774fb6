"""`snakemake validation` on a small virtual rig: elements in the beam, measured beside ideal."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from small_workflow import small_settings, snakemake, write_materials, write_project

from pbrdf.formats.pbsdf import write_pbsdf
from pbrdf.formats.table_data import TableData
from pbrdf.optics.elements import IDEAL
from pbrdf.reconstruction.validation import BEYOND_NOISE
from pbrdf.tabulation.axes import table_axes

pytestmark = pytest.mark.workflow

TARGET = ("validation", "--configfile", "config.yaml")


def write_validation_project(folder: Path, **rig_changes: Any) -> None:
    """Two bands and a drifting lamp; the polarimeter is measured, all else is from files."""
    settings = small_settings()
    settings["plan"] |= {"bands_nm": [450, 550], "darks": 4, "references": 3}
    del settings["calibration"]["polarimeter"]
    write_project(folder, settings, **rig_changes)
    rig = yaml.safe_load((folder / "rig.yaml").read_text(encoding="utf-8"))
    rig["camera"]["focal_px"] = 1600
    assert rig["lamp_drift"]["amplitude"] >= 0.01
    (folder / "rig.yaml").write_text(yaml.safe_dump(rig), encoding="utf-8")


@pytest.fixture(scope="module")
def validated(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Folder of a finished validation, and what the run said."""
    folder = tmp_path_factory.mktemp("validation")
    write_validation_project(folder)
    run = snakemake(folder, *TARGET)
    assert run.returncode == 0, run.stderr
    return folder, run.stdout


@pytest.fixture(scope="module")
def document(validated: tuple[Path, str]) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(
        (validated[0] / "results/validation/monday.json").read_text(encoding="utf-8")
    )
    return content


def ways(document: dict[str, Any], way: str) -> dict[str, list[dict[str, Any]]]:
    """Figures of each band, by element."""
    return {
        name: [band[way] for band in element["bands_nm"].values()]
        for name, element in document["elements"].items()
    }


def test_all_elements_are_measured_in_all_bands(document: dict[str, Any]) -> None:
    assert list(document["elements"]) == list(IDEAL)
    for element in document["elements"].values():
        assert list(element["bands_nm"]) == ["450", "550"]


def test_the_polarimeter_is_measured(validated: tuple[Path, str], document: dict[str, Any]) -> None:
    assert document["calibrations"]["polarimeter"] == "measured"
    path = validated[0] / "results/calibration/monday/polarimeter.json"
    bands = json.loads(path.read_text(encoding="utf-8"))["bands"]
    rig = yaml.safe_load((validated[0] / "rig.yaml").read_text(encoding="utf-8"))
    for name in ("450", "550"):
        for module in ("generator", "analyser"):
            waves = rig["polarimeter"][f"{module}_retardance_waves"][name]
            assert bands[name][f"{module}_retardance_deg"] == pytest.approx(360 * waves, abs=0.1)


def test_calibrated_deviations_are_noise(document: dict[str, Any]) -> None:
    for bands in ways(document, "calibrated").values():
        for band in bands:
            assert band["deviation_max_in_standard_errors"] < BEYOND_NOISE
            # a hundredth would be a third of a degree
            assert band["deviation_max"] < 0.004
            assert band["deviation_rms_of_noise"] < 0.002
            assert band["pixels"] > 150
    assert "What is left is noise" in document["verdict"]


def test_uncalibrated_deviations_are_clearly_larger(document: dict[str, Any]) -> None:
    """Zeros of a degree turn what is linear by about 0.1; circular polarisers do not feel them."""
    calibrated, uncalibrated = (ways(document, way) for way in ("calibrated", "uncalibrated"))
    for element in ("air", "LPH", "LPV"):
        for ours, plain in zip(calibrated[element], uncalibrated[element], strict=True):
            assert plain["deviation_max"] > 0.05
            assert plain["deviation_max"] > 10 * ours["deviation_max"]
            assert plain["deviation_rms"] > 10 * ours["deviation_rms"]


def test_the_page_leads_to_those_of_the_calibrations(validated: tuple[Path, str]) -> None:
    report = validated[0] / "results/pages"
    links = re.findall(r'href="([^"]*)"', (report / "validation_monday.html").read_text(encoding="utf-8"))
    assert links == [f"calibration_monday_{kind}.html" for kind in ("polarimeter", "radiometry", "lights")]
    assert all((report / link).is_file() for link in links)
    assert "Residual maps" in (report / links[0]).read_text(encoding="utf-8")


def test_the_run_ends_with_the_pages_path(validated: tuple[Path, str]) -> None:
    folder, said = validated
    page = folder / "results/pages/validation_monday.html"
    assert said.rstrip().splitlines()[-1] == str(page)
    html = page.read_text(encoding="utf-8")
    assert re.findall(r'alt="(\d+) nm: Mueller matrices', html) == ["550", "450"]


def test_elements_lie_beside_materials_captures_and_nothing_is_taken_twice(
    validated: tuple[Path, str],
) -> None:
    folder, _ = validated
    for element in IDEAL:
        assert (folder / f"captures/_sessions/monday/{element}/lights/180.00/manifest.json").is_file()
    assert not (folder / "captures/plastic").exists(), "a validation needs no material"
    run = snakemake(folder, *TARGET, "--dry-run")
    assert "Nothing to be done" in run.stdout + run.stderr


def test_the_elements_are_a_figure_for_papers(validated: tuple[Path, str]) -> None:
    target = "results/figures/session_monday_elements.pdf"
    run = snakemake(validated[0], target, "--configfile", "config.yaml")
    assert run.returncode == 0, run.stderr
    assert (validated[0] / target).read_bytes().startswith(b"%PDF")


def test_an_arm_that_does_not_reach_the_beam_is_refused(tmp_path: Path) -> None:
    write_validation_project(tmp_path, arm={"radius_mm": 800, "limits_deg": [5, 175]})
    run = snakemake(tmp_path, *TARGET)
    assert run.returncode != 0
    line = run.stderr.rstrip().splitlines()[-1]
    assert line.startswith("rig.yaml: arm.limits_deg: are 5…175°")
    assert "Traceback" not in run.stderr


def test_a_config_that_photographs_nothing_has_nothing_to_validate(tmp_path: Path) -> None:
    axes = table_axes(4, 4, 5)
    bands = np.array([450.0, 500, 550, 600, 650])
    ones = np.ones((5, *axes.shape, 4, 4), np.float32)
    write_pbsdf(
        tmp_path / "jade.pbsdf", TableData("here", bands, axes.theta_h, axes.theta_d, axes.phi_d, ones)
    )
    write_materials(tmp_path, ("jade", "table", "-", "-", "jade.pbsdf", "-"))
    (tmp_path / "config.yaml").write_text("materials: materials.tsv\n", encoding="utf-8")
    run = snakemake(tmp_path, *TARGET)
    assert run.returncode != 0
    assert "config.yaml: rig: photographs no material" in run.stderr.rstrip().splitlines()[-1]
