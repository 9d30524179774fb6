"""Run the benchmarks, print a table, write benchmarks/latest.json: ``python -m bench [NAME...]``.

Without a name the environment's ONLY is taken, and without that everything is run. A name is a
benchmark's, and its module's rows are run together. Every module runs in a process of its own, so
that its memory is its own and the number of its threads can be set before anything starts them.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from bench.measure import rows_of

LATEST = Path(__file__).resolve().parents[2] / "benchmarks" / "latest.json"


@dataclass(frozen=True)
class Benchmark:
    """A module whose `run` gives rows, and whether it runs on one core."""

    module: str
    one_core: bool

    def rows(self) -> list[dict[str, Any]]:
        """Run it in a fresh process."""
        # a thread that spins while it waits would share its core with the one it waits for
        variables = {"OMP_WAIT_POLICY": "passive"}
        if self.one_core:
            variables |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        before = dict(os.environ)
        os.environ.update(variables)
        try:
            with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
                return pool.submit(rows_of, self.module).result()
        finally:
            os.environ.clear()
            os.environ.update(before)


BENCHMARKS = {
    "reconstruct-kernel": Benchmark("bench.reconstruct_kernel", one_core=False),
    "reconstruct-step": Benchmark("bench.reconstruct_step", one_core=False),
    "lu-chipman": Benchmark("bench.decomposition", one_core=True),
    "physicality": Benchmark("bench.physicality", one_core=False),
    "tabulate-light": Benchmark("bench.tabulate_light", one_core=False),
    "table-files": Benchmark("bench.table_files", one_core=False),
    "model-gradient": Benchmark("bench.model_gradient", one_core=False),
    "fit-16": Benchmark("bench.fit_16", one_core=False),
    "capture-frame": Benchmark("bench.capture_frame", one_core=False),
}


def table_of(rows: list[dict[str, Any]]) -> Table:
    """What the rows say, for a terminal."""
    table = Table("name", "ours, ms", "peer", "peer, ms", "ratio", "limit, ms", "share of limit", "peak, MB")
    for r in rows:
        table.add_row(
            r["name"],
            f"{1e3 * r['ours_s']:.2f}",
            r["peer"],
            f"{1e3 * r['peer_s']:.0f}",
            f"{r['ratio']:.1f}",
            f"{1e3 * r['limit_s']:.2f}",
            f"{r['share_of_limit']:.2f}",
            f"{r['peak_mb']:.0f}",
        )
    return table


def main(names: list[str]) -> int:
    """Run the benchmarks of these names, or all."""
    unknown = [name for name in names if name not in BENCHMARKS]
    if unknown:
        print(f"no benchmark {unknown[0]!r}; there are {', '.join(BENCHMARKS)}", file=sys.stderr)
        return 2
    rows = [row for name in names or BENCHMARKS for row in BENCHMARKS[name].rows()]
    Console(width=None if sys.stdout.isatty() else 160).print(table_of(rows))
    LATEST.parent.mkdir(exist_ok=True)
    LATEST.write_text(json.dumps(rows, indent=2) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:] or os.environ.get("ONLY", "").split()))
