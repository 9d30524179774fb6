"""Values at nodes from cells: exact for quadratics wherever the pixels lie, and least squares' own noise."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from pbrdf._kernels import cell_fit, cell_sums

Float = NDArray[np.float64]

GRID = (7, 8)
"""Cells of θh and φd."""


def sums_of(values: Float, j: Float, k: Float, variance: Float | None = None) -> NDArray[np.float32]:
    """Sums (cells, 40) of pixels (n, 16) at the places j, k; k runs around."""
    cell_j, cell_k = np.rint(j), np.rint(k)
    cell = (cell_j * GRID[1] + cell_k % GRID[1]).astype(int)
    x, y = j - cell_j, k - cell_k
    spread = np.ones_like(values) if variance is None else variance
    columns = [*values.T, *spread.T, np.ones_like(x), x, y, x * x, x * y, y * y, 0 * x, 0 * x]
    sums = [np.bincount(cell, column, GRID[0] * GRID[1]) for column in columns]
    return np.ascontiguousarray(np.stack(sums, axis=-1), np.float32)


def fitted(
    sums: NDArray[np.float32], stride: tuple[int, int] = (1, 1)
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.uint16]]:
    nodes = (GRID[0] - 1) // stride[0] + 1, GRID[1] // stride[1]
    mueller, variance = np.empty((2, *nodes, 16), np.float32)
    count = np.empty(nodes, np.uint16)
    cell_fit.fit(sums, GRID, stride, mueller, variance, count)
    return mueller, variance, count


def places(number: int, seed: int = 1) -> tuple[Float, Float]:
    random = np.random.default_rng(seed)
    return random.uniform(0, GRID[0] - 1, number), random.uniform(0, GRID[1], number)


def quadratic(j: Float, k: Float) -> Float:
    """Sixteen functions of second order in j, and constant or of one turn in k."""
    factors = np.random.default_rng(2).normal(size=(16, 3))
    return np.stack([a + b * j + c * j**2 for a, b, c in factors], axis=-1)


def test_quadratics_are_found_exactly_wherever_the_pixels_lie() -> None:
    j, k = places(1500)
    mueller, _, count = fitted(sums_of(quadratic(j, k), j, k))
    inner = count[1:-1] > 0
    assert inner.mean() > 0.95
    expected = quadratic(*np.meshgrid(np.arange(1.0, GRID[0] - 1), np.arange(GRID[1]), indexing="ij"))
    np.testing.assert_allclose(mueller[1:-1][inner], expected[inner], rtol=1e-4, atol=1e-4)


def test_quadratics_of_both_angles_away_from_the_seam() -> None:
    j, k = places(1500)
    values = np.repeat((1 + (k - 4) ** 2 + 0.5 * (k - 4) * j - j)[:, None], 16, axis=1)
    mueller, _, count = fitted(sums_of(values, j, k))
    assert count[3, 4] > 0
    assert mueller[3, 4, 0] == pytest.approx(1 - 3, abs=1e-4)
    assert mueller[2, 5, 0] == pytest.approx(1 + 1 + 0.5 * 2 - 2, abs=1e-4)


def test_the_seam_of_phi_d_is_none() -> None:
    """Functions of one turn: at k = 0 the neighbours at the other end count as beside it."""
    j, k = places(20_000)
    values = np.repeat(np.cos(2 * np.pi * k / GRID[1])[:, None], 16, axis=1)
    mueller, _, _ = fitted(sums_of(values, j, k))
    found = mueller[3, :, 0]
    np.testing.assert_allclose(found, np.cos(2 * np.pi * np.arange(8) / 8), atol=0.06)
    np.testing.assert_allclose(found[0] - found[1], found[0] - found[7], atol=0.02)


def test_evenly_filled_cells_weigh_as_a_quadratic_does() -> None:
    """As Savitzky & Golay (1964) weigh nine points in two angles, less the curvature within a cell.

    Their smoothed value is 5/9, 2/9 and −1/9 of the points, their second derivatives are thirds of
    (1, −2, 1); the mean of x² over a cell is what a mean is off by, half a second derivative of each angle.
    """
    at = (np.arange(8) + 0.5) / 8 - 0.5
    j, k = (
        place.ravel()
        for place in np.meshgrid(
            (np.arange(GRID[0])[:, None] + at).ravel(), (np.arange(GRID[1])[:, None] + at).ravel()
        )
    )
    response = np.empty((3, 3))
    for dj in (-1, 0, 1):
        for dk in (-1, 0, 1):
            one = (np.rint(j) == 3 + dj) & (np.rint(k) == 4 + dk)
            response[dj + 1, dk + 1] = fitted(sums_of(one[:, None] * np.ones(16), j, k))[0][3, 4, 0]
    second = np.outer([1, -2, 1], [1, 1, 1]) / 3
    expected = np.array([[-1, 2, -1], [2, 5, 2], [-1, 2, -1]]) / 9 - np.mean(at**2) / 2 * (second + second.T)
    np.testing.assert_allclose(response, expected, atol=1e-6)
    _, variance, count = fitted(sums_of(np.ones((len(j), 16)), j, k))
    assert count[3, 4] == 9 * 64
    np.testing.assert_allclose(variance[3, 4], np.sum(expected**2) / 64, rtol=1e-5)


def test_variance_is_that_of_repeated_noise() -> None:
    j, k = places(800)
    random = np.random.default_rng(4)
    spread = random.uniform(0.2, 2.0, (len(j), 16))
    repeats = np.stack(
        [fitted(sums_of(random.normal(size=spread.shape) * np.sqrt(spread), j, k))[0] for _ in range(400)]
    )
    _, variance, count = fitted(sums_of(np.zeros_like(spread), j, k, spread))
    known = count > 0
    ratio = repeats.var(axis=0, ddof=1)[known] / variance[known]
    np.testing.assert_allclose(ratio.mean(), 1.0, atol=0.02)
    np.testing.assert_allclose(ratio, 1.0, atol=5.5 * np.sqrt(2 / 399))


def test_nodes_beside_an_empty_cell_are_left_to_others() -> None:
    j, k = places(3000)
    kept = ~((np.rint(j) == 3) & (np.rint(k) == 4))
    _, _, whole = fitted(sums_of(np.ones((len(j), 16)), j, k))
    mueller, variance, count = fitted(sums_of(np.ones((kept.sum(), 16)), j[kept], k[kept]))
    lost = (whole > 0) & (count == 0)
    expected = np.zeros_like(lost)
    expected[2:5, 3:6] = True
    np.testing.assert_array_equal(lost, expected & (whole > 0))
    assert np.isnan(mueller[count == 0]).all()
    assert np.isnan(variance[count == 0]).all()


def test_a_few_pixels_are_left_to_interpolation() -> None:
    """One pixel a cell would tell its node with more noise than four around it do."""
    j, k = (place.ravel() for place in np.meshgrid(np.arange(7.0), np.arange(8.0), indexing="ij"))
    assert np.all(fitted(sums_of(np.ones((len(j), 16)), j, k))[2] == 0)


def test_nodes_may_lie_on_every_second_cell() -> None:
    j, k = places(1500)
    sums = sums_of(quadratic(j, k), j, k)
    for every, some in zip(fitted(sums), fitted(sums, (3, 2)), strict=True):
        np.testing.assert_array_equal(some, every[::3, ::2])


def test_a_stride_that_does_not_divide_the_grid_is_refused() -> None:
    sums = np.zeros((GRID[0] * GRID[1], cell_sums.SUMS_PER_CELL), np.float32)
    for stride in ((4, 1), (1, 3), (0, 1)):
        with pytest.raises(ValueError, match="stride"):
            cell_fit.fit(
                sums,
                GRID,
                stride,
                np.empty((1, 1, 16), np.float32),
                np.empty((1, 1, 16), np.float32),
                np.empty((1, 1), np.uint16),
            )
