"""After one light of ninety is retaken, a rerun spends at most a twentieth of what the whole run spent.

Run by ``make test-large``. What is spent is what Snakemake's benchmarks say, all jobs together.
"""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import pytest
from small_workflow import small_settings, snakemake, write_project
from straight_photographs import photograph

from pbrdf.settings.checked import check
from pbrdf.settings.plan import capture_plan
from pbrdf.settings.rig import read_rig

pytestmark = pytest.mark.skipif("PBRDF_LARGE" not in os.environ, reason="`make test-large` runs it")

CONFIG = ("--configfile", "config.yaml")


def spent_s(folder: Path) -> float:
    """Seconds of all benchmarks, which are removed."""
    total = 0.0
    for path in (folder / "benchmarks").rglob("*.tsv"):
        total += float(path.read_text(encoding="utf-8").splitlines()[1].split("\t")[0])
    shutil.rmtree(folder / "benchmarks")
    return total


def test_a_rerun_after_one_light_costs_a_twentieth(tmp_path: Path) -> None:
    settings = small_settings()
    settings["plan"] |= {
        "lights_deg": {"first": 6, "last": 175.1, "count": 90},
        "bands_nm": [450, 550, 650],
        "exposures_ms": [40],
    }
    settings["reconstruction"] = {"keep_images": []}
    config = write_project(tmp_path, settings)
    rig = read_rig(tmp_path / "rig.yaml")
    plan = capture_plan(check(settings, "config", config)["plan"], rig, config)
    photograph(plan, rig, config, "plastic", 25.0, tmp_path / "captures/plastic")
    whole = snakemake(tmp_path, *CONFIG)
    assert whole.returncode == 0, whole.stderr
    before = spent_s(tmp_path)

    manifest = tmp_path / "captures/plastic/lights/044.00/manifest.json"
    content = json.loads(manifest.read_text(encoding="utf-8"))
    manifest.write_text(json.dumps(content | {"digest": "0" * 64}), encoding="utf-8")
    again = snakemake(tmp_path, *CONFIG)
    assert again.returncode == 0, again.stderr
    after = spent_s(tmp_path)
    (Path(os.environ["PBRDF_LARGE"]) / "rerun.txt").write_text(
        f"{before:.1f} s, then {after:.1f} s: {100 * after / before:.1f} %\n", encoding="utf-8"
    )
    assert after <= 0.05 * before
