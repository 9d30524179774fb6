"""The workflow on a cluster of one node: the same bytes as without one, and the rig stays here."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from slurm_node import cluster, missing
from small_workflow import ROOT, snakemake

pytestmark = [pytest.mark.workflow, pytest.mark.slurm]

PROFILE = ("--workflow-profile", str(ROOT / "profiles/slurm"))
# The profile waits for the clocks and disks of a real cluster; one node without accounting needs none of it
SMALL = (
    *("--default-resources", "mem_mb=1500", "runtime=10", "slurm_partition=main", "slurm_account=none"),
    *("--slurm-status-command", "squeue", "--slurm-init-seconds-before-status-checks", "2"),
    *("--seconds-between-status-checks", "2", "--latency-wait", "5"),
)


@pytest.fixture(scope="module")
def node() -> Iterator[Path]:
    reason = missing()
    if reason:
        pytest.skip(reason)
    with cluster() as home:
        yield home


def test_a_cluster_makes_the_same_bytes(node: Path, again: Path) -> None:
    results = [
        f"results/plastic/{name}" for name in ("table.json", "slices/050.00.json", "slices/090.00.json")
    ]
    before = {name: (again / name).read_bytes() for name in results}
    shutil.rmtree(again / "results/plastic")
    run = snakemake(
        again, "results/plastic/table.json", "--configfile", "config.yaml", *SMALL, profile=PROFILE
    )
    assert run.returncode == 0, run.stderr
    submitted = re.findall(r"Job \d+ has been submitted with SLURM jobid (\d+)", run.stderr)
    # four lights reconstructed and sliced, and their table: nothing of it ran here
    assert len(set(submitted)) == 9
    assert {name: (again / name).read_bytes() for name in results} == before
