"""Mitsuba's own materials photographed, tabulated, exported and loaded: what comes back is what went in."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from small_workflow import ROOT, TRUTH, small_settings, snakemake, write_project

from pbrdf.settings.materials import COLUMNS
from pbrdf.tabulation.closed_loop import ClosedLoop

pytest.importorskip("mitsuba", reason="Mitsuba is not installed: pip install 'pbrdf[mitsuba]'")
pytestmark = pytest.mark.workflow

MATERIALS = ("pplastic", "roughconductor", "loaded")
BANDS = [450, 500, 550, 600, 650]


@pytest.fixture(scope="module")
def around(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which the closed loop has run: 96 px, five lights, calibrations from files."""
    folder = tmp_path_factory.mktemp("closed")
    settings = small_settings()
    settings["plan"] |= {"lights_deg": [56, 64, 72, 80, 88], "exposures_ms": [20], "darks": 8}
    # the least of a dual rotating retarder: 16 pairs of angles
    quarter = [-51.7, -15.1, 15.1, 51.7]
    settings["plan"]["states"] = [[0.0, g, a, 90.0] for g in quarter for a in quarter]
    settings["reconstruction"] = {}
    settings["tabulation"] = {"theta_h": 46, "theta_d": 46, "phi_d": 91, "widest_gap_deg": 5}
    rig = yaml.safe_load((ROOT / "config/closed_loop/rig.yaml").read_text(encoding="utf-8"))
    camera = rig["camera"] | {"rows": 96, "columns": 96, "focal_px": 1800, "principal_px": [47.6, 47.9]}
    config = write_project(folder, settings, camera=camera, samples=1, spheres=rig["spheres"])
    rows = [COLUMNS, *((name, "rig", "monday", "25", "-", "-") for name in MATERIALS)]
    (folder / "materials.tsv").write_text("".join("\t".join(row) + "\n" for row in rows), encoding="utf-8")
    run = snakemake(folder, "closed_loop", "--configfile", config.name)
    assert run.returncode == 0, run.stderr
    assert settings["calibration"] == TRUTH
    assert run.stdout.rstrip().splitlines()[-1] == str(folder / "results/pages/closed_loop.html")
    return folder


@pytest.mark.parametrize("material", MATERIALS)
def test_every_element_comes_back(around: Path, material: str) -> None:
    """What is left is the noise of 16 states in one exposure; elements of `loaded` are a tenth of M00."""
    loop = ClosedLoop.read(around / f"results/closed_loop/{material}.json")
    assert list(loop.bands) == BANDS
    assert loop.directions > 12_000
    for exports in loop.bands.values():
        found = exports["measured"]
        # lights over 32° of the arm's turn show θd of 16°; gold's highlight saturates in the red
        assert 0.09 < found.covered < 0.25
        assert found.median < 0.04
        assert found.p90 < 0.12
        assert found.element_median.max() < 0.02
        assert exports["filled"].covered > 0.95


def test_the_page_shows_each_material_and_element(around: Path) -> None:
    page = (around / "results/pages/closed_loop.html").read_text(encoding="utf-8")
    for material in MATERIALS:
        assert f"<h3>{material}</h3>" in page
    assert page.count("M3") >= 3
    assert "filename sixteen_elements.pbsdf" in page


def test_a_config_without_five_bands_of_a_virtual_sphere_is_refused(tmp_path: Path) -> None:
    settings = small_settings()
    settings["plan"]["bands_nm"] = [550]
    write_project(tmp_path, settings)
    run = snakemake(tmp_path, "closed_loop", "--configfile", "config.yaml")
    assert run.returncode != 0
    line = run.stderr.rstrip().splitlines()[-1]
    assert "config.yaml: rig: photographs no virtual sphere in five bands" in line
