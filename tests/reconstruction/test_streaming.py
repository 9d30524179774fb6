"""States merged one after the other against all of them at once."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pbrdf.calibration.radiometry import Radiometry
from pbrdf.capture.arrays import write_capture
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FrameStore
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.reconstruction.dark import darkness
from pbrdf.reconstruction.mueller_image import reconstruct
from pbrdf.reconstruction.streaming import StatesAhead, Workspace, merged_states

BAND = 550
EXPOSURES_S = (0.01, 0.1)
NOISE = (0.5, 2.0)
TOP = 250.0
POLARIMETER = Polarimeter(1.5, 1.6)
WHOLE = (slice(0, 20), slice(0, 31))


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


def merged(store: FrameStore, window: tuple[slice, slice]) -> tuple[Any, Any]:
    with StatesAhead(store, BAND, window) as ahead:
        workspace = merged_states(ahead, darkness(store, window), NOISE)
    return workspace.planes, workspace.used


@pytest.mark.parametrize("states", [1, 2, 36])
@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32"])
def test_state_by_state_equals_all_at_once(tmp_path: Path, states: int, dtype: str) -> None:
    store = stored(tmp_path, states, dtype)
    window = (slice(2, 17), slice(1, 30))
    rate, used = merged(store, window)
    signal = store.read_band(BAND, *window) - store.mean_dark(*window).astype(np.float64)
    counts = np.logical_and.accumulate(store.read_band(BAND, *window) < TOP, axis=1)
    seconds = np.array(EXPOSURES_S)[:, None, None]
    with np.errstate(invalid="ignore"):
        common = np.maximum((signal * counts).sum(axis=1) / (seconds * counts).sum(axis=1), 0)[:, None]
        weight = counts * seconds**2 / (NOISE[1] ** 2 + NOISE[0] * common * seconds)
        expected = (weight * signal / seconds).sum(axis=1) / weight.sum(axis=1)
    np.testing.assert_array_equal(used, counts.sum(axis=1).reshape(states, -1))
    np.testing.assert_allclose(
        rate[:states], expected.reshape(states, -1), rtol=4e-7, atol=4e-7 * TOP / EXPOSURES_S[0]
    )
    lost = (used == 0).any(axis=0).reshape(15, 29)
    assert lost[5, 8]
    assert lost.sum() == 1


def test_a_damaged_frame_is_named_with_its_state(tmp_path: Path) -> None:
    store = stored(tmp_path, 9, "uint16")
    chunk = store.path / "550nm/c.7.1.0.0"
    chunk.write_bytes(chunk.read_bytes()[:-9])
    with pytest.raises(InputError, match="550nm, state 7, exposure 1: is damaged"):
        merged(store, WHOLE)


def test_a_frame_that_is_not_finite_is_named_with_its_state(tmp_path: Path) -> None:
    store = stored(tmp_path, 9, "float32")
    writable = FrameStore.open(store.path, writable=True)
    writable.write_frame(BAND, 8, 1, np.full((20, 31), np.nan, np.float32))
    with pytest.raises(InputError, match="550nm, state 8, exposure 1: holds values that are not finite"):
        merged(store, WHOLE)


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
    kept = (36 * 4 + 36) * pixels
    dark = 2 * (3 * 2 + 8 + 4) * pixels
    in_hand = 2 * 3 * 2 * 2 * pixels
    modules_and_threads = 40e6
    assert int(run.stdout) < kept + dark + in_hand + modules_and_threads


def test_memory_of_an_earlier_band_gives_the_same_image(tmp_path: Path) -> None:
    store = stored(tmp_path, 36, "uint16")
    radiometry, window = Radiometry(0.5, 2.0, {BAND: 1.0}), (slice(2, 17), slice(1, 30))
    workspace = Workspace.of(store.header, window)
    fresh = reconstruct(store, BAND, POLARIMETER, radiometry, window)
    for _ in range(2):
        again = reconstruct(store, BAND, POLARIMETER, radiometry, window, workspace=workspace)
        np.testing.assert_array_equal(again.mueller, fresh.mueller)
        np.testing.assert_array_equal(again.variance, fresh.variance)


def test_dark_frames_shared_by_the_bands_give_the_same_image(tmp_path: Path) -> None:
    store = stored(tmp_path, 36, "uint16")
    radiometry, window = Radiometry(0.5, 2.0, {BAND: 1.0}, 3e4), (slice(2, 17), slice(1, 30))
    dark = darkness(store.saturating_at(3e4), window)
    own = reconstruct(store, BAND, POLARIMETER, radiometry, window)
    shared = reconstruct(store, BAND, POLARIMETER, radiometry, window, dark=dark)
    np.testing.assert_array_equal(shared.mueller, own.mueller)
    np.testing.assert_array_equal(shared.variance, own.variance)


def test_memory_for_another_window_is_refused(tmp_path: Path) -> None:
    store = stored(tmp_path, 36, "uint16")
    workspace = Workspace.of(store.header, (slice(0, 9), slice(0, 9)))
    with pytest.raises(ValueError, match="is not for"):
        reconstruct(store, BAND, POLARIMETER, None, WHOLE, workspace=workspace)
