"""config/paper.yaml for one light, from photographs of 3376 × 2704 to its table, Mitsuba's file and the page.

Run by ``make test-large``: 15 GB of disk. The table is merged of 90 slices, which are that of
the one light moved to their places.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml
from growth import BANDS, CALIBRATIONS, ROOT, Size, measured, spent, spread_slices
from rig_truth import write_truth
from small_workflow import write_materials

from pbrdf.settings.checked import check
from pbrdf.settings.needs import Problem, needs
from pbrdf.settings.plan import capture_plan
from pbrdf.settings.rig import read_rig

pytestmark = pytest.mark.skipif("PBRDF_LARGE" not in os.environ, reason="`make test-large` runs it")

LIGHT = "044.00"
MOST_MIB = 6000 / 1.048576
SIZE = Size(2704, 90, len(BANDS))
PHOTOGRAPH = """
import sys
from dataclasses import replace
from pathlib import Path
from straight_photographs import photograph
from pbrdf.settings.checked import read_checked
from pbrdf.settings.plan import capture_plan
from pbrdf.settings.rig import read_rig
config, rig, light = sys.argv[1:]
plan = capture_plan(read_checked(config, "config")["plan"], read_rig(rig), config)
plan = replace(plan, lights=tuple(one for one in plan.lights if one.id == light))
photograph(plan, read_rig(rig), rig, "plastic", 25.0, "captures/plastic")
"""


@pytest.fixture(scope="module")
def folder() -> Path:
    """The folder that PBRDF_LARGE names: photographs that lie there already are not taken again."""
    folder = Path(os.environ["PBRDF_LARGE"]).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    config = yaml.safe_load((ROOT / "config/paper.yaml").read_text(encoding="utf-8"))
    kinds = (*CALIBRATIONS, "flat")
    config |= {"only": ["plastic"], "calibration": {kind: f"truth/{kind}.json" for kind in kinds}}
    (folder / "config.yaml").write_text(yaml.safe_dump(config), encoding="utf-8")
    for kind in kinds:
        write_truth(kind, read_rig(ROOT / config["rig"]), folder / "truth" / f"{kind}.json")
    for name in ("results", "benchmarks", ".snakemake"):
        shutil.rmtree(folder / name, ignore_errors=True)
    return folder


@pytest.fixture(scope="module")
def problem(folder: Path) -> Problem:
    config = check(yaml.safe_load((folder / "config.yaml").read_text(encoding="utf-8")), "config", "paper")
    plan = capture_plan(config["plan"], read_rig(ROOT / config["rig"]), "paper")
    fitting = config["fitting"]
    return Problem(
        len(plan.lights),
        len(plan.bands_nm),
        len(plan.states_deg),
        len(plan.exposures_s),
        plan.frames_per_light(),
        3376 * 2704,
        2,
        (91, 91, 361),
        fitting["downsample"] ** -3,
        fitting["starts"] + 1,
    )


def snakemake(folder: Path, *arguments: str) -> tuple[str, dict[str, Any]]:
    """What a run says, and what it spends."""
    profile = ("--workflow-profile", str(ROOT / "profiles/default"), "--cores", "2")
    command = [
        sys.executable,
        "-m",
        "snakemake",
        "--snakefile",
        str(ROOT / "Snakefile"),
        *profile,
        *arguments,
    ]
    with (folder / "run.log").open("w", encoding="utf-8") as log:
        figures = spent(command, cwd=folder, stdout=log, stderr=subprocess.STDOUT)
    return (folder / "run.log").read_text(encoding="utf-8"), figures


def peak_mb(benchmark: Path) -> float:
    """Largest memory that Snakemake saw of a job, MiB."""
    header, values = (line.split("\t") for line in benchmark.read_text(encoding="utf-8").splitlines()[:2])
    return float(dict(zip(header, values, strict=True))["max_rss"])


def test_one_light_end_to_end(folder: Path, problem: Problem) -> None:
    paths = os.pathsep.join(str(ROOT / name) for name in ("tools", "tests/workflow"))
    config, rig = str(folder / "config.yaml"), str(ROOT / "config/paper/rig.yaml")
    command = [sys.executable, "-c", PHOTOGRAPH, config, rig, LIGHT]
    spending = {"photographs": spent(command, cwd=folder, env={**os.environ, "PYTHONPATH": paths})}

    target = f"results/plastic/slices/{LIGHT}.json"
    said, spending["image and slice"] = snakemake(folder, target, "--configfile", config)
    assert "This run writes at most" in said
    for step in ("reconstruct", "slice"):
        seen = peak_mb(folder / f"benchmarks/{step}/plastic/{LIGHT}.tsv")
        assert seen * 1.048576 <= needs(step, problem).mem_mb

    table = folder / "results/table"
    shutil.copytree(folder / f"results/plastic/slices/{LIGHT}.zarr", table / "slices/0.zarr")
    shutil.copy(folder / target, table / "slices/0.json")
    spread_slices(table, SIZE)
    for step in ("tabulate", "export"):
        spending[step] = measured(step, table, SIZE)
        assert spending[step]["rss_mb"] * 1.048576 <= needs(step, problem).mem_mb

    write_materials(folder, ("paper", "table", "-", "-", str(table / "table.zarr"), "-"))
    settings = {"materials": "materials.tsv", "fitting": {"models": ["baek2018"]}}
    (folder / "page.yaml").write_text(yaml.safe_dump(settings), encoding="utf-8")
    _, spending["fit and page"] = snakemake(folder, "results/report", "--configfile", "page.yaml")

    (folder / "spent.txt").write_text("".join(f"{k}: {v}\n" for k, v in spending.items()), encoding="utf-8")
    assert all(figures["rss_mb"] < MOST_MIB for figures in spending.values()), spending


def test_all_lights_are_refused_where_the_disk_is_too_small(folder: Path, problem: Problem) -> None:
    if shutil.disk_usage(folder).free > problem.lights * problem.light_bytes:
        pytest.skip("the disk holds all photographs of a material")
    arguments = ("--configfile", str(folder / "config.yaml"), "--cores", "1")
    command = [sys.executable, "-m", "snakemake", "--snakefile", str(ROOT / "Snakefile"), *arguments]
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert run.returncode != 0
    assert "free, and this run writes" in run.stderr.rstrip().splitlines()[-1]
