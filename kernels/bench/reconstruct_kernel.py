"""36 uint16 frames of 1024² to Mueller images on all cores against polanalyser.

The limit: to copy as many bytes, or to do as many multiply-adds, whichever takes longer.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import polanalyser

from bench.limits import Copy, MultiplyAdd, cores
from bench.measure import interleaved, peak_mb, row
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.reconstruction.frames import mueller_of_frames

STATES, SHAPE = 36, (1024, 1024)


def run() -> list[dict[str, Any]]:
    """Row `reconstruct-kernel`, with the output reused."""
    generator = [polanalyser.qwp(5 * angle) @ polanalyser.polarizer(0) for angle in angles()]
    analyser = [polanalyser.polarizer(0) @ polanalyser.qwp(angle) for angle in angles()]
    zero = np.zeros(STATES)
    states = np.rad2deg(np.stack([zero, 5 * angles(), angles(), zero], axis=-1))
    frames = np.random.default_rng(1).integers(0, 65536, (STATES, *SHAPE), dtype=np.uint16)
    mueller = np.empty((16, *SHAPE), np.float32)

    def ours() -> None:
        mueller_of_frames(frames, states, Polarimeter(np.pi / 2, np.pi / 2), mueller)

    def peer() -> Any:
        return polanalyser.calcMueller(frames, generator, analyser)

    ours()
    peak = peak_mb()
    expected = np.moveaxis(peer().reshape(*SHAPE, 16), -1, 0)
    np.testing.assert_allclose(mueller, expected, rtol=1e-4, atol=0.1)
    fma = MultiplyAdd(cores())
    seconds = interleaved(
        {"ours": (ours, 10), "copy": (Copy(cores()), 5), "fma": (fma, 2), "peer": (peer, 2)}, rounds=4
    )
    moved = frames.nbytes + mueller.nbytes
    limit_s = max(Copy.seconds_for(moved, seconds["copy"]), STATES * mueller.size / fma.best_rate)
    return [
        row(
            "reconstruct-kernel",
            ours_s=seconds["ours"],
            peer="polanalyser.calcMueller",
            peer_s=seconds["peer"],
            limit_s=limit_s,
            peak_mb=peak,
        )
    ]


def angles() -> np.ndarray:
    """Angles of the analyser's retarder, rad; the generator's turns five times as fast."""
    return np.linspace(0, np.pi, STATES, endpoint=False)
