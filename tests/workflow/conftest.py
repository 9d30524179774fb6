"""The small workflow, run once for all tests that look at it."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml
from browser import CHROMIUM, Browser, running_browser
from small_workflow import ROOT, measured_settings, snakemake, write_materials, write_project


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
def measured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which a run has measured all its calibrations; tests that change it take a copy."""
    folder = tmp_path_factory.mktemp("measured")
    shutil.copy(ROOT / "config/rig/virtual.yaml", folder / "rig.yaml")
    write_materials(folder, ("plastic", "rig", "monday", "25", "-", "-"))
    (folder / "config.yaml").write_text(yaml.safe_dump(measured_settings()), encoding="utf-8")
    run = snakemake(folder, "--configfile", "config.yaml")
    assert run.returncode == 0, run.stderr
    return folder


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """Debian's Chromium, for every page that a test opens; tests are skipped where it is absent."""
    if CHROMIUM is None:
        pytest.skip("there is no chromium: apt-get install chromium")
    with running_browser(tmp_path_factory.mktemp("profile")) as running:
        yield running
