"""What the small workflow makes, told at the terminal; two of its tables compared; figures for papers."""

from __future__ import annotations

import json
import re
import shutil
from importlib.util import find_spec
from pathlib import Path
from zipfile import ZipFile

import pytest
from small_workflow import snakemake

from pbrdf.cli import main

pytestmark = pytest.mark.workflow


def test_every_kind_of_file_is_told(finished: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made = [p for top in ("results", "captures") for p in (finished / top).rglob("*")]
    files = [p for p in made if p.suffix in (".json", ".jsonl", ".exr", ".pbsdf", ".csv", ".html")]
    files = [p for p in files if not any(parent.suffix == ".zarr" for parent in p.parents)]
    files += [p for p in made if p.suffix == ".zarr"]
    assert len(files) > 40
    for path in files:
        assert main(["info", str(path)]) == 0, path
        lines = capsys.readouterr().out.splitlines()
        assert lines[0].startswith(("kind ", "schema ")), path
        assert len(lines) >= 2, path


def test_a_recalibration_is_seen_as_a_difference(again: Path) -> None:
    """The table of before, kept under another name, beside one of another scale."""
    shutil.copytree(again / "results/plastic/table.zarr", again / "before.zarr")
    compare = ("compare", "--configfile", "config.yaml", "--config", "compare=[before.zarr,plastic]")
    run = snakemake(again, *compare)
    assert run.returncode == 0, run.stderr
    assert run.stdout.rstrip().endswith("results/comparisons/before_and_plastic.html")
    document = json.loads((again / "results/comparisons/before_and_plastic.json").read_text(encoding="utf-8"))
    assert document["tables"] == {"first": "before", "other": "plastic"}
    assert [band["scale"] for band in document["bands"]] == [1.0] * 5
    assert "Nothing to be done" in snakemake(again, *compare).stderr


def test_a_comparison_of_nothing_is_refused(finished: Path) -> None:
    run = snakemake(finished, "compare", "--configfile", "config.yaml")
    assert run.returncode != 0
    assert "config.yaml: compare: does not name two tables" in run.stderr.rstrip().splitlines()[-1]


def test_figures_and_renders_are_made_on_demand(again: Path) -> None:
    targets = [f"results/figures/plastic_curves.{kind}" for kind in ("pdf", "svg", "png")]
    targets += ["results/figures/session_monday_retardance.pdf"]
    if find_spec("mitsuba"):
        targets += ["results/renders/plastic.png"]
    run = snakemake(again, *targets, "--configfile", "config.yaml")
    assert run.returncode == 0, run.stderr
    assert all((again / target).stat().st_size > 5000 for target in targets)
    # what was asked for is in the report that is asked for with it
    archive = ("--configfile", "config.yaml", "--report", "report.zip")
    assert snakemake(again, "all", *targets, *archive).returncode == 0
    with ZipFile(again / "report.zip") as report:
        told = re.search(r"var categories = (.*);", report.read("report/report.html").decode())
    assert told is not None
    shown = [path for parts in json.loads(told[1]).values() for files in parts.values() for path in files]
    figures = {target for target in targets if target.endswith((".svg", "renders/plastic.png"))}
    assert figures | {"results/report/index.html", "results/comparison.csv"} <= set(shown)


def test_all_figures_are_a_target(finished: Path) -> None:
    run = snakemake(finished, "figures", "--configfile", "config.yaml", "--dry-run")
    assert run.returncode == 0, run.stderr
    for rule in ("material_figures", "retardance_figure", "elements_figure"):
        assert f"rule {rule}:" in run.stdout + run.stderr
