"""Rates to Mueller elements and their variances, against plain NumPy."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from pbrdf._kernels import processor, solve

Float = NDArray[np.float64]

SECONDS = np.array([0.004, 0.02, 0.1])
GAIN, READ_NOISE, DARK_VARIANCE = 0.5, 2.0, 1.3
PIXELS = 1000  # not a multiple of any block


@dataclass
class Solution:
    mueller: NDArray[np.float32]
    variance: NDArray[np.float32]
    residual: NDArray[np.float32]
    expected: NDArray[np.float32]


def case(pixels: int = PIXELS, states: int = 36) -> tuple[Float, NDArray[np.float32]]:
    """A well-conditioned W of positive rows, and rates with noise."""
    random = np.random.default_rng(2)
    w = random.uniform(0, 1, (states, 16)) + 2 * np.eye(16)[np.arange(states) % 16]
    rate = w @ random.uniform(200, 2000, (16, pixels))
    return w, (rate + random.normal(0, 30, rate.shape)).astype(np.float32)


def solved(
    w: Float,
    rate: NDArray[np.float32],
    used: NDArray[np.uint8],
    inverse_flat: NDArray[np.float32] | None = None,
    dark_variance: float = DARK_VARIANCE,
) -> Solution:
    pixels = rate.shape[1]
    mueller, variance = np.empty((2, 16, pixels), np.float32)
    residual, expected = np.empty((2, pixels), np.float32)
    noise = (SECONDS, GAIN, READ_NOISE, dark_variance)
    out = (mueller, variance, residual, expected)
    solve.solve(np.linalg.pinv(w), w, *noise, rate, used, inverse_flat, *out)
    return Solution(*out)


def certainties(rate: Float, used: NDArray[np.uint8]) -> Float:
    """Inverse variance that each exposure adds to a rate; (exposures, …)."""
    seconds = SECONDS.reshape(-1, *[1] * rate.ndim)
    counts = np.arange(len(SECONDS)).reshape(seconds.shape) < used
    return counts * seconds**2 / (READ_NOISE**2 + GAIN * np.maximum(rate, 0.0) * seconds)


def even_twin(w: Float, rate: Float, used: NDArray[np.uint8]) -> tuple[Float, Float, float, float]:
    """One pixel by W⁺; what the dark frames of all exposures shift is the same in every state."""
    reduction = np.linalg.pinv(w)
    mueller = reduction @ rate
    spread = 1.0 / certainties(w @ mueller, used).sum(axis=0)
    mean = certainties(np.array(rate.mean()), used[0])
    shift = ((mean / SECONDS) ** 2).sum() / mean.sum() ** 2
    variance = reduction**2 @ spread + DARK_VARIANCE * shift * reduction.sum(axis=1) ** 2
    leverage = np.einsum("nk,kn->n", w, reduction)
    return mueller, variance, ((rate - w @ mueller) ** 2).sum(), (spread * (1 - leverage)).sum()


def uneven_twin(w: Float, rate: Float, used: NDArray[np.uint8]) -> tuple[Float, Float, float, float]:
    """One pixel by weighted least squares, each exposure's dark frame on its own."""
    fitted = w @ np.linalg.pinv(w) @ rate
    certainty = certainties(np.where(used > used.min(), rate, fitted), used)
    spread = 1.0 / certainty.sum(axis=0)
    covariance = np.linalg.inv((w / spread[:, None]).T @ w)
    mueller = covariance @ (w.T @ (rate / spread))
    shift = covariance @ w.T @ (certainty / SECONDS[:, None]).T
    variance = np.diag(covariance) + DARK_VARIANCE * (shift**2).sum(axis=1)
    expected = spread.sum() - np.trace(w @ covariance @ w.T)
    return mueller, variance, ((rate - w @ mueller) ** 2).sum(), expected


