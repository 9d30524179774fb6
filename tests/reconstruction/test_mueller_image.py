"""From synthetic frames back to the Mueller image that made them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from pbrdf.calibration.radiometry import Radiometry
from pbrdf.capture.arrays import write_capture
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FrameStore
from pbrdf.formats.mueller_exr import Missing
from pbrdf.optics.mueller import linear_polariser, linear_retarder
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.reconstruction.mueller_image import MuellerImage, reconstruct

Float = NDArray[np.float64]

POLARIMETER = Polarimeter(np.deg2rad(91.0), np.deg2rad(88.0), (0.0, 0.02, -0.01, 0.005))
HALF_TURN = np.stack([np.zeros(36), 5.0 * np.arange(36), 25.0 * np.arange(36), np.zeros(36)], axis=-1)
BAND = 550


def four_by_six() -> Float:
    generator, analyser = np.meshgrid([30, -45, 60, -90], [0, 30, 60, 90, 120, 150], indexing="ij")
    zero = np.zeros(24)
    return np.stack([zero, generator.ravel(), analyser.ravel(), zero], axis=-1)


def physical_image(rows: int, columns: int) -> Float:
    """Retarders with diattenuation and depolarisation, M00 over two decades; (16, rows, columns)."""
    random = np.random.default_rng(1)
    shape = (rows, columns)
    retarder = linear_retarder(random.uniform(0, 2 * np.pi, shape), random.uniform(0, np.pi, shape))
    sample = 0.6 * retarder + 0.4 * linear_polariser(random.uniform(0, np.pi, shape))
    sample[..., 0, 0] += 0.3
    sample *= np.geomspace(1, 100, rows)[:, None, None, None]
    return np.moveaxis(sample.reshape(*shape, 16), -1, 0)


def rates(mueller: Float, states: ArrayLike = HALF_TURN) -> Float:
    """DN/s (states, rows, columns) without noise."""
    return np.tensordot(POLARIMETER.measurement_matrix(np.deg2rad(states)), mueller, 1)


def stored(
    folder: Path,
    frames: NDArray[Any],
    exposures_s: list[float],
    *,
    states: ArrayLike = HALF_TURN,
    saturation: float = 1e9,
    dark: NDArray[Any] | None = None,
) -> FrameStore:
    """Frames (state, exposure, row, column) as a capture."""
    manifest = write_capture(
        folder,
        material="synthetic",
        angle_deg=41.0,
        frames={BAND: frames},
        states_deg=states,
        exposures_s=exposures_s,
        saturation=saturation,
        dark=dark,
    )
    return FrameStore.open(manifest.parent / "frames.zarr")


def solved(store: FrameStore, radiometry: Radiometry | None = None) -> MuellerImage:
    whole = (slice(0, store.header.rows), slice(0, store.header.columns))
    return reconstruct(store, BAND, POLARIMETER, radiometry, whole)


def largest_error(image: MuellerImage, truth: Float) -> float:
    return float((np.abs(image.mueller - truth) / truth[0]).max())


@pytest.mark.parametrize("states", [HALF_TURN, four_by_six()], ids=["1:5", "4 × 6"])
def test_without_noise_the_image_comes_back(tmp_path: Path, states: Float) -> None:
    truth = physical_image(7, 9)
    frames = rates(truth, states)[:, None].astype(np.float32)
    image = solved(stored(tmp_path, frames, [1.0], states=states))
    assert largest_error(image, truth) < 1e-5
    assert image.summary["residual_rms"] < 1e-5 * truth[0].max()
    assert not any(image.summary["missing"].values())
    assert not image.missing.any()


def test_two_equal_exposures_halve_the_variance(tmp_path: Path) -> None:
    truth = physical_image(5, 6)
    frames = rates(truth)[:, None].astype(np.float32)
    radiometry = Radiometry(0.5, 2.0, {BAND: 1.0})
    once = solved(stored(tmp_path / "once", frames, [1.0]), radiometry)
    # ascending times: as equal as two exposures can be
    twice = solved(stored(tmp_path / "twice", np.repeat(frames, 2, axis=1), [1.0, 1.0 + 1e-9]), radiometry)
    assert largest_error(twice, truth) < 1e-5
    np.testing.assert_allclose(twice.variance, once.variance / 2, rtol=1e-5)


def test_exposures_of_different_length_and_dark_level_agree(tmp_path: Path) -> None:
    truth, seconds = physical_image(5, 6), np.array([0.5, 4.0])
    level = np.array([3.0, 7.0])
    frames = rates(truth)[:, None] * seconds[:, None, None] + level[:, None, None]
    frames = np.minimum(frames, 200.0).astype(np.float32)
    assert (frames[:, 1] >= 200.0).any()
    assert (frames[:, 0] < 200.0).all()
    dark = np.broadcast_to(level[:, None, None, None], (2, 3, 5, 6)).astype(np.float32)
    image = solved(stored(tmp_path, frames, list(seconds), saturation=200.0, dark=dark))
    # the offset costs digits: 7 of 10 DN in float32
    assert largest_error(image, truth) < 1e-5


def test_a_window_is_the_same_part_of_the_image(tmp_path: Path) -> None:
    truth = physical_image(8, 9)
    store = stored(tmp_path, rates(truth)[:, None].astype(np.float32), [1.0])
    part = reconstruct(store, BAND, POLARIMETER, None, (slice(2, 6), slice(3, 8)))
    assert (part.first_row, part.first_column) == (2, 3)
    np.testing.assert_array_equal(part.mueller, solved(store).mueller[:, 2:6, 3:8])


def test_states_over_a_whole_turn_are_refused_with_their_rank(tmp_path: Path) -> None:
    states = HALF_TURN * 2
    store = stored(tmp_path, np.ones((36, 1, 2, 2), np.float32), [1.0], states=states)
    whole = (slice(0, 2), slice(0, 2))
    ideal = Polarimeter(np.pi / 2, np.pi / 2)
    with pytest.raises(InputError, match=r"frames\.zarr: states_deg: 36 states are of rank 14"):
        reconstruct(store, BAND, ideal, None, whole)


@pytest.mark.parametrize("share", [100, 75])
def test_a_state_saturated_in_most_pixels_is_refused(tmp_path: Path, share: int) -> None:
    frames = np.ones((36, 2, 3, 4), np.float32)
    frames[5, :, :, : share // 25] = 300.0
    store = stored(tmp_path, frames, [1.0, 2.0], saturation=255.0)
    with pytest.raises(InputError, match=rf"550nm, state 5: is saturated .* in {share} % .*; expose it less"):
        solved(store)


def test_photographs_of_darkness_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="shows no light in any pixel; check lamp, filter and shutter"):
        solved(stored(tmp_path, np.zeros((36, 1, 3, 4), np.float32), [1.0]))


def test_a_state_saturated_in_the_longer_exposure_alone_is_solved(tmp_path: Path) -> None:
    truth, seconds = physical_image(3, 4), np.array([1.0, 1000.0])
    frames = np.minimum(rates(truth)[:, None] * seconds[:, None, None], 255.0).astype(np.float32)
    assert (frames[:, 1] >= 255.0).all(axis=(1, 2)).any()
    assert largest_error(solved(stored(tmp_path, frames, list(seconds), saturation=255.0)), truth) < 1e-5


def test_a_pixel_saturated_in_one_state_is_missing_and_no_other(tmp_path: Path) -> None:
    truth = physical_image(5, 6)
    frames = rates(truth)[:, None].astype(np.float32)
    frames[9, 0, 1, 2] = 1e6
    image = solved(stored(tmp_path, frames, [1.0], saturation=1e5))
    known = np.ones((5, 6), bool)
    known[1, 2] = False
    for values in (image.mueller, image.variance):
        assert np.isnan(values[:, ~known]).all()
        assert np.isfinite(values[:, known]).all()
    assert image.summary["missing"]["saturated"] == pytest.approx(1 / 30)
    np.testing.assert_array_equal(image.missing == Missing.SATURATED, ~known)
    assert (np.abs(image.mueller - truth) / truth[0])[:, known].max() < 1e-5


def noisy_counts(
    signal: Float, count: int, dn_per_electron: float, read_noise: float, seed: int
) -> NDArray[np.float32]:
    """Shot and read noise on DN (states, exposures), over `count` pixels; (states, exposures, 1, count)."""
    random = np.random.default_rng(seed)
    electrons = random.poisson(signal[..., None] / dn_per_electron, (*signal.shape, count))
    values = electrons * dn_per_electron + random.normal(0.0, read_noise, electrons.shape)
    return values[:, :, None].astype(np.float32)


UNIFORM = linear_retarder(2.9, 0.4) * 0.7 + 0.3 * np.diag([1.0, 0.0, 0.0, 0.0])
"""Every pixel the same: pixels are repetitions of one measurement."""


def test_predicted_variance_is_that_of_repeated_noise(tmp_path: Path) -> None:
    """Sample variances of n Gaussian values scatter by √(2/n): the bound is five of these."""
    pixels, gain, read_noise, seconds = 4000, 0.5, 2.0, np.array([0.2, 1.0])
    rate = rates(20_000 * UNIFORM.reshape(16, 1))
    frames = noisy_counts(rate * seconds, pixels, gain, read_noise, 3)
    image = solved(stored(tmp_path, frames, list(seconds)), Radiometry(gain, read_noise, {BAND: 1.0}))
    assert image.summary["noise"] == "radiometry"
    values, predicted = image.mueller[:, 0].astype(np.float64), image.variance[:, 0].mean(axis=1)
    np.testing.assert_allclose(values.var(axis=1) / predicted, 1.0, atol=5 * np.sqrt(2 / pixels))
    error = values.mean(axis=1) - 20_000 * UNIFORM.ravel()
    assert np.abs(error / np.sqrt(predicted / pixels)).max() < 5


def test_without_radiometry_the_residuals_tell_the_noise(tmp_path: Path) -> None:
    pixels, sigma = 4000, 3.0
    rate = rates(500 * UNIFORM.reshape(16, 1, 1))[:, None]
    frames = rate + np.random.default_rng(4).normal(0.0, sigma, (36, 1, 1, pixels))
    image = solved(stored(tmp_path, frames.astype(np.float32), [1.0]))
    assert image.summary["noise"] == "residuals"
    # twenty degrees of freedom a pixel
    assert image.summary["residual_rms"] == pytest.approx(
        sigma * np.sqrt(20 / 36), rel=5 / np.sqrt(2 * 20 * pixels)
    )
    values = image.mueller[:, 0].astype(np.float64)
    np.testing.assert_allclose(
        values.var(axis=1) / image.variance[:, 0, 0], 1.0, atol=6 * np.sqrt(2 / pixels)
    )


def test_exactly_sixteen_states_leave_no_residual_to_tell_the_noise(tmp_path: Path) -> None:
    states = np.random.default_rng(5).uniform(-90, 90, (16, 4))
    truth = physical_image(3, 4)
    store = stored(tmp_path, rates(truth, states)[:, None].astype(np.float32), [1.0], states=states)
    image = solved(store)
    assert np.isfinite(image.mueller).all()
    assert np.isnan(image.variance).all()
    assert image.summary["noise"] == "unknown"


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32"])
def test_every_type_of_frame_is_read(tmp_path: Path, dtype: str) -> None:
    """The steps of an 8-bit converter show; the finer types do not."""
    truth = 200 * UNIFORM.reshape(16, 1, 1) * np.ones((1, 3, 4))
    scale = {"uint8": 1.0, "uint16": 200.0, "float32": 1.0}[dtype]
    frames = scale * rates(truth)[:, None]
    frames = (frames if dtype == "float32" else np.round(frames)).astype(dtype)
    image = solved(stored(tmp_path, frames, [1.0], saturation=255.0 * scale))
    step = {"uint8": 0.5, "uint16": 0.5, "float32": 1e-3}[dtype]
    gain = np.abs(np.linalg.pinv(POLARIMETER.measurement_matrix(np.deg2rad(HALF_TURN)))).sum(axis=1).max()
    assert np.abs(image.mueller - scale * truth).max() < gain * step
