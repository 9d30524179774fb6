"""Half precision against NumPy's."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest
from pbrdf._kernels import halves, processor

ALL_HALVES = np.arange(65536, dtype=np.uint16).view(np.float16)


def converted(values: np.ndarray, factor: float = 1.0) -> np.ndarray:
    bits = np.empty(values.shape, np.uint16)
    halves.convert(values, factor, bits)
    return bits.view(np.float16)


def hard_values() -> np.ndarray:
    """All halves, the middles between neighbours, a step beside each, and what is beyond."""
    finite = np.sort(ALL_HALVES[np.isfinite(ALL_HALVES)].astype(np.float32))
    middles = (finite[1:] + finite[:-1]) / 2
    near = [np.nextafter(middles, np.float32(side)) for side in (-np.inf, np.inf)]
    beyond = np.array([65519.996, 65520.0, 7e4, np.inf, -np.inf, np.nan, 1e-9, -1e-40], np.float32)
    return np.concatenate([finite, middles, *near, beyond]).astype(np.float32)


def test_every_half_and_all_ties_round_as_numpy_does() -> None:
    values = hard_values()
    with np.errstate(over="ignore"):
        expected = values.astype(np.float16)
    np.testing.assert_array_equal(converted(values), expected)
    np.testing.assert_array_equal(np.signbit(converted(values)), np.signbit(expected))


@pytest.mark.parametrize("count", [0, 1, 15, 16384, 50_001])
def test_values_are_scaled_first(count: int) -> None:
    values = np.random.default_rng(1).lognormal(0, 2, count).astype(np.float32)
    factor = np.float32(0.37)
    np.testing.assert_array_equal(converted(values, factor), (values * factor).astype(np.float16))


VERSION = """
import sys, numpy as np
from pbrdf._kernels import halves
values = np.load(sys.argv[1])
bits = np.empty(values.shape, np.uint16)
halves.convert(values, 1.0, bits)
np.save(sys.argv[2], bits)
"""


def test_versions_for_processors_agree(tmp_path: os.PathLike[str]) -> None:
    values = hard_values()
    np.save(f"{tmp_path}/values.npy", values)
    expected = converted(values)
    for version in (version for version in ("v2", "v3", "v4") if version <= processor.isa()):
        result = f"{tmp_path}/{version}.npy"
        subprocess.run(
            [sys.executable, "-c", VERSION, f"{tmp_path}/values.npy", result],
            env=os.environ | {"PBRDF_ISA": version},
            check=True,
        )
        np.testing.assert_array_equal(np.load(result).view(np.float16), expected)
