"""The small workflow, run once for all tests that look at it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from small_workflow import snakemake, write_project


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which the small workflow has run; tests that change it take a copy."""
    folder = tmp_path_factory.mktemp("small")
    run = snakemake(folder, "--configfile", write_project(folder).name)
    assert run.returncode == 0, run.stderr
    return folder


@pytest.fixture
def again(finished: Path, tmp_path: Path) -> Path:
    """A copy of the finished folder, times of files included."""
    folder = tmp_path / "again"
    shutil.copytree(finished, folder)
    return folder
