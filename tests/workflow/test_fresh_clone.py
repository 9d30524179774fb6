"""The main job as a newcomer starts it: a bare `snakemake` in a fresh clone."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from small_workflow import ROOT

from pbrdf.fitting import read_fit

pytestmark = pytest.mark.workflow


def bare_snakemake(folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "snakemake"], cwd=folder, capture_output=True, text=True, check=False
    )


def test_bare_snakemake_in_a_fresh_clone(tmp_path: Path) -> None:
    clone = tmp_path / "pbrdf"
    subprocess.run(["git", "clone", "--quiet", str(ROOT), str(clone)], check=True)
    run = bare_snakemake(clone)
    assert run.returncode == 0, run.stderr
    assert " left" in run.stderr, "progress with time left"
    index = clone / "results/report/index.html"
    assert run.stdout.rstrip().splitlines()[-5:][0] == str(index)
    for name in ("plastic", "gold"):
        assert (clone / f"results/report/{name}.html").is_file()
        assert (clone / f"results/{name}/{name}.pbsdf").is_file()

    rig = yaml.safe_load((clone / "config/rig/virtual.yaml").read_text(encoding="utf-8"))
    truth = rig["spheres"]["plastic"]
    fit = read_fit(clone / "results/plastic/fit/baek2018.json")
    fitted = [fit.band(band) for band in range(5)]
    assert fitted[0]["alpha"] == pytest.approx(truth["roughness"], rel=0.02)
    for band, at in zip(fitted, truth["bands"].values(), strict=True):
        assert band["eta"] == pytest.approx(at["index"], abs=0.02)
        assert band["albedo"] == pytest.approx(at["albedo"], rel=0.01)
    gold = read_fit(clone / "results/gold/fit/baek2018.json")
    # a real index has no M23 and M32: what remains there is the size of gold's own
    assert np.array(gold.residual_relative)[2, 2, 3] > 0.3

    second = bare_snakemake(clone)
    assert "Nothing to be done" in second.stderr
