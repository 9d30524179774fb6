"""Times of several functions, taken in turns so that a busy moment of the machine meets them all."""

from __future__ import annotations

import importlib
import resource
import statistics
import time
from collections.abc import Callable, Mapping
from typing import Any

SETTLE_S = 0.3
"""Idle threads of OpenBLAS spin for a while and would take a core from whoever is next."""


def interleaved(functions: Mapping[str, tuple[Callable[[], Any], int]], rounds: int) -> dict[str, float]:
    """Median seconds of each function over `rounds`; the number says how often it runs in each of them."""
    times: dict[str, list[float]] = {name: [] for name in functions}
    for _ in range(rounds):
        for name, (function, repeats) in functions.items():
            time.sleep(SETTLE_S)
            for _ in range(repeats):
                start = time.perf_counter()
                function()
                times[name].append(time.perf_counter() - start)
    return {name: statistics.median(values) for name, values in times.items()}


def peak_mb() -> float:
    """Most memory that this process ever held, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6


def row(
    name: str, *, ours_s: float, peer: str, peer_s: float, limit_s: float, peak_mb: float
) -> dict[str, Any]:
    """One line of the table; a ratio above one says that we are faster than the peer."""
    return {
        "name": name,
        "ours_s": ours_s,
        "peer": peer,
        "peer_s": peer_s,
        "ratio": peer_s / ours_s,
        "limit_s": limit_s,
        "share_of_limit": limit_s / ours_s,
        "peak_mb": peak_mb,
    }


def rows_of(module: str) -> list[dict[str, Any]]:
    """Run a module's benchmarks here."""
    rows: list[dict[str, Any]] = importlib.import_module(module).run()
    return rows
