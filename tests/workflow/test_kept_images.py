"""Mueller images: dropped after use, kept, or kept for some of the lights."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from small_workflow import small_settings, snakemake, write_project

pytestmark = pytest.mark.workflow

TABLE = "results/plastic/table.json"


@pytest.mark.parametrize(
    ("keep", "kept"),
    [
        ([], []),
        ({"every": 1}, ["030.00", "050.00", "070.00", "090.00"]),
        ({"every": 3}, ["030.00", "090.00"]),
    ],
    ids=["none", "all", "one in three"],
)
def test_images_are_dropped_or_kept(tmp_path: Path, keep: Any, kept: list[str]) -> None:
    write_project(tmp_path, small_settings() | {"reconstruction": {"keep_images": keep}})
    planned = snakemake(tmp_path, TABLE, "--configfile", "config.yaml", "--dry-run").stdout
    jobs = planned.split("rule reconstruct")[1:]
    found = {job.partition("light=")[2][:6]: job.startswith("_kept") for job in jobs}
    assert sorted(light for light, is_kept in found.items() if is_kept) == kept
    assert len(found) == 4


def test_none_of_every_is_refused(tmp_path: Path) -> None:
    write_project(tmp_path, small_settings() | {"reconstruction": {"keep_images": {"every": 0}}})
    run = snakemake(tmp_path, "--configfile", "config.yaml", "--dry-run")
    assert run.returncode != 0
    assert "reconstruction.keep_images" in run.stderr.rstrip().splitlines()[-1]
