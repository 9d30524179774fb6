"""The kernels between raw frames and Mueller images against plain NumPy."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pbrdf._kernels import planes, solve

Float = NDArray[np.float64]

EXPOSURES_S = np.array([0.004, 0.02, 0.1])
PIXELS = 1000  # not a multiple of any block


def merged_twin(
    frames: NDArray[Any],
    dark: Float,
    exposures: Float,
    saturation: float,
    dn_per_electron: float,
    read_noise: float,
) -> tuple[Float, Float]:
    """Inverse-variance mean of the rates; the variance of a value is read noise plus shot noise."""
    signal = frames.astype(np.float64) - dark
    seconds = exposures[:, None]
    value_variance = read_noise**2 + dn_per_electron * np.maximum(signal, 0.0)
    weight = np.where(frames < saturation, seconds**2 / value_variance, 0.0)
    total = weight.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        return (weight * signal / seconds).sum(axis=0) / total, 1.0 / total


def merged(frames: NDArray[Any], dark: NDArray[np.float32], *noise: float) -> tuple[Float, Float]:
    rate, variance = np.empty((2, frames.shape[1]), np.float32)
    solve.merge_exposures(frames, dark, EXPOSURES_S, *noise, rate, variance)
    return rate, variance


def scene(dtype: str, saturation: float) -> tuple[NDArray[Any], NDArray[np.float32]]:
    """Three exposures of rates over four decades, the brightest saturated in all of them."""
    random = np.random.default_rng(1)
    rate = saturation * np.geomspace(0.1, 1000, PIXELS)
    dark = random.uniform(1, 3, (3, PIXELS)).astype(np.float32)
    values = rate * EXPOSURES_S[:, None] + dark + random.normal(0, 1, (3, PIXELS))
    values = np.clip(values, 0, saturation)
    return (values if dtype == "float32" else np.round(values)).astype(dtype), dark


@pytest.mark.parametrize(
    ("dtype", "saturation"), [("uint8", 255.0), ("uint16", 65532.0), ("uint16", 4000.0), ("float32", 0.7e4)]
)
def test_merged_exposures_equal_their_twin(dtype: str, saturation: float) -> None:
    frames, dark = scene(dtype, saturation)
    rate, variance = merged(frames, dark, saturation, 0.5, 2.0)
    expected_rate, expected_variance = merged_twin(frames, dark, EXPOSURES_S, saturation, 0.5, 2.0)
    saturated = (frames >= saturation).all(axis=0)
    assert 0 < saturated.sum() < PIXELS
    np.testing.assert_array_equal(np.isnan(rate), saturated)
    np.testing.assert_array_equal(np.isnan(variance), saturated)
    known = ~saturated
    # float32 rounds the result alone
    np.testing.assert_allclose(rate[known], expected_rate[known], rtol=1.2e-7, atol=1e-6)
    np.testing.assert_allclose(variance[known], expected_variance[known], rtol=1.2e-7)


def test_a_saturated_exposure_has_no_weight() -> None:
    frames = np.array([[40], [200], [255]], np.uint8)
    rate, variance = merged(frames, np.zeros((3, 1), np.float32), 255.0, 0.0, 2.0)
    seconds = EXPOSURES_S[:2]
    assert rate[0] == pytest.approx((40 * seconds[0] + 200 * seconds[1]) / (seconds**2).sum(), rel=1e-6)
    assert variance[0] == pytest.approx(4.0 / (seconds**2).sum(), rel=1e-6)


def test_a_value_below_the_dark_level_keeps_its_sign() -> None:
    frames = np.full((3, 1), 2, np.uint16)
    rate, _ = merged(frames, np.full((3, 1), 5, np.float32), 1000.0, 0.5, 2.0)
    assert rate[0] < 0


def test_pixels_without_any_exposure_are_counted() -> None:
    frames, dark = scene("uint16", 4000.0)
    rate, variance = np.empty((2, PIXELS), np.float32)
    count = solve.merge_exposures(frames, dark, EXPOSURES_S, 4000.0, 0.5, 2.0, rate, variance)
    assert count == np.isnan(rate).sum() > 0


def reduction_case(pixels: int = PIXELS, states: int = 36) -> tuple[Float, Float, NDArray[np.float32]]:
    random = np.random.default_rng(2)
    w = random.normal(size=(states, 16))
    rate = w @ random.uniform(0.5, 2, (16, pixels)) + random.normal(0, 0.1, (states, pixels))
    return np.linalg.pinv(w), w, rate.astype(np.float32)


def applied(reduction: Float, measurement: Float, rate: NDArray[np.float32]) -> tuple[Float, Float]:
    mueller = np.empty((16, rate.shape[1]), np.float32)
    residual = np.empty(rate.shape[1], np.float32)
    solve.apply_reduction(reduction, measurement, rate, mueller, residual)
    return mueller, residual


@pytest.mark.parametrize("pixels", [1, 255, 256, 257, PIXELS])
@pytest.mark.parametrize("states", [16, 24, 36, 37])
def test_applied_reduction_equals_its_twin(pixels: int, states: int) -> None:
    reduction, w, rate = reduction_case(pixels, states)
    mueller, residual = applied(reduction, w, rate)
    expected = reduction @ rate.astype(np.float64)
    np.testing.assert_allclose(mueller, expected, rtol=1.2e-7, atol=1e-12)
    squares = np.sum((rate - w @ expected) ** 2, axis=0)
    np.testing.assert_allclose(residual, squares, rtol=1e-5, atol=1e-12)


@pytest.mark.parametrize("pixels", [257, 70_001])
def test_a_reduction_in_place_gives_the_same_bits(pixels: int) -> None:
    reduction, w, rate = reduction_case(pixels)
    mueller, residual = applied(reduction, w, rate)
    squares = np.empty_like(residual)
    solve.apply_reduction(reduction, w, rate, rate[:16], squares)
    np.testing.assert_array_equal(rate[:16], mueller)
    np.testing.assert_array_equal(squares, residual)


def test_a_missing_state_makes_its_pixel_unknown_and_no_other() -> None:
    reduction, w, rate = reduction_case()
    rate[7, 300] = np.nan
    mueller, residual = applied(reduction, w, rate)
    for values in (mueller, residual[None]):
        assert np.isnan(values[:, 300]).all()
        assert np.isfinite(np.delete(values, 300, axis=1)).all()


BYTES_OF_A_SOLUTION = """
import hashlib, sys, numpy as np
from pbrdf._kernels import planes, solve
random = np.random.default_rng(3)
pixels = 70_001
frames = random.integers(0, 65536, (2, pixels)).astype(np.uint16)
rate, rate_variance = np.empty((2, 36, pixels), np.float32)
for n in range(36):
    solve.merge_exposures(
        np.roll(frames, n, axis=1), np.full((2, pixels), 3, np.float32), np.array([0.01, 0.1]),
        60000.0, 0.5, 2.0, rate[n], rate_variance[n]
    )
