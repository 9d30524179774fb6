"""The merge of exposure times against plain NumPy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pbrdf._kernels import exposures

Float = NDArray[np.float64]

SECONDS = np.array([0.004, 0.02, 0.1])
PIXELS = 1000  # not a multiple of any block
ALL = np.full(PIXELS, 3, np.uint8)


def twin(
    frames: NDArray[Any],
    dark: NDArray[Any],
    usable: NDArray[np.uint8],
    saturation: float,
    dn_per_electron: float,
    read_noise: float,
) -> tuple[Float, NDArray[np.bool_]]:
    """Weights of one rate, signal over time, of the exposures before the first that cannot be used."""
    signal = frames.astype(np.float64) - dark
    seconds = SECONDS[:, None]
    fits = (frames < saturation) & (np.arange(3)[:, None] < usable)
    counts = np.logical_and.accumulate(fits, axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        rate = np.maximum((signal * counts).sum(axis=0) / (seconds * counts).sum(axis=0), 0.0)
        weight = counts * seconds**2 / (read_noise**2 + dn_per_electron * rate * seconds)
        return (weight * signal / seconds).sum(axis=0) / weight.sum(axis=0), counts


def merged(
    frames: NDArray[Any], dark: NDArray[np.float32], usable: NDArray[np.uint8], *noise: float
) -> tuple[NDArray[np.float32], NDArray[np.uint8], int]:
    """Of one state between two others of darkness."""
    pixels = frames.shape[1]
    rate, used = np.empty((3, pixels), np.float32), np.empty((3, pixels), np.uint8)
    states = np.stack([np.zeros_like(frames), frames, np.zeros_like(frames)])
    missing = exposures.merge(states, dark, usable, SECONDS, *noise, rate, used)
    assert missing[0] == missing[2] == (usable == 0).sum()
    return rate[1], used[1], missing[1]


def scene(dtype: str, saturation: float) -> tuple[NDArray[Any], NDArray[np.float32]]:
    """Three exposures of rates over four decades, the brightest saturated in all of them."""
    random = np.random.default_rng(1)
    rate = saturation * np.geomspace(0.1, 1000, PIXELS)
    dark = random.uniform(1, 3, (3, PIXELS)).astype(np.float32)
    values = rate * SECONDS[:, None] + dark + random.normal(0, 1, (3, PIXELS))
    values = np.clip(values, 0, saturation)
    return (values if dtype == "float32" else np.round(values)).astype(dtype), dark


@pytest.mark.parametrize(
    ("dtype", "saturation"), [("uint8", 255.0), ("uint16", 65532.0), ("uint16", 4000.0), ("float32", 0.7e4)]
)
def test_merged_exposures_equal_their_twin(dtype: str, saturation: float) -> None:
    frames, dark = scene(dtype, saturation)
    usable = np.random.default_rng(2).integers(0, 4, PIXELS).astype(np.uint8)
    noise = (saturation, 0.5, 2.0)
    rate, used, missing = merged(frames, dark, usable, *noise)
    expected, counts = twin(frames, dark, usable, *noise)
    np.testing.assert_array_equal(used, counts.sum(axis=0))
    unknown = used == 0
    assert missing == unknown.sum()
    assert 0 < missing < PIXELS
    np.testing.assert_array_equal(np.isnan(rate), unknown)
    # sums of three products in float32
    largest = np.abs(frames.astype(np.float64) / SECONDS[:, None]).max(axis=0)
    assert (np.abs(rate - expected) / largest)[~unknown].max() < 4e-7


def test_a_saturated_exposure_has_no_weight_and_no_longer_one() -> None:
    frames = np.array([[40, 40], [200, 255], [255, 200]], np.uint8)
    rate, used, _ = merged(frames, np.zeros((3, 2), np.float32), ALL[:2], 255.0, 0.0, 2.0)
    short, middle = SECONDS[:2]
    assert rate[0] == pytest.approx((40 * short + 200 * middle) / (short**2 + middle**2), rel=1e-6)
    assert rate[1] == pytest.approx(40 / short, rel=1e-6)
    assert used.tolist() == [2, 1]


def test_a_value_below_the_dark_level_keeps_its_sign() -> None:
    frames = np.full((3, 1), 2, np.uint16)
    rate, _, _ = merged(frames, np.full((3, 1), 5, np.float32), ALL[:1], 1000.0, 0.5, 2.0)
    assert rate[0] < 0


def test_weak_light_is_not_told_too_weak() -> None:
    """Weights by each value's own noise would prefer the values that came out low, by about an electron."""
    random, count, electrons = np.random.default_rng(3), 400_000, 20.0
    rate = electrons / SECONDS[-1]
    frames = random.poisson(rate * SECONDS[:, None], (3, count)) + random.normal(0, 0.5, (3, count))
    usable = np.full(count, 3, np.uint8)
    result, _, _ = merged(frames.astype(np.float32), np.zeros((3, count), np.float32), usable, 1e9, 1.0, 0.5)
    scatter = result.std(dtype=np.float64) / np.sqrt(count)
    assert abs(result.mean(dtype=np.float64) - rate) < 4 * scatter


BYTES_OF_A_MERGE = """
import hashlib, numpy as np
from pbrdf._kernels import exposures
pixels = 70_001
frames = np.random.default_rng(3).integers(0, 65536, (2, pixels)).astype(np.uint16)
rate, used = np.empty((1, pixels), np.float32), np.empty((1, pixels), np.uint8)
dark, usable = np.full((2, pixels), 3, np.float32), np.full(pixels, 2, np.uint8)
exposures.merge(frames[None], dark, usable, np.array([0.01, 0.1]), 60000.0, 0.5, 2.0, rate, used)
print(hashlib.sha256(rate.tobytes() + used.tobytes()).hexdigest())
"""


def test_same_bytes_for_any_number_of_threads(printed_by_threads: Callable[[str], set[str]]) -> None:
    assert len(printed_by_threads(BYTES_OF_A_MERGE)) == 1


def test_wrong_shapes_and_types_are_refused() -> None:
    frames, dark = np.zeros((1, 3, 5), np.uint16), np.zeros((3, 5), np.float32)
    usable, rate, used = ALL[:5], np.zeros((1, 5), np.float32), np.zeros((1, 5), np.uint8)
    noise = (1000.0, 0.5, 2.0)
    with pytest.raises(ValueError, match=r"dark has shape \(2, 5\), expected \(3, 5\)"):
        exposures.merge(frames, dark[:2], usable, SECONDS, *noise, rate, used)
    with pytest.raises(ValueError, match=r"exposures_s has shape \(2\)"):
        exposures.merge(frames, dark, usable, SECONDS[:2], *noise, rate, used)
    with pytest.raises(ValueError, match=r"rate has shape \(1, 4\)"):
        exposures.merge(frames, dark, usable, SECONDS, *noise, rate[:, :4].copy(), used)
    with pytest.raises(ValueError, match="there are 256 exposures"):
        many = np.zeros((256, 5), np.uint16)
        exposures.merge(
            many[None], many.astype(np.float32), usable, np.arange(1.0, 257.0), *noise, rate, used
        )
    for wrong in (frames.astype(np.int32), frames[..., ::2]):
        with pytest.raises(TypeError):
            exposures.merge(wrong, dark, usable, SECONDS, *noise, rate, used)
    # an output of another type or layout is refused, not converted and lost
    for wrong in (np.zeros((1, 5)), np.zeros((1, 10), np.float32)[:, ::2]):
        with pytest.raises(TypeError):
            exposures.merge(frames, dark, usable, SECONDS, *noise, wrong, used)