@pytest.mark.parametrize("pixels", [1, 255, 256, 257, PIXELS])
@pytest.mark.parametrize("states", [16, 24, 36, 37])
def test_pixels_of_even_exposures_equal_their_twin(pixels: int, states: int) -> None:
    w, rate = case(pixels, states)
    used = np.tile(np.random.default_rng(1).integers(1, 4, pixels).astype(np.uint8), (states, 1))
    solution = solved(w, rate, used)
    for p in range(0, pixels, 7):
        mueller, variance, residual, expected = even_twin(w, rate[:, p].astype(np.float64), used[:, p])
        np.testing.assert_allclose(solution.mueller[:, p], mueller, rtol=1.2e-7, atol=1e-6)
        np.testing.assert_allclose(solution.variance[:, p], variance, rtol=2e-6)
        # of rates of 2e4 in float32
        assert solution.residual[p] == pytest.approx(residual, rel=1e-3, abs=states * 0.01**2)
        # differences of leverages, which sixteen states leave none of
        assert solution.expected[p] == pytest.approx(expected, rel=1e-5, abs=1e-4 * variance.sum())


@pytest.mark.parametrize("pixels", [1, 7, 16, 257, PIXELS])
@pytest.mark.parametrize("states", [16, 36, 37])
def test_pixels_of_uneven_exposures_equal_their_twin(pixels: int, states: int) -> None:
    w, rate = case(pixels, states)
    used = np.random.default_rng(1).integers(1, 4, (states, pixels)).astype(np.uint8)
    solution = solved(w, rate, used)
    assert (used.min(axis=0) < used.max(axis=0)).all()
    for p in range(0, pixels, 7):
        mueller, variance, residual, expected = uneven_twin(w, rate[:, p].astype(np.float64), used[:, p])
        np.testing.assert_allclose(solution.mueller[:, p], mueller, rtol=3e-6)
        np.testing.assert_allclose(solution.variance[:, p], variance, rtol=2e-5)
        assert solution.residual[p] == pytest.approx(residual, rel=1e-4, abs=1e-3)
        assert solution.expected[p] == pytest.approx(expected, rel=1e-4, abs=1e-4 * variance.sum())


def test_a_pixel_is_solved_alike_whatever_stands_beside_it() -> None:
    w, rate = case(40)
    used = np.full((36, 40), 3, np.uint8)
    used[::3, ::2] = 1
    together = solved(w, rate, used)
    for p in (0, 1, 38, 39):
        alone = solved(w, np.ascontiguousarray(rate[:, p : p + 1]), np.ascontiguousarray(used[:, p : p + 1]))
        np.testing.assert_array_equal(together.mueller[:, p], alone.mueller[:, 0])
        np.testing.assert_array_equal(together.variance[:, p], alone.variance[:, 0])


@pytest.mark.parametrize("pixels", [257, 70_001])
def test_a_solution_in_place_gives_the_same_bits(pixels: int) -> None:
    w, rate = case(pixels)
    used = np.random.default_rng(1).integers(1, 4, rate.shape).astype(np.uint8)
    apart = solved(w, rate, used)
    residual, expected = np.empty((2, pixels), np.float32)
    noise = (SECONDS, GAIN, READ_NOISE, DARK_VARIANCE)
    solve.solve(np.linalg.pinv(w), w, *noise, rate, used, None, rate[:16], rate[16:32], residual, expected)
    np.testing.assert_array_equal(rate[:16], apart.mueller)
    np.testing.assert_array_equal(rate[16:32], apart.variance)
    np.testing.assert_array_equal(residual, apart.residual)
    np.testing.assert_array_equal(expected, apart.expected)


def test_a_flat_field_divides_elements_and_deviations() -> None:
    w, rate = case()
    used = np.random.default_rng(1).integers(1, 4, rate.shape).astype(np.uint8)
    plain = solved(w, rate, used)
    inverse = np.random.default_rng(4).uniform(0.5, 2, PIXELS).astype(np.float32)
    flat = solved(w, rate, used, inverse)
    np.testing.assert_allclose(flat.mueller, plain.mueller * inverse, rtol=2e-7)
    np.testing.assert_allclose(flat.variance, plain.variance * inverse**2, rtol=3e-7)
    np.testing.assert_array_equal(flat.residual, plain.residual)


