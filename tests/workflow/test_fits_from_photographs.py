"""A sphere of Hyde's model, photographed, tabulated and fitted: the model comes back.

A sphere of Baek's is in the default run (`test_fresh_clone`).
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml
from rig_truth import write_truth
from small_workflow import ROOT, TRUTH, small_settings, snakemake, write_materials

from pbrdf.fitting import read_fit
from pbrdf.settings.rig import read_rig

pytestmark = pytest.mark.workflow

BAND = 550
TOLD = {"index": 1.5, "specular": 1.0, "albedo": 0.3}
ROUGHNESS = 0.15


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of a sphere photographed in one band with the default rig's camera and lights."""
    folder = tmp_path_factory.mktemp("hyde")
    rig = yaml.safe_load((ROOT / "config/rig/virtual.yaml").read_text(encoding="utf-8"))
    rig["filters_nm"] = [BAND]
    sphere = {"model": "hyde2009", "roughness": ROUGHNESS, "bands": {str(BAND): TOLD}}
    rig["spheres"] = {"gaussian": sphere}
    (folder / "rig.yaml").write_text(yaml.safe_dump(rig), encoding="utf-8")
    for kind, path in TRUTH.items():
        write_truth(kind, read_rig(folder / "rig.yaml"), folder / path)
    write_materials(folder, ("gaussian", "rig", "monday", "25", "-", "-"))
    settings = small_settings()
    settings["plan"] |= {"lights_deg": {"first": 8, "last": 170, "count": 28}, "bands_nm": [BAND]}
    settings["tabulation"] = {"theta_h": 46, "theta_d": 46, "phi_d": 181}
    settings["reconstruction"] = {"keep_images": []}
    settings["fitting"] = {"models": ["baek2018", "hyde2009"], "downsample": 2, "starts": 1}
    (folder / "config.yaml").write_text(yaml.safe_dump(settings), encoding="utf-8")
    run = snakemake(folder, "results/comparison.json", "--configfile", "config.yaml")
    assert run.returncode == 0, run.stderr
    return folder / "results"


def test_the_model_of_a_photographed_sphere_is_found(results: Path) -> None:
    found = read_fit(results / "gaussian/fit/hyde2009.json").band(0)
    assert found["sigma"] == pytest.approx(ROUGHNESS, rel=0.02)
    assert found["eta"] == pytest.approx(TOLD["index"], abs=0.01)
    assert found["albedo"] == pytest.approx(TOLD["albedo"], rel=0.01)


def test_the_model_that_the_sphere_was_made_of_is_nearest(results: Path) -> None:
    content = json.loads((results / "comparison.json").read_text(encoding="utf-8"))
    (material,) = content["materials"]
    costs = {model["model"]: model["held_out"]["cost"]["per_node"] for model in material["models"]}
    assert min(costs, key=lambda name: costs[name]) == "hyde2009"
