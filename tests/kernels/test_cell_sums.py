"""Sums over the pixels of each cell, against NumPy's bincount."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from pbrdf._kernels import cell_sums, pixel_cells

Float = NDArray[np.float32]

CELLS = 50
SHAPES = [(1, 1), (3, 63), (7, 64), (40, 129), (9, 500)]


def case(shape: tuple[int, int]) -> tuple[Float, Float, NDArray[np.int32], Float, Float, Float]:
    """Images, variances, cells in runs as neighbours share them, places and gains."""
    random = np.random.default_rng(shape[1])
    mueller, variance = random.normal(size=(2, 16, *shape)).astype(np.float32)
    cell = np.repeat(random.integers(-1, CELLS, shape), 3, axis=1)[:, : shape[1]].astype(np.int32)
    x, y = random.uniform(-0.5, 0.5, (2, *shape)).astype(np.float32)
    gain = random.uniform(0.1, 3.0, shape).astype(np.float32)
    return mueller, variance, np.ascontiguousarray(cell), x, y, gain


def summed(*arrays: NDArray[np.generic]) -> Float:
    out = np.full((CELLS, cell_sums.SUMS_PER_CELL), np.nan, np.float32)
    cell_sums.sum(*arrays, out)
    return out


def twin(mueller: Float, variance: Float, cell: NDArray[np.int32], x: Float, y: Float, gain: Float) -> Float:
    counted = (cell != pixel_cells.NO_CELL) & np.isfinite(mueller[0])
    g = gain.astype(np.float64)
    planes = [*(g * mueller), *(g**2 * variance), np.ones_like(x), x, y, x * x, x * y, y * y]
    sums = [np.bincount(cell[counted], plane[counted], CELLS) for plane in planes]
    return np.stack([*sums, np.zeros(CELLS), np.zeros(CELLS)], axis=-1)


@pytest.mark.parametrize("shape", SHAPES)
def test_sums_equal_their_twin(shape: tuple[int, int]) -> None:
    arrays = case(shape)
    np.testing.assert_allclose(summed(*arrays), twin(*arrays), rtol=1e-4, atol=1e-4)


def test_a_missing_pixel_is_left_out() -> None:
    arrays = case((40, 129))
    arrays[0][:, 5, 7:60] = np.nan
    found = summed(*arrays)
    assert np.isfinite(found).all()
    np.testing.assert_allclose(found, twin(*arrays), rtol=1e-4, atol=1e-4)


def test_a_picture_without_the_sphere_sums_to_nothing() -> None:
    arrays = case((7, 64))
    arrays[2][:] = pixel_cells.NO_CELL
    np.testing.assert_array_equal(summed(*arrays), 0.0)


@pytest.mark.parametrize("cell", [-2, CELLS])
def test_a_cell_beyond_the_grid_is_refused(cell: int) -> None:
    arrays = case((7, 64))
    arrays[2][6, 63] = cell
    with pytest.raises(ValueError, match="beyond"):
        summed(*arrays)


BYTES_OF_SUMS = """
import hashlib, numpy as np
from pbrdf._kernels import cell_sums
random = np.random.default_rng(1)
mueller, variance = random.normal(size=(2, 16, 90, 333)).astype(np.float32)
cell = random.integers(-1, 20, (90, 333), dtype=np.int32)
x, y, gain = random.uniform(0.1, 0.5, (3, 90, 333)).astype(np.float32)
out = np.empty((20, 40), np.float32)
cell_sums.sum(mueller, variance, cell, x, y, gain, out)
print(hashlib.sha256(out.tobytes()).hexdigest())
"""


def test_same_bytes_for_any_number_of_threads(printed_by_threads: Callable[[str], set[str]]) -> None:
    assert len(printed_by_threads(BYTES_OF_SUMS)) == 1
