"""Dark frames, hot pixels, flat field, lamp drift, and what cannot be corrected."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.calibration.radiometry import Radiometry
from pbrdf.capture.arrays import write_capture
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FrameStore
from pbrdf.formats.mueller_exr import Missing
from pbrdf.optics.mueller import linear_retarder
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.reconstruction.dark import darkness
from pbrdf.reconstruction.drift import lamp_power
from pbrdf.reconstruction.mueller_image import MuellerImage, reconstruct

Float = NDArray[np.float64]

BAND = 550
SHAPE = (12, 15)
WHOLE = (slice(0, SHAPE[0]), slice(0, SHAPE[1]))
POLARIMETER = Polarimeter(np.deg2rad(91.0), np.deg2rad(88.0), (0.0, 0.02, -0.01, 0.005))
STATES = np.stack([np.zeros(36), 25.0 * np.arange(36), 5.0 * np.arange(36), np.full(36, 90.0)], axis=-1)
TRUTH = 400.0 * (0.7 * linear_retarder(2.9, 0.4) + 0.3 * np.diag([1.0, 0, 0, 0])).ravel()
RATES = POLARIMETER.measurement_matrix(np.deg2rad(STATES)) @ TRUTH
SECONDS = (0.5, 4.0)
TOP = 65532.0
NOISE = (2.0, 3.0)
RADIOMETRY = Radiometry(*NOISE, {BAND: 1.0})


def frames(power: Float | float = 1.0, light: Float | float = 1.0) -> NDArray[np.float32]:
    """(states, exposures, rows, columns) without noise; `light` by pixel."""
    states = (np.broadcast_to(power, 36) * RATES)[:, None] * np.array(SECONDS)
    return (states[:, :, None, None] * np.broadcast_to(light, SHAPE)).astype(np.float32)


def stored(
    folder: Path, bright: NDArray[np.float32], dark: NDArray[Any] | None = None, **more: Any
) -> FrameStore:
    manifest = write_capture(
        folder,
        material="synthetic",
        angle_deg=41.0,
        frames={BAND: bright},
        states_deg=STATES,
        exposures_s=SECONDS,
        saturation=TOP,
        dark=dark,
        **more,
    )
    return FrameStore.open(manifest.parent / "frames.zarr")


def relative_error(image: MuellerImage) -> Float:
    error: Float = np.abs(image.mueller - TRUTH[:, None, None]).max(axis=0) / TRUTH[0]
    return error


def current(electrons_per_s: dict[tuple[int, int], float]) -> Float:
    """DN of a dark current in each exposure; (exposures, rows, columns)."""
    dark = np.zeros((2, *SHAPE))
    for (row, column), rate in electrons_per_s.items():
        dark[:, row, column] = rate * np.array(SECONDS)
    return dark


def test_dark_current_is_subtracted_and_hot_pixels_lose_their_long_exposures(tmp_path: Path) -> None:
    """10 standard deviations of four dark values are 15 DN: warm stays, hot loses one exposure or both."""
    own = current({(1, 2): 2.0, (3, 4): 10.0, (5, 6): 50.0})
    read_noise = np.random.default_rng(1).normal(0, NOISE[1], (2, 4, *SHAPE))
    dark = (100.0 + own[:, None] + read_noise).astype(np.float32)
    bright = frames() + (100.0 + own).astype(np.float32)
    store = stored(tmp_path, bright, dark)
    usable = darkness(store, WHOLE).usable.reshape(SHAPE)
    assert (usable[1, 2], usable[3, 4], usable[5, 6]) == (2, 1, 0)
    assert (usable == 2).sum() == usable.size - 2
    image = reconstruct(store, BAND, POLARIMETER, RADIOMETRY, WHOLE)
    assert image.missing[5, 6] == Missing.HOT
    assert (image.missing == Missing.NONE).sum() == usable.size - 1
    assert image.summary["missing"]["hot"] == pytest.approx(1 / usable.size)
    # of an exposure less, more noise
    assert image.variance[0, 3, 4] > 2 * np.nanmedian(image.variance[0])
    known = image.missing == 0
    # the dark frames' own noise remains
    assert relative_error(image)[known].max() < 6 * np.sqrt(image.variance[0][known].max()) / TRUTH[0]


def test_dark_frames_that_saw_the_lamp_are_refused(tmp_path: Path) -> None:
    store = stored(tmp_path, frames(), np.full((2, 3, *SHAPE), TOP, np.float32))
    with pytest.raises(InputError, match="dark: saturates every pixel; take the dark frames again"):
        reconstruct(store, BAND, POLARIMETER, RADIOMETRY, WHOLE)


def test_a_flat_field_is_divided_out(tmp_path: Path) -> None:
    flat = np.random.default_rng(2).uniform(0.6, 1.0, SHAPE)
    store = stored(tmp_path, frames(light=flat))
    image = reconstruct(store, BAND, POLARIMETER, RADIOMETRY, WHOLE, flat.astype(np.float32))
    assert relative_error(image).max() < 1e-6
    plain = reconstruct(store, BAND, POLARIMETER, RADIOMETRY, WHOLE)
    np.testing.assert_allclose(image.variance, plain.variance / flat**2, rtol=1e-5)


def test_pixels_without_flat_field_are_missing_and_all_of_them_are_refused(tmp_path: Path) -> None:
    store = stored(tmp_path, frames())
    flat = np.ones(SHAPE, np.float32)
    flat[2, :3] = (0.0, np.nan, -1.0)
    image = reconstruct(store, BAND, POLARIMETER, RADIOMETRY, WHOLE, flat)
    assert (image.missing[2, :3] == Missing.NO_FLAT).all()
    assert (image.missing == 0).sum() == flat.size - 3
    assert np.isnan(image.mueller[:, 2, :3]).all()
    with pytest.raises(InputError, match="all pixels: are hot or without flat field"):
        reconstruct(store, BAND, POLARIMETER, RADIOMETRY, WHOLE, np.zeros(SHAPE, np.float32))


def drifting(positions: Float) -> Float:
    """One at the first state, and a cubic: what four takings of a state tell without error."""
    x = positions / 38.0
    return 1.0 - 0.3 * x + 0.9 * x**2 - 0.55 * x**3


def drifting_store(folder: Path) -> FrameStore:
    """The first state again after 13, 25 and 36 states: those come at positions 13, 26 and 38."""
    after = (13, 25, 36)
    states = np.arange(36)
    positions = states + np.searchsorted(after, states, side="right")
    repeats = drifting(np.array([13.0, 26.0, 38.0]))[:, None, None, None] * frames()[0]
    return stored(
        folder,
        frames(power=drifting(positions)),
        references={BAND: repeats.astype(np.float32)},
        references_after=after,
    )


def test_lamp_drift_is_told_from_repeats_and_corrected(tmp_path: Path) -> None:
    store = drifting_store(tmp_path)
    power = lamp_power(store, BAND, WHOLE, darkness(store, WHOLE), NOISE)
    states = np.arange(36)
    expected = drifting(states + np.searchsorted((13, 25, 36), states, side="right"))
    np.testing.assert_allclose(power, expected, rtol=1e-6)
    image = reconstruct(store, BAND, POLARIMETER, RADIOMETRY, WHOLE)
    assert relative_error(image).max() < 2e-6
    assert image.summary["drift"] == [pytest.approx(expected.min()), pytest.approx(expected.max())]


def test_any_state_may_be_the_repeated_one_and_power_is_told_relative_to_it(tmp_path: Path) -> None:
    """State 7 before all, after 18 states and after all: positions 0, 19 and 38, its own is 8."""
    after, states = (0, 18, 36), np.arange(36)
    positions = states + np.searchsorted(after, states, side="right")
    repeats = drifting(np.array([0.0, 19.0, 38.0]))[:, None, None, None] * frames()[7]
    store = stored(
        tmp_path,
        frames(power=drifting(positions)),
        references={BAND: repeats.astype(np.float32)},
        references_after=after,
        reference_state=7,
    )
    found = lamp_power(store, BAND, WHOLE, darkness(store, WHOLE), NOISE)
    np.testing.assert_allclose(found, drifting(positions) / drifting(np.array(8.0)), rtol=1e-6)
    assert found[7] == 1.0


def test_beyond_the_outermost_takings_the_power_stays(tmp_path: Path) -> None:
    """State 7 and one repeat after 18 states: nothing tells of the lamp before and after."""
    repeats = {BAND: (0.9 * frames()[7:8]).astype(np.float32)}
    store = stored(tmp_path, frames(), references=repeats, references_after=(18,), reference_state=7)
    found = lamp_power(store, BAND, WHOLE, darkness(store, WHOLE), NOISE)
    np.testing.assert_allclose(found[:8], 1.0, rtol=1e-12)
    np.testing.assert_allclose(found[18:], 0.9, rtol=1e-6)


def test_without_repeats_drift_stays(tmp_path: Path) -> None:
    states = np.arange(36)
    image = reconstruct(
        stored(tmp_path, frames(power=drifting(states))), BAND, POLARIMETER, RADIOMETRY, WHOLE
    )
    assert image.summary["drift"] == [1.0, 1.0]
    assert relative_error(image).max() > 0.02


def test_a_repeated_state_without_light_is_refused(tmp_path: Path) -> None:
    repeats = {BAND: np.zeros((1, 2, *SHAPE), np.float32)}
    store = stored(tmp_path, frames(), references=repeats, references_after=(36,))
    with pytest.raises(InputError, match="550nm, reference: shows no light; repeat a state that does"):
        reconstruct(store, BAND, POLARIMETER, RADIOMETRY, WHOLE)


def test_the_residual_is_what_the_noise_predicts(tmp_path: Path) -> None:
    """With states of even and uneven exposures; 20 degrees of freedom in each of 180 pixels."""
    random = np.random.default_rng(6)
    light = np.linspace(1.0, 120.0, SHAPE[0])[:, None]
    signal = frames(light=light).astype(np.float64)
    electrons = random.poisson(signal / NOISE[0])
    noisy = electrons * NOISE[0] + random.normal(0, NOISE[1], signal.shape)
    image = reconstruct(
        stored(tmp_path, np.minimum(noisy, TOP).astype(np.float32)), BAND, POLARIMETER, RADIOMETRY, WHOLE
    )
    assert 0.1 < image.summary["weighted_share"] < 0.9
    ratio = image.summary["residual_rms"] / image.summary["predicted_residual_rms"]
    assert ratio == pytest.approx(1.0, abs=4 / np.sqrt(2 * 20 * 180 / 4))