w = random.normal(size=(36, 16))
mueller = np.empty((16, pixels), np.float32)
residual = np.empty(pixels, np.float32)
solve.apply_reduction(np.linalg.pinv(w), w, rate, mueller, residual)
results = (rate, rate_variance, mueller, residual)
if len(sys.argv) > 1:
    np.savez(sys.argv[1], rate=rate, rate_variance=rate_variance, mueller=mueller, residual=residual)
print(hashlib.sha256(b"".join(array.tobytes() for array in results)).hexdigest())
"""


def test_same_bytes_for_any_number_of_threads(printed_by_threads: Callable[[str], set[str]]) -> None:
    assert len(printed_by_threads(BYTES_OF_A_SOLUTION)) == 1


def test_versions_for_processors_agree(tmp_path: Path) -> None:
    best = planes.isa()
    for version in (version for version in ("v2", "v3", "v4") if version <= best):
        subprocess.run(
            [sys.executable, "-c", BYTES_OF_A_SOLUTION, str(tmp_path / version)],
            env=os.environ | {"PBRDF_ISA": version, "OPENBLAS_NUM_THREADS": "1"},
            check=True,
        )
    expected = np.load(tmp_path / f"{best}.npz")
    for file in tmp_path.iterdir():
        other = np.load(file)
        for name in expected.files:
            # the last bit of float32, and near a zero that of the terms
            scale = np.nanmax(np.abs(expected[name]))
            np.testing.assert_allclose(other[name], expected[name], rtol=1.2e-7, atol=1e-12 * scale)


def test_wrong_shapes_and_types_are_refused() -> None:
    frames, dark = np.zeros((3, 5), np.uint16), np.zeros((3, 5), np.float32)
    rate, variance = np.zeros((2, 5), np.float32)
    noise = (1000.0, 0.5, 2.0)
    with pytest.raises(ValueError, match=r"dark has shape \(2, 5\), expected \(3, 5\)"):
        solve.merge_exposures(frames, dark[:2], EXPOSURES_S, *noise, rate, variance)
    with pytest.raises(ValueError, match=r"exposures_s has shape \(2\)"):
        solve.merge_exposures(frames, dark, EXPOSURES_S[:2], *noise, rate, variance)
    with pytest.raises(ValueError, match=r"rate has shape \(4\)"):
        solve.merge_exposures(frames, dark, EXPOSURES_S, *noise, rate[:4], variance)
    for wrong in (frames.astype(np.int32), frames[:, ::2]):
        with pytest.raises(TypeError):
            solve.merge_exposures(wrong, dark, EXPOSURES_S, *noise, rate, variance)

    reduction, w, i = reduction_case(5)
    mueller, residual = np.zeros((16, 5), np.float32), np.zeros(5, np.float32)
    with pytest.raises(ValueError, match=r"reduction has shape \(36, 16\), expected \(16, 36\)"):
        solve.apply_reduction(np.ascontiguousarray(reduction.T), w, i, mueller, residual)
    with pytest.raises(ValueError, match="residual"):
        solve.apply_reduction(reduction, w, i, mueller, residual[:4])
    with pytest.raises(ValueError, match="mueller"):
        solve.apply_reduction(reduction, w, i, mueller[:15], residual)
    with pytest.raises(TypeError):
        solve.apply_reduction(reduction.astype(np.float32), w, i, mueller, residual)


def test_results_are_never_written_to_a_copy() -> None:
    """An output of another type or layout is refused, not converted and lost."""
    frames, dark = np.zeros((3, 5), np.uint16), np.zeros((3, 5), np.float32)
    for rate in (np.zeros(5), np.zeros(10, np.float32)[::2]):
        with pytest.raises(TypeError):
            solve.merge_exposures(frames, dark, EXPOSURES_S, 1000.0, 0.5, 2.0, rate, np.zeros(5, np.float32))
