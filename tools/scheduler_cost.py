"""What the scheduler of a finished local run cost: its wall time less its jobs' benchmarks over the cores.

    python tools/scheduler_cost.py [FOLDER]

Cores that are idle at the ends count with it. The benchmarks are those written since the last run began.
"""

from __future__ import annotations

import re
import sys
from datetime import timedelta
from pathlib import Path


def last_run(folder: Path) -> tuple[float, float, int]:
    """Time at which the last run ended, its seconds, and its cores."""
    log = max((folder / ".snakemake/log").glob("*.log"))
    text = log.read_text(encoding="utf-8")
    hours, minutes, seconds = re.findall(r"^Elapsed time: (\d+):(\d+):([\d.]+)$", text, re.MULTILINE)[-1]
    elapsed = timedelta(hours=int(hours), minutes=int(minutes), seconds=float(seconds))
    cores = int(re.findall(r"^Provided cores: (\d+)", text, re.MULTILINE)[-1])
    return log.stat().st_mtime, elapsed.total_seconds(), cores


def main() -> None:
    """Print the cost and its parts in a line."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    ended, wall_s, cores = last_run(folder)
    written = [
        path for path in (folder / "benchmarks").rglob("*.tsv") if path.stat().st_mtime > ended - wall_s
    ]
    jobs_s = sum(float(path.read_text(encoding="utf-8").splitlines()[1].split("\t")[0]) for path in written)
    told = f"{len(written)} jobs of {jobs_s:.0f} s on {cores} cores in {wall_s:.0f} s"
    print(f"{told}: the scheduler's {100 * (1 - jobs_s / cores / wall_s):.1f} %")


if __name__ == "__main__":
    main()
