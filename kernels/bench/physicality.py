"""Cloude's test of 1024² matrices on all cores against muellerkit; the limit: to copy as much."""

from __future__ import annotations

from typing import Any

import muellerkit
import numpy as np
from pbrdf._kernels import physicality

from bench.limits import Copy, cores
from bench.measure import interleaved, peak_mb, row

PIXELS = 1024**2
TOLERANCE = 1e-6


def run() -> list[dict[str, Any]]:
    """Rows `physicality` and `physicality-float32`."""
    double = np.random.default_rng(1).normal(0, 0.04, (PIXELS, 4, 4))
    double += np.diag([1.0, 0.8, 0.7, 0.6])
    runs, functions = {}, {}
    for name, mueller in (("physicality", double), ("physicality-float32", double.astype(np.float32))):
        physical = np.empty(PIXELS, np.bool_)

        def ours(mueller: np.ndarray = mueller, physical: np.ndarray = physical) -> None:
            physicality.physicality_mask(mueller, TOLERANCE, physical)

        ours()
        runs[name] = (mueller.nbytes + physical.nbytes, peak_mb())
        functions[name] = (ours, 10)
    functions["copy"] = (Copy(cores()), 5)
    functions["peer"] = (lambda: muellerkit.physical_realizability(double, atol=0.0, rtol=TOLERANCE), 1)
    seconds = interleaved(functions, rounds=3)
    return [
        row(
            name,
            ours_s=seconds[name],
            peer="muellerkit.physical_realizability",
            peer_s=seconds["peer"],
            limit_s=Copy.seconds_for(moved, seconds["copy"]),
            peak_mb=peak,
        )
        for name, (moved, peak) in runs.items()
    ]