def test_a_missing_state_makes_its_pixel_unknown_and_no_other() -> None:
    w, rate = case()
    used = np.full(rate.shape, 3, np.uint8)
    rate[7, 300], used[7, 300] = np.nan, 0
    solution = solved(w, rate, used)
    for values in (solution.mueller, solution.variance, solution.residual[None], solution.expected[None]):
        assert np.isnan(values[:, 300]).all()
        assert np.isfinite(np.delete(values, 300, axis=1)).all()


BYTES_OF_A_SOLUTION = """
import hashlib, sys, numpy as np
from pbrdf._kernels import solve
random = np.random.default_rng(3)
pixels, states = 30_001, 36
w = random.uniform(0, 1, (states, 16)) + 2 * np.eye(16)[np.arange(states) % 16]
rate = w @ random.uniform(200, 2000, (16, pixels)) + random.normal(0, 30, (states, pixels))
rate = rate.astype(np.float32)
used = np.full((states, pixels), 2, np.uint8)
used[::5, ::2] = 1
results = {name: np.empty((16, pixels), np.float32) for name in ("mueller", "variance")}
results |= {name: np.empty(pixels, np.float32) for name in ("residual", "expected")}
solve.solve(np.linalg.pinv(w), w, np.array([0.01, 0.1]), 0.5, 2.0, 1.0, rate, used, None, *results.values())
if len(sys.argv) > 1:
    np.savez(sys.argv[1], **results)
print(hashlib.sha256(b"".join(array.tobytes() for array in results.values())).hexdigest())
"""


def test_same_bytes_for_any_number_of_threads(printed_by_threads: Callable[[str], set[str]]) -> None:
    assert len(printed_by_threads(BYTES_OF_A_SOLUTION)) == 1


def test_versions_for_processors_agree(tmp_path: Path) -> None:
    best = processor.isa()
    for version in (version for version in ("v2", "v3", "v4") if version <= best):
        subprocess.run(
            [sys.executable, "-c", BYTES_OF_A_SOLUTION, str(tmp_path / version)],
            env=os.environ | {"PBRDF_ISA": version, "OPENBLAS_NUM_THREADS": "1"},
            check=True,
        )
    expected = np.load(tmp_path / f"{best}.npz")
    for file in tmp_path.iterdir():
        other = np.load(file)
        # elements are sums of double precision, rounded once; the rest holds variances of float32
        np.testing.assert_allclose(other["mueller"], expected["mueller"], rtol=3e-6)
        for name in ("variance", "residual", "expected"):
            np.testing.assert_allclose(other[name], expected[name], rtol=1e-4)


def test_wrong_shapes_and_types_are_refused() -> None:
    w, rate = case(5)
    reduction, used = np.linalg.pinv(w), np.ones((36, 5), np.uint8)
    mueller, variance, pixels = (
        np.zeros((16, 5), np.float32),
        np.zeros((16, 5), np.float32),
        np.zeros(5, np.float32),
    )
    noise = (SECONDS, 0.5, 2.0, 0.0)
    with pytest.raises(ValueError, match=r"reduction has shape \(36, 16\), expected \(16, 36\)"):
        turned = np.ascontiguousarray(reduction.T)
        solve.solve(turned, w, *noise, rate, used, None, mueller, variance, pixels, pixels.copy())
    with pytest.raises(ValueError, match="residual"):
        solve.solve(reduction, w, *noise, rate, used, None, mueller, variance, pixels[:4], pixels)
    with pytest.raises(ValueError, match="used"):
        solve.solve(reduction, w, *noise, rate, used[:9], None, mueller, variance, pixels, pixels.copy())
    with pytest.raises(ValueError, match="inverse_flat"):
        solve.solve(reduction, w, *noise, rate, used, pixels[:2], mueller, variance, pixels, pixels.copy())
    with pytest.raises(TypeError):
        single = reduction.astype(np.float32)
        solve.solve(single, w, *noise, rate, used, None, mueller, variance, pixels, pixels.copy())
