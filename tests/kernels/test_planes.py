"""Weighted sums of planes against plain NumPy, on every version of the processor."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pbrdf._kernels import planes

Float = NDArray[np.float64]

BLOCK = 512


def case(dtype: str, pixels: int, states: int = 36) -> tuple[NDArray[Any], Float]:
    random = np.random.default_rng(pixels)
    top = {"uint8": 256, "uint16": 65536, "float32": 1000}[dtype]
    raw = random.uniform(0, top, (states, pixels)).astype(dtype)
    return raw, random.normal(size=(16, states))


def placed(pixels: int, offset: int) -> NDArray[np.float32]:
    """An output (16, pixels) that begins `offset` floats behind a cache line."""
    memory = np.full(16 * pixels + 64, np.nan, np.float32)
    start = (-memory.ctypes.data % 64) // 4 + offset
    return memory[start : start + 16 * pixels].reshape(16, pixels)


def bound(matrix: Float, raw: NDArray[Any]) -> Float:
    """What float32 sums in the order of the states may lose."""
    rounding: float = np.finfo(np.float32).eps
    return 0.5 * (matrix.shape[1] + 2) * rounding * (np.abs(matrix) @ np.abs(raw.astype(np.float64)))


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32"])
@pytest.mark.parametrize("pixels", [1, 15, 16, BLOCK - 16, BLOCK, BLOCK + 1, 5 * BLOCK, 40 * BLOCK + 48])
@pytest.mark.parametrize("offset", [0, 4, 13])
def test_sums_equal_their_twin_wherever_the_output_lies(dtype: str, pixels: int, offset: int) -> None:
    raw, matrix = case(dtype, pixels)
    out = placed(pixels, offset)
    planes.combine(raw, matrix, out)
    expected = matrix @ raw.astype(np.float64)
    assert np.all(np.abs(out - expected) <= bound(matrix, raw))


@pytest.mark.parametrize("states", [1, 3, 16, 24, 100])
def test_any_number_of_states(states: int) -> None:
    raw, matrix = case("uint16", 2 * BLOCK + 7, states)
    out = np.empty((16, raw.shape[1]), np.float32)
    planes.combine(raw, matrix, out)
    assert np.all(np.abs(out - matrix @ raw.astype(np.float64)) <= bound(matrix, raw))


def test_nothing_beside_the_output_is_written() -> None:
    pixels = 2 * BLOCK
    raw, matrix = case("uint16", pixels)
    memory = np.full(18 * pixels, 7.0, np.float32)
    planes.combine(raw, matrix, memory[pixels : 17 * pixels].reshape(16, pixels))
    assert np.all(memory[:pixels] == 7.0)
    assert np.all(memory[17 * pixels :] == 7.0)


def test_a_missing_state_makes_its_pixel_unknown_and_no_other() -> None:
    raw, matrix = case("float32", 3 * BLOCK)
    raw[7, 600] = np.nan
    out = placed(3 * BLOCK, 0)
    planes.combine(raw, matrix, out)
    assert np.isnan(out[:, 600]).all()
    assert np.isfinite(np.delete(out, 600, axis=1)).all()


RESULTS = """
import sys, numpy as np
from pbrdf._kernels import planes, processor
random = np.random.default_rng(3)
pixels = 70_000
out = np.empty((16, pixels), np.float32)
matrix = random.normal(size=(16, 36))
sys.stdout.buffer.write(processor.isa().encode())
for dtype in (np.uint8, np.uint16, np.float32):
    raw = random.integers(0, 256, (36, pixels)).astype(dtype)
    planes.combine(raw, matrix, out)
    sys.stdout.buffer.write(out.tobytes())
"""


def results(**environment: str) -> tuple[str, NDArray[np.float32]]:
    """Version used and all sums, in a process of their own."""
    run = subprocess.run(
        [sys.executable, "-c", RESULTS],
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1"} | environment,
        capture_output=True,
        check=True,
    )
    return run.stdout[:2].decode(), np.frombuffer(run.stdout[2:], np.float32)


def test_same_bytes_for_any_number_of_threads() -> None:
    assert results(OMP_NUM_THREADS="1")[1].tobytes() == results(OMP_NUM_THREADS="3")[1].tobytes()


def test_versions_for_processors_agree() -> None:
    best, expected = results()
    versions = [version for version in ("v2", "v3", "v4") if version <= best]
    for version in versions:
        used, sums = results(PBRDF_ISA=version)
        assert used == version
        # 36 values up to 255 by factors of about one
        np.testing.assert_allclose(sums, expected, rtol=0, atol=36 * 255 * np.finfo(np.float32).eps)
        if version >= "v3" and best >= "v3":
            assert sums.tobytes() == expected.tobytes()


def test_a_version_that_is_none_is_refused() -> None:
    with pytest.raises(subprocess.CalledProcessError) as refused:
        results(PBRDF_ISA="v9")
    assert b"PBRDF_ISA is v9; this processor has v2 to v" in refused.value.stderr


def test_wrong_shapes_and_types_are_refused() -> None:
    raw, matrix = case("uint16", 5)
    out = np.zeros((16, 5), np.float32)
    with pytest.raises(ValueError, match=r"matrix has shape \(16, 35\), expected \(16, 36\)"):
        planes.combine(raw, matrix[:, :35].copy(), out)
    with pytest.raises(ValueError, match="out has shape"):
        planes.combine(raw, matrix, out[:, :4].copy())
    for wrong in (out.astype(np.float64), np.zeros((16, 10), np.float32)[:, ::2]):
        with pytest.raises(TypeError):
            planes.combine(raw, matrix, wrong)
    with pytest.raises(TypeError):
        planes.combine(raw.astype(np.int32), matrix, out)
