"""A run tells at its start how much it writes, and does not start where there is no room for it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from small_workflow import ROOT, write_project

pytestmark = pytest.mark.workflow

ON_A_DISK = """
import shutil, sys
from types import SimpleNamespace
free = int(sys.argv.pop(1))
shutil.disk_usage = lambda path: SimpleNamespace(free=free)
from snakemake.cli import main
main()
"""


def run(folder: Path, free: int, *targets: str) -> subprocess.CompletedProcess[str]:
    arguments = ("--snakefile", str(ROOT / "Snakefile"), "--workflow-profile", str(ROOT / "profiles/default"))
    command = [
        sys.executable,
        "-c",
        ON_A_DISK,
        str(free),
        *targets,
        *arguments,
        "--configfile",
        "config.yaml",
    ]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def test_too_little_room_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    write_project(tmp_path)
    refused = run(tmp_path, 12_000_000)
    assert refused.returncode != 0
    assert "Traceback" not in refused.stderr
    line = refused.stderr.rstrip().splitlines()[-1]
    assert "disk: has 12 MB free, and this run writes" in line
    assert not (tmp_path / "captures").exists()


def test_room_is_asked_for_what_is_to_do_alone(tmp_path: Path) -> None:
    write_project(tmp_path)
    done = run(tmp_path, 12_000_000, "results/calibration/monday/camera.json")
    assert done.returncode == 0, done.stderr
    assert "This run writes at most 0 MB; 12 MB are free." in done.stderr
