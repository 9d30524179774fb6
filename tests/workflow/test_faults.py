"""A full disk, a folder that cannot be written, two runs at once, a clock set back, an edited config."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import yaml
from small_workflow import command_line, results, rules_due, small_settings, snakemake

pytestmark = pytest.mark.workflow

CONFIG = ("--configfile", "config.yaml")
STAGES = {
    "report": ("report", "pages/index.html", "pages/plastic.html", "pages/values"),
    "fit": ("plastic/fit", "plastic/plastic.pbsdf", "plastic/plastic_filled.pbsdf"),
    "table": ("plastic/table.zarr", "plastic/table.json"),
    "slices": ("plastic/slices",),
    "reconstruction": ("plastic/mueller",),
    "calibration": ("calibration", "plastic/sphere.json"),
}
"""Results of each stage, the last stage first."""


def mount(folder: Path, options: str) -> None:
    """Mount memory as a disk of its own, or change how it is mounted."""
    command = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(folder)]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    if run.returncode:
        pytest.skip(f"this user may not mount a small disk: {run.stderr.strip()}")


@pytest.fixture
def disk(finished: Path, tmp_path: Path) -> Iterator[Path]:
    """A copy of the finished folder, its results on a disk of their own."""
    folder = tmp_path / "again"
    shutil.copytree(finished, folder, ignore=lambda place, _: ["results"] if Path(place) == finished else [])
    place = folder / "results"
    place.mkdir()
    mount(place, "size=100m")
    try:
        shutil.copytree(finished / "results", place, dirs_exist_ok=True)
        yield folder
    finally:
        subprocess.run(["umount", str(place)], check=True)


@contextmanager
def begun(folder: Path, sign: str) -> Iterator[subprocess.Popen[bytes]]:
    """A run that has said a word; what it says goes to the file `said`."""
    with (folder / "said").open("wb") as said:
        run = subprocess.Popen(
            command_line(*CONFIG), cwd=folder, stdout=said, stderr=said, start_new_session=True
        )
    try:
        while sign not in (folder / "said").read_text(encoding="utf-8") and run.poll() is None:
            time.sleep(0.05)
        yield run
    finally:
        run.wait()


@contextmanager
def held(run: subprocess.Popen[bytes]) -> Iterator[None]:
    """The run and its jobs stand still; none of the files that another looks at vanishes meanwhile."""
    os.killpg(run.pid, signal.SIGSTOP)
    try:
        yield
    finally:
        os.killpg(run.pid, signal.SIGCONT)


def refusal(folder: Path, run: subprocess.Popen[bytes]) -> str:
    """Last line of a run that must not succeed."""
    assert run.wait() != 0
    told = (folder / "said").read_text(encoding="utf-8")
    assert "Traceback" not in told, told
    return told.rstrip().splitlines()[-1]


def remove(folder: Path, names: tuple[str, ...]) -> None:
    for name in names:
        path = folder / "results" / name
        shutil.rmtree(path) if path.is_dir() else path.unlink()


def test_a_disk_full_in_each_stage_ends_in_a_line_and_a_rerun_in_the_same_bytes(
    disk: Path, finished: Path
) -> None:
    place = disk / "results"
    for stage, names in STAGES.items():
        remove(disk, names)
        before = results(disk)
        used = os.statvfs(place)
        # a run that begins without room is refused at once
        with begun(disk, "This run writes") as run:
            mount(place, f"remount,size={(used.f_blocks - used.f_bfree) * used.f_frsize}")
        line = refusal(disk, run)
        assert "cannot be written: No space left on device" in line, stage
        assert line.startswith(tuple(f"results/{name}" for name in names)), stage
        assert results(disk).items() <= before.items(), stage
        mount(place, "remount,size=100m")
    completed = snakemake(disk, *CONFIG)
    assert completed.returncode == 0, completed.stderr
    assert results(disk) == results(finished)


def test_results_that_nobody_may_write_end_in_a_line(disk: Path, finished: Path) -> None:
    remove(disk, STAGES["report"])
    mount(disk / "results", "remount,ro")
    with begun(disk, "results") as run:
        assert "results" in refusal(disk, run)
    mount(disk / "results", "remount,rw")
    completed = snakemake(disk, *CONFIG)
    assert completed.returncode == 0, completed.stderr
    assert results(disk) == results(finished)


def test_a_second_run_is_refused_and_an_edited_config_waits_for_the_next(again: Path, finished: Path) -> None:
    shutil.rmtree(again / "results/plastic")
    with begun(again, "rule reconstruct") as first:
        with held(first):
            second = snakemake(again, *CONFIG)
        assert second.returncode != 0
        assert "--unlock" in second.stderr
        edited = small_settings()
        edited["fitting"]["seed"] = 7
        (again / "config.yaml").write_text(yaml.safe_dump(edited), encoding="utf-8")
    assert first.returncode == 0
    assert results(again) == results(finished)
    fits = {"fit", "compare_fits", "compare_materials"}
    assert rules_due(again) == fits | {"material_page", "index_page", "report_folder"}


def test_a_clock_that_was_set_back_is_no_reason_and_a_lost_table_is_made_again(
    again: Path, finished: Path
) -> None:
    """What was made before lies in the future then."""
    for path in (again / "results").rglob("*"):
        tomorrow = path.stat().st_mtime + 24 * 3600
        os.utime(path, (tomorrow, tomorrow))
    assert rules_due(again) == set()
    shutil.rmtree(again / "results/plastic/table.zarr")
    run = snakemake(again, *CONFIG)
    assert run.returncode == 0, run.stderr
    assert results(again) == results(finished)
    assert rules_due(again) == set()
