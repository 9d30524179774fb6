"""Snakemake and its jobs killed in every stage: the same command again ends in the bytes of a quiet run."""

from __future__ import annotations

import csv
import os
import random
import re
import shutil
import subprocess
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import psutil
import pytest
import yaml
from small_workflow import command_line, results, rules_due, small_settings, snakemake

pytestmark = pytest.mark.workflow

KILLS = int(os.environ.get("PBRDF_KILLS", "10"))
"""Of all stages together; `make test-faults` asks for 100."""
CONFIG = ("--configfile", "config.yaml")
SCRIPT = re.compile(r"/\.snakemake/scripts/\w+\.(\w+)\.py$")


@dataclass(frozen=True)
class Project:
    """What is killed.

    Attributes
    ----------
    share : float
        Its part of all kills.
    targets : tuple of str
        What is asked for; by default everything.
    redone : str
        The folder that is removed first.
    scripts : tuple of str
        Of its jobs, in about the order in which a run comes to them.
    """

    share: float
    targets: tuple[str, ...]
    redone: str
    scripts: tuple[str, ...]


PROJECTS = {
    "measured": Project(
        share=0.2,
        targets=("results/calibration/monday/radiometry.json",),
        redone="results",
        scripts=(
            "calibrate_camera",
            "calibrate_polarimeter",
            "calibrate_flat",
            "calibrate_lights",
            "calibrate_radiometry",
        ),
    ),
    "finished": Project(
        share=0.8,
        targets=(),
        redone="results/plastic",
        scripts=(
            "reconstruct",
            "slice",
            "tabulate",
            "export",
            "fit",
            "compare_fits",
            "material_page",
            "report_folder",
        ),
    ),
}
"""By the fixture of what is finished."""
VICTIMS = ("job", "snakemake")
KILLS_A_ROUND = 20
MOST_ROUNDS = 10 + KILLS // 5
"""A run may end before its job was to be killed: then there is another round."""
HEAD = """# Kills

Of the last `make test-faults`. The same command, given again after each of them (after `--unlock` where
Snakemake was killed), ended in the bytes of a quiet run.

| killed during | the job | Snakemake |
|---|---|---|
"""
UNTIMED_S = 2.0
"""A job that Snakemake does not time."""


@pytest.fixture(scope="module")
def told() -> Iterator[Counter[tuple[str, str]]]:
    """Kills by script and by what was killed; written where `PBRDF_KILLS_TOLD` says."""
    kills: Counter[tuple[str, str]] = Counter()
    yield kills
    if "PBRDF_KILLS_TOLD" in os.environ:
        scripts = [script for project in PROJECTS.values() for script in project.scripts]
        rows = [(script, *(kills[script, victim] for victim in VICTIMS)) for script in scripts]
        rows.append(("all", *(sum(column) for column in list(zip(*rows, strict=True))[1:])))
        lines = "".join(f"| `{script}` | {jobs} | {engines} |\n" for script, jobs, engines in rows)
        Path(os.environ["PBRDF_KILLS_TOLD"]).write_text(HEAD + lines, encoding="utf-8")


def at_work(run: subprocess.Popen[bytes]) -> dict[str, psutil.Process]:
    """Jobs of a run by the names of their scripts."""
    jobs: dict[str, psutil.Process] = {}
    if run.poll() is not None:
        return jobs
    for process in psutil.Process(run.pid).children(recursive=True):
        # it may have ended meanwhile
        with suppress(psutil.Error):
            script = SCRIPT.search(" ".join(process.cmdline()))
            if script:
                jobs[script[1]] = process
    return jobs


def seconds_of(folder: Path, script: str) -> float:
    """How long the longest job of a script took in the quiet run."""
    times = []
    for file in (folder / "benchmarks" / script).rglob("*.tsv"):
        with file.open(encoding="utf-8") as stream:
            times += [float(row["s"]) for row in csv.DictReader(stream, delimiter="\t")]
    return max(times, default=UNTIMED_S)


def kill_in(
    quiet: Path, folder: Path, project: Project, first: int, chance: random.Random, hit: Counter[str]
) -> tuple[str, str] | None:
    """Run until a script from the first on is at work, and kill it or Snakemake at a random moment.

    Of several at work the one that was hit least, by `hit`, is taken. Gives the script that was at work
    then, and what was killed; None if the run ended before.
    """
    command = command_line(*project.targets, *CONFIG)
    victim, share = chance.choice(VICTIMS), chance.uniform(0.0, 1.0)
    run = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    awaited = set(project.scripts[first:])
    begun: set[str] = set()
    while run.poll() is None and not begun:
        time.sleep(0.1)
        begun = awaited & at_work(run).keys()
    if begun:
        time.sleep(share * min(seconds_of(quiet, script) for script in begun))
    killed = None
    while run.poll() is None and killed is None:
        jobs = at_work(run)
        here = jobs.keys() & set(project.scripts)
        if here:
            script = min(sorted(begun & here or here), key=lambda name: hit[name])
            (jobs[script] if victim == "job" else run).kill()
            killed = script, victim
    run.wait()
    return killed


@pytest.mark.parametrize("name", PROJECTS)
def test_killed_runs_end_in_the_bytes_of_a_quiet_one(
    name: str, tmp_path: Path, request: pytest.FixtureRequest, told: Counter[tuple[str, str]]
) -> None:
    quiet: Path = request.getfixturevalue(name)
    project = PROJECTS[name]
    chance, wanted, killed = random.Random(name), round(project.share * KILLS), 0
    hit: Counter[str] = Counter()
    for _ in range(MOST_ROUNDS):
        folder = tmp_path / "again"
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(quiet, folder)
        shutil.rmtree(folder / project.redone)
        rarely = [1 / (1 + hit[script]) for script in project.scripts]
        places = chance.choices(range(len(project.scripts)), rarely, k=min(KILLS_A_ROUND, wanted - killed))
        kills: Counter[tuple[str, str]] = Counter()
        for first in sorted(places):
            kill = kill_in(quiet, folder, project, first, chance, hit)
            if kill is None:
                break
            kills[kill] += 1
            hit[kill[0]] += 1
            if kill[1] == "snakemake":
                # what its message says
                assert snakemake(folder, *CONFIG, "--unlock").returncode == 0
        run = snakemake(folder, *project.targets, *CONFIG)
        assert run.returncode == 0, run.stderr
        made, expected = results(folder), results(quiet)
        assert made == {path: expected.get(path) for path in made}
        assert project.targets or made.keys() == expected.keys()
        told.update(kills)
        killed += kills.total()
        if killed >= wanted:
            break
    assert killed >= wanted


def test_what_a_killed_job_was_to_change_is_still_due(again: Path) -> None:
    """It lost its old output and Snakemake's record of it, and what was made from that is there still."""
    edited = small_settings()
    edited["fitting"]["seed"] = 7
    (again / "config.yaml").write_text(yaml.safe_dump(edited), encoding="utf-8")
    due = rules_due(again)
    run = subprocess.Popen(
        command_line(*CONFIG), cwd=again, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    while run.poll() is None and "fit" not in at_work(run):
        time.sleep(0.05)
    at_work(run)["fit"].kill()
    assert run.wait() != 0
    assert "fit" in due
    assert rules_due(again) == due
