"""Signals of the lamp's disc, from frames whose every pixel is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.calibration.lamp_signal import lamp_signal
from pbrdf.capture.arrays import write_capture
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FrameStore

Float = NDArray[np.float64]

BAND = 550
SIDE, RADIUS = 41, 12.0
STATES = [(0.0, 25.0 * n, 5.0 * n, 90.0) for n in range(20)]
LEVELS = 200.0 + 150.0 * np.cos(np.arange(20))
DARK, READ, SATURATION = 50.0, 3.0, 2000.0
SECONDS = (0.01, 0.04, 0.16)
AFTER = (0, 10, 20)
REPEATED = 4


def frames(levels: Float, random: np.random.Generator) -> Float:
    """Discs (state, exposure, row, column), brighter toward one side, that go as exposure does."""
    row, column = np.indices((SIDE, SIDE)) - SIDE // 2
    disc = np.clip(RADIUS + 0.5 - np.hypot(row, column), 0.0, 1.0) * (1.0 + 0.01 * column)
    clean = np.multiply.outer(np.outer(levels, np.array(SECONDS) / SECONDS[0]), disc) + DARK
    return np.minimum(clean + random.normal(0.0, READ, clean.shape), SATURATION)


def store(folder: Path, levels: Float = LEVELS, seed: int = 1) -> FrameStore:
    random = np.random.default_rng(seed)
    light = write_capture(
        folder,
        material="air",
        angle_deg=180.0,
        frames={BAND: frames(levels, random).astype(np.float32)},
        states_deg=STATES,
        exposures_s=SECONDS,
        dark=random.normal(DARK, READ, (3, 8, SIDE, SIDE)).astype(np.float32),
        references={BAND: frames(np.full(3, levels[REPEATED]), random).astype(np.float32)},
        references_after=AFTER,
        reference_state=REPEATED,
        saturation=SATURATION,
    )
    return FrameStore.open(light.parent / "frames.zarr")


def test_signals_are_rates_in_the_order_of_the_run(tmp_path: Path) -> None:
    found = lamp_signal(store(tmp_path), BAND)
    again = STATES[REPEATED]
    order = [again, *STATES[:10], again, *STATES[10:], again]
    np.testing.assert_array_equal(found.states_deg, order)
    levels = np.insert(LEVELS, AFTER, LEVELS[REPEATED]) / SECONDS[0]
    # the mean of the disc's own shape, which is symmetrical, is one
    np.testing.assert_allclose(found.signal, levels, rtol=2e-3)


def test_the_longest_exposure_without_saturation_is_taken(tmp_path: Path) -> None:
    assert lamp_signal(store(tmp_path), BAND).exposure_s == 0.04
    assert lamp_signal(store(tmp_path / "bright", 4 * LEVELS), BAND).exposure_s == 0.01


def test_stated_noise_is_that_of_repeated_runs(tmp_path: Path) -> None:
    """Over 30 runs of 23 states: a standard deviation from 690 draws is known to 3 %."""
    runs = [lamp_signal(store(tmp_path / str(seed), seed=seed), BAND) for seed in range(30)]
    signals = np.array([run.signal for run in runs])
    # the dark frames' noise is common to the states of a run and moves all of them
    signals -= signals.mean(axis=1, keepdims=True)
    stated = np.mean([run.noise for run in runs])
    assert signals.std(axis=0, ddof=1).mean() == pytest.approx(stated, rel=0.1)


def test_a_lamp_that_always_saturates_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError) as refused:
        lamp_signal(store(tmp_path, 50 * LEVELS), BAND)
    assert "is saturated" in refused.value.problem
    assert refused.value.field == "550nm"
