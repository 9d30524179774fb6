"""The small workflow, run once for all tests that look at it."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from browser import CHROMIUM, Browser, running_browser
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


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """Debian's Chromium, for every page that a test opens; tests are skipped where it is absent."""
    if CHROMIUM is None:
        pytest.skip("there is no chromium: apt-get install chromium")
    with running_browser(tmp_path_factory.mktemp("profile")) as running:
        yield running
