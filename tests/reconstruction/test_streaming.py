"""States merged one after the other against all of them at once."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.capture.arrays import write_capture
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FrameStore
from pbrdf.reconstruction.streaming import GROUP, merged_states

BAND = 550
EXPOSURES_S = (0.01, 0.1)
GAIN, READ_NOISE = 0.5, 2.0
TOP = 250.0


def stored(folder: Path, states: int, dtype: str, rows: int = 20, columns: int = 31) -> FrameStore:
    random = np.random.default_rng(1)
    frames = random.uniform(5, 240, (states, 2, rows, columns))
    frames[: min(states, 3), 1, :4] = 255
    frames[-1, :, 7, 9] = 255
    manifest = write_capture(
        folder,
        material="synthetic",
        angle_deg=41.0,
        frames={BAND: frames.astype(dtype)},
        states_deg=random.uniform(-90, 90, (states, 4)),
        exposures_s=EXPOSURES_S,
        saturation=TOP,
        dark=random.uniform(0, 4, (2, 3, rows, columns)).astype(dtype),
    )
    return FrameStore.open(manifest.parent / "frames.zarr")


def twin(store: FrameStore, window: tuple[slice, slice], weights: NDArray[Any]) -> tuple[Any, Any]:
    frames = store.read_band(BAND, *window).astype(np.float64)
    signal = frames - store.mean_dark(*window)
    seconds = np.array(EXPOSURES_S)[:, None, None]
    weight = seconds**2 / (READ_NOISE**2 + GAIN * np.maximum(signal, 0))
    weight[frames >= TOP] = 0.0
    total = weight.sum(axis=1)
    total[total == 0] = np.nan
    rate = (weight * signal / seconds).sum(axis=1) / total
    return rate.reshape(len(rate), -1), weights @ (1 / total).reshape(len(rate), -1)


@pytest.mark.parametrize("states", [1, GROUP - 1, GROUP, GROUP + 1, 2 * GROUP, 36])
@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32"])
def test_state_by_state_equals_all_at_once(tmp_path: Path, states: int, dtype: str) -> None:
    store = stored(tmp_path, states, dtype)
    weights = np.random.default_rng(2).uniform(0, 1, (16, states))
    window = (slice(2, 17), slice(1, 30))
    rate, variance = merged_states(store, BAND, window, (GAIN, READ_NOISE), weights)
    expected_rate, expected_variance = twin(store, window, weights)
    np.testing.assert_allclose(rate, expected_rate, rtol=1.2e-7, atol=1e-6)
    # a float32 sum of that many positive terms
    rounding = 0.5 * (states + 3) * np.finfo(np.float32).eps
    np.testing.assert_allclose(variance, expected_variance, rtol=rounding)
    lost = np.isnan(variance[0]).reshape(15, 29)
    assert lost[5, 8]
    assert lost.sum() == 1


def test_a_damaged_frame_is_named_with_its_state(tmp_path: Path) -> None:
    store = stored(tmp_path, 9, "uint16")
    chunk = store.path / "550nm/c/7/1/0/0"
    chunk.write_bytes(chunk.read_bytes()[:-9])
    with pytest.raises(InputError, match="550nm, state 7, exposure 1: is damaged"):
        merged_states(store, BAND, (slice(0, 20), slice(0, 31)), (GAIN, READ_NOISE), np.ones((16, 9)))


def test_a_frame_that_is_not_finite_is_named_with_its_state(tmp_path: Path) -> None:
    store = stored(tmp_path, 9, "float32")
    writable = FrameStore.open(store.path, writable=True)
    writable.write_frame(BAND, 8, 1, np.full((20, 31), np.nan, np.float32))
    with pytest.raises(InputError, match="550nm, state 8, exposure 1: holds values that are not finite"):
        merged_states(store, BAND, (slice(0, 20), slice(0, 31)), (GAIN, READ_NOISE), np.ones((16, 9)))


PEAK = """
import resource, sys
import numpy as np
from pbrdf.formats.capture_store import FrameStore
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.calibration.radiometry import Radiometry
from pbrdf.reconstruction.mueller_image import reconstruct
store = FrameStore.open(sys.argv[1])
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
whole = (slice(0, store.header.rows), slice(0, store.header.columns))
reconstruct(store, 550, Polarimeter(1.5, 1.6), Radiometry(0.5, 2.0, {550: 1.0}), whole)
print(1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before))
"""


def test_a_light_needs_little_more_memory_than_its_rates_and_variances(tmp_path: Path) -> None:
    pixels = 600 * 800
    store = stored(tmp_path, 36, "uint16", 600, 800)
    run = subprocess.run(
        [sys.executable, "-c", PEAK, str(store.path)], capture_output=True, text=True, check=True
    )
    kept = (36 + 16 + GROUP) * 4 * pixels
    dark = 2 * (3 * 2 + 8 + 4) * pixels
    in_hand = 4 * 2 * 2 * pixels
    modules_and_threads = 40e6
    assert int(run.stdout) < kept + dark + in_hand + modules_and_threads
