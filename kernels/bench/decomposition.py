"""Lu-Chipman of 1024² physical matrices on one core against muellerkit; the limit: to copy as much."""

from __future__ import annotations

from typing import Any

import muellerkit
import numpy as np
from pbrdf._kernels import decomposition

from bench.limits import Copy
from bench.measure import interleaved, peak_mb, row
from pbrdf.reconstruction.physicality import nearest_physical

PIXELS = 1024**2


def physical_matrices() -> np.ndarray:
    """Depolarisers with noise and the nearest physical matrices of them, shape (PIXELS, 4, 4)."""
    mueller = np.random.default_rng(1).normal(0, 0.1, (PIXELS, 4, 4))
    mueller += np.diag([1.0, 0.6, 0.5, 0.4])
    return nearest_physical(mueller, out=mueller)


def run() -> list[dict[str, Any]]:
    """Rows `lu-chipman` and `lu-chipman-float32`."""
    double = physical_matrices()
    runs, functions = {}, {}
    for name, mueller in (("lu-chipman", double), ("lu-chipman-float32", double.astype(np.float32))):
        factors = [np.empty_like(mueller) for _ in range(3)]
        guard = np.empty(PIXELS, np.uint8)

        def ours(mueller: np.ndarray = mueller, factors: list[Any] = factors, guard: Any = guard) -> None:
            decomposition.lu_chipman(mueller, *factors, guard)

        ours()
        runs[name] = (4 * mueller.nbytes + guard.nbytes, peak_mb())
        functions[name] = (ours, 5)
    functions["copy"] = (Copy(1), 3)
    functions["peer"] = (lambda: muellerkit.decompose_depolarizer_retarder_diattenuator(double), 1)
    seconds = interleaved(functions, rounds=3)
    return [
        row(
            name,
            ours_s=seconds[name],
            peer="muellerkit.decompose_depolarizer_retarder_diattenuator",
            peer_s=seconds["peer"],
            limit_s=Copy.seconds_for(moved, seconds["copy"]),
            peak_mb=peak,
        )
        for name, (moved, peak) in runs.items()
    ]
