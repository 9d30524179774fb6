"""The main job as a newcomer starts it: a bare `snakemake` in a fresh clone."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from small_workflow import ROOT

import pbrdf
from pbrdf.fitting import read_fit
from pbrdf.formats.table_data import Origin
from pbrdf.models import MODELS
from pbrdf.optics.rusinkiewicz import directions

pytestmark = pytest.mark.workflow

SPHERES = ("plastic", "gold")


def bare_snakemake(folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "snakemake"], cwd=folder, capture_output=True, text=True, check=False
    )


@pytest.fixture(scope="module")
def clone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A fresh clone in which a bare `snakemake` has run."""
    folder = tmp_path_factory.mktemp("newcomer") / "pbrdf"
    subprocess.run(["git", "clone", "--quiet", str(ROOT), str(folder)], check=True)
    run = bare_snakemake(folder)
    assert run.returncode == 0, run.stderr
    assert " left" in run.stderr, "progress with time left"
    last = [folder / "results/report/index.html"]
    last += [folder / f"results/{name}/{name}{kind}.pbsdf" for name in SPHERES for kind in ("", "_filled")]
    assert run.stdout.rstrip().splitlines()[-5:] == [str(path) for path in last]
    assert all(path.is_file() for path in last)
    return folder


def test_second_run_has_nothing_to_do(clone: Path) -> None:
    assert "Nothing to be done" in bare_snakemake(clone).stderr


def test_fits_find_the_spheres_of_the_virtual_rig(clone: Path) -> None:
    rig = yaml.safe_load((clone / "config/rig/virtual.yaml").read_text(encoding="utf-8"))
    truth = rig["spheres"]["plastic"]
    fit = read_fit(clone / "results/plastic/fit/baek2018.json")
    fitted = [fit.band(band) for band in range(5)]
    assert fitted[0]["alpha"] == pytest.approx(truth["roughness"], rel=0.02)
    for band, at in zip(fitted, truth["bands"].values(), strict=True):
        assert band["eta"] == pytest.approx(at["index"], abs=0.01)
        assert band["albedo"] == pytest.approx(at["albedo"], rel=0.01)
    gold = read_fit(clone / "results/gold/fit/baek2018.json")
    # a real index has no M23 and M32: what remains there is the size of gold's own
    assert np.array(gold.residuals.relative)[2, 2, 3] > 0.3
    assert "A real index has M23 = M32 = 0 and cannot follow" in " ".join(gold.remarks)
    page = (clone / "results/report/gold.html").read_text(encoding="utf-8")
    assert "A real index has M23 = M32 = 0 and cannot follow" in page
    metal = read_fit(clone / "results/gold/fit/baek2018_complex.json")
    for band, at in enumerate(rig["spheres"]["gold"]["bands"].values()):
        assert metal.band(band)["eta"] == pytest.approx(at["index"], rel=0.02)
        assert metal.band(band)["kappa"] == pytest.approx(at["extinction"], rel=0.02)


@pytest.mark.parametrize("name", SPHERES)
def test_table_is_the_truth_element_by_element(clone: Path, name: str) -> None:
    rig = yaml.safe_load((clone / "config/rig/virtual.yaml").read_text(encoding="utf-8"))
    sphere = rig["spheres"][name]
    table = pbrdf.open_table(clone / f"results/{name}/table.zarr").data
    assert table.origin is not None
    assert table.variance is not None
    grid = np.meshgrid(table.theta_h, table.theta_d, table.phi_d, indexing="ij")
    to_light, to_camera = directions(*grid)
    for band, nm in enumerate(table.wavelengths_nm):
        at = sphere["bands"][str(int(nm))]
        known = (table.origin[band] == Origin.MEASURED) & (grid[1] > 0)
        parameters = {"alpha": sphere["roughness"], "eta": at["index"], "kappa": at.get("extinction", 0.0)}
        parameters |= {key: at[key] for key in ("specular", "albedo")}
        truth = MODELS["baek2018"].evaluate(to_light[known], to_camera[known], parameters)
        first = truth[:, :1, :1]
        measured = table.mueller[band][known]
        # the slope of measured over true, where an element has a size at all: a wrong sign is −1
        size = np.sqrt(np.mean((truth / first) ** 2, axis=0))
        slope = np.mean(measured * truth / first**2, axis=0)[size > 0.03] / size[size > 0.03] ** 2
        np.testing.assert_allclose(slope, 1.0, atol=0.02)
        # elements that are small by symmetry hold nothing but noise: as much as the variance says, where a
        # node and its symmetric partners lie some pixels apart and so are measurements of their own
        apart = known & (grid[0] > np.radians(6))
        noise = ((measured - truth) / np.sqrt(table.variance[band][known]))[apart[known]]
        spread = 1.4826 * np.median(np.abs(noise), axis=0)
        np.testing.assert_allclose(spread[[0, 0, 2, 3], [2, 3, 0, 0]], 1.0, atol=0.1)
