"""A frame of a capture, instruments and all, against the bare writing of its chunk and its journal's line.

Emulated instruments are driven over their wires; what their camera sees is always the same picture. A frame
has 192² pixels, a state two exposures. The peer is the limit: nothing is stored faster than it is written.
"""

from __future__ import annotations

import contextlib
import io
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.measure import peak_mb, row
from pbrdf.capture.journal import Journal
from pbrdf.capture.run import capture
from pbrdf.formats.frame_arrays import write_frame
from pbrdf.instruments.emulators.rig import emulated_rig
from pbrdf.instruments.interface import FrameFormat, Setting
from pbrdf.settings.plan import CapturePlan, Light

SIDE = 192
STATES = tuple((0.0, 25.0 * n % 360.0, 5.0 * n, 90.0) for n in range(36))
PLAN = CapturePlan((Light("041.00", 41.0),), (450, 500, 550, 600, 650), STATES, (0.01, 0.04), 2)
FRAMES = PLAN.frames_per_light()
RIG = {"filters_nm": PLAN.bands_nm, "arm": {"limits_deg": (5, 180)}, "seed": 1}
ROUNDS = 5


class Still:
    """Renders nothing (`pbrdf.instruments.emulators.scene.Renderer`)."""

    identity = "still"
    frame_format = FrameFormat(SIDE, SIDE, "uint16", 14, 2, 65532.0)

    def __init__(self) -> None:
        shot = np.random.default_rng(1).poisson(3000, (SIDE, SIDE))
        self.frame: NDArray[np.uint16] = (shot << 2).astype(np.uint16)

    def expose(self, frame_id: str, setting: Setting) -> NDArray[Any]:
        """The picture."""
        return self.frame

    def expose_dark(self, frame_id: str, exposure_s: float) -> NDArray[Any]:
        """The picture."""
        return self.frame


def run() -> list[dict[str, Any]]:
    """Row `capture-frame`; medians of rounds in turns, a frame."""
    still = Still()
    ours, bare = [], []
    for _ in range(ROUNDS):
        with tempfile.TemporaryDirectory() as folder:
            ours.append(captured(still, Path(folder)))
        with tempfile.TemporaryDirectory() as folder:
            bare.append(written(still.frame, Path(folder)))
    writing = statistics.median(bare)
    return [
        row(
            "capture-frame",
            ours_s=statistics.median(ours),
            peer="bare chunk and line",
            peer_s=writing,
            limit_s=writing,
            peak_mb=peak_mb(),
        )
    ]


def captured(still: Still, folder: Path) -> float:
    """Seconds a frame of a capture."""
    with emulated_rig(RIG, still) as rig, contextlib.redirect_stderr(io.StringIO()):
        rig.home()
        start = time.perf_counter()
        capture(PLAN, "still", rig, folder)
        return (time.perf_counter() - start) / FRAMES


def written(frame: NDArray[np.uint16], folder: Path) -> float:
    """Seconds a frame that is only written, flushed and renamed, and gets its line."""
    journal = Journal(folder / "journal.jsonl")
    start = time.perf_counter()
    for number in range(FRAMES):
        write_frame(folder / f"c.{number}", "uint16", frame)
        journal.append(f"{number}", frame, {})
    return (time.perf_counter() - start) / FRAMES
