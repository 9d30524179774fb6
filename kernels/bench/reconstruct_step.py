"""A light of the paper's size, from store to Mueller image, against reading and decoding its frames alone.

The store (one band, 36 states × 3 exposures of 3376 × 2704 pixels) is written to a temporary folder, where it
and the image fill 2.5 GB, and removed. The limit is the peer: nothing is faster than reading.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import zarr

from bench.measure import peak_mb, row
from pbrdf.calibration.radiometry import Radiometry
from pbrdf.formats.capture_store import FramesHeader, FrameStore, band_name
from pbrdf.formats.mueller_exr import write_mueller_exr
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.reconstruction.mueller_image import MuellerImage, reconstruct
from pbrdf.reconstruction.streaming import Workspace

ROWS, COLUMNS, STATES, BAND = 2704, 3376, 36, 550
WHOLE = (slice(0, ROWS), slice(0, COLUMNS))
EXPOSURES_S = (0.01, 0.04, 0.16)
SATURATION = 65532.0
POLARIMETER = Polarimeter(np.pi / 2, np.pi / 2)
RADIOMETRY = Radiometry(6.4, 12.0, {BAND: 1.0})


def run() -> list[dict[str, Any]]:
    """Rows `reconstruct-step` (to memory) and `reconstruct-step-exr`; best of three, warm cache."""
    with tempfile.TemporaryDirectory() as folder:
        store = write_store(Path(folder) / "frames.zarr")
        image = Path(folder) / "image.exr"
        frames = np.empty((len(EXPOSURES_S), ROWS, COLUMNS), np.uint16)
        workspace = Workspace.of(store.header, WHOLE)
        functions: dict[str, Callable[[], Any]] = {
            "reconstruct-step": lambda: in_memory(store, workspace),
            "reconstruct-step-exr": lambda: in_file(store, workspace, image),
            "read": lambda: read(store, frames),
        }
        seconds: dict[str, list[float]] = {name: [] for name in functions}
        peaks: dict[str, float] = {}
        # three in a row: a virtual machine gives freed memory back, and fetching it again costs seconds
        for name, function in functions.items():
            for _ in range(3):
                start = time.perf_counter()
                function()
                seconds[name].append(time.perf_counter() - start)
            peaks[name] = peak_mb()
    reading = min(seconds["read"])
    return [
        row(
            name,
            ours_s=min(seconds[name]),
            peer="zarr reads it",
            peer_s=reading,
            limit_s=reading,
            peak_mb=peaks[name],
        )
        for name in ("reconstruct-step", "reconstruct-step-exr")
    ]


def read(store: FrameStore, frames: np.ndarray) -> None:
    """Decode all frames by Zarr alone, state by state into one array."""
    band = zarr.open_group(store.path, mode="r")[band_name(BAND)]
    for state in range(STATES):
        frames[...] = band[state]


def in_memory(store: FrameStore, workspace: Workspace) -> MuellerImage:
    """Mueller image and variances of the light, in memory that is used again as from band to band."""
    return reconstruct(store, BAND, POLARIMETER, RADIOMETRY, WHOLE, workspace=workspace)


def in_file(store: FrameStore, workspace: Workspace, path: Path) -> None:
    """The same, written."""
    image = in_memory(store, workspace)
    write_mueller_exr(path, image.mueller, image.variance, image.missing, (0, 0), {"units": "DN/s"})


def write_store(path: Path) -> FrameStore:
    """Shot and read noise on a disk that is brighter in its middle, in 14 bits shifted left by two."""
    angles = 5.0 * np.arange(STATES)
    states = tuple((0.0, float(a), float(5 * a), 0.0) for a in angles)
    header = FramesHeader(
        material="synthetic",
        light="000.00",
        source="arrays",
        angle_deg=0.0,
        bands_nm=(BAND,),
        states_deg=states,
        exposures_s=EXPOSURES_S,
        darks=1,
        rows=ROWS,
        columns=COLUMNS,
        dtype="uint16",
        adc_bits=14,
        shift=2,
        saturation=SATURATION,
    )
    store = FrameStore.create(path, header)
    random = np.random.default_rng(1)
    across = np.hypot(*np.meshgrid(np.linspace(-1, 1, COLUMNS), np.linspace(-0.8, 0.8, ROWS)))
    rate = (2e6 * np.maximum(0.9 - across, 0.002)).astype(np.float32)
    noise = random.standard_normal((ROWS, COLUMNS), np.float32)
    w = POLARIMETER.measurement_matrix(np.deg2rad(np.array(states)))
    matrix = np.diag([1.0, 0.5, -0.4, 0.3]).ravel()
    for exposure, seconds in enumerate(EXPOSURES_S):
        store.write_dark(exposure, 0, digitised(noise * 12.0 + 400.0))
        for state in range(STATES):
            signal = rate * np.float32(seconds * (w[state] @ matrix))
            # the same noise, moved: new draws for each frame would take minutes
            drawn = np.roll(noise, (97 * state, 131 * exposure), (0, 1))
            value = signal + drawn * np.sqrt(144.0 + 6.4 * np.maximum(signal, 0)) + 400.0
            store.write_frame(BAND, state, exposure, digitised(value))
    return FrameStore.open(path)


def digitised(value: np.ndarray) -> np.ndarray:
    """Nearest word of the converter, saturated at its top."""
    return (np.clip(np.round(value / 4), 0, 16383).astype(np.uint16) << 2).astype(np.uint16)
