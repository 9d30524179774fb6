"""Partners by symmetry against plain NumPy, node by node."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from pbrdf._kernels import symmetry

from pbrdf.formats.table_data import Origin

Float = NDArray[np.float64]
Arrays = tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.uint16], NDArray[np.uint8]]

Q, P = np.diag([1.0, 1.0, -1.0, -1.0]), np.diag([1.0, 1.0, -1.0, 1.0])
TELL: list[Callable[[Float], Float]] = [
    lambda m: m,
    lambda m: Q @ m @ Q,
    lambda m: P @ m.T @ P,
    lambda m: Q @ P @ m.T @ P @ Q,
]


def band(azimuths: int, seed: int = 1) -> Arrays:
    """Measurements that agree with no symmetry, some nodes unseen, ends of the circle equal."""
    random = np.random.default_rng(seed)
    shape = (3, 2, azimuths)
    mueller = random.normal(size=(*shape, 4, 4)).astype(np.float32)
    variance = random.uniform(0.5, 2, (*shape, 4, 4)).astype(np.float32)
    count = random.integers(1, 9, shape).astype(np.uint16)
    origin = random.choice([Origin.UNSEEN, Origin.MEASURED], shape, p=[0.4, 0.6]).astype(np.uint8)
    mueller[origin == Origin.UNSEEN] = variance[origin == Origin.UNSEEN] = np.nan
    count[origin == Origin.UNSEEN] = 0
    for array in (mueller, variance, count, origin):
        array[:, :, -1] = array[:, :, 0]
    return mueller, variance, count, origin


def partners(k: int, around: int) -> list[int]:
    """Azimuths that hold the matrix of azimuth k: itself, mirror image, exchange, both."""
    if around % 2:
        return [k, -k % around]
    half = around // 2
    return [k, -k % around, (k + half) % around, (half - k) % around]


@pytest.mark.parametrize("azimuths", [13, 15, 25, 14])
def test_pooled_nodes_equal_their_twin(azimuths: int) -> None:
    arrays = band(azimuths)
    weight = np.random.default_rng(2).uniform(0.2, 1, (3, 2, azimuths))
    weight[..., -1] = weight[..., 0]
    mueller, variance, count, origin = (array.copy() for array in arrays)
    symmetry.pool(mueller, variance, count, origin, weight)
    around = azimuths - 1
    for h in range(1, 3):
        for d in range(2):
            for k in range(azimuths):
                of = partners(k % around, around)
                seen = [t for t, q in enumerate(of) if arrays[3][h, d, q] == Origin.MEASURED]
                if not seen:
                    assert origin[h, d, k] == Origin.UNSEEN
                    continue
                share = {t: float(arrays[2][h, d, of[t]]) * weight[h, d, of[t]] for t in seen}
                total = sum(share.values())
                mean = sum(share[t] * TELL[t](arrays[0][h, d, of[t]].astype(float)) for t in seen) / total
                np.testing.assert_allclose(mueller[h, d, k], mean, rtol=1e-5, atol=1e-6)
                np.testing.assert_allclose(
                    variance[h, d, k], spread(arrays[1][h, d], of, share) / total**2, rtol=1e-5
                )
                assert count[h, d, k] == sum(int(arrays[2][h, d, q]) for q in {of[t] for t in seen})


def spread(variance: NDArray[np.float32], of: list[int], share: dict[int, float]) -> Float:
    """Variance of the weighted sum: weights of one element of one node add before they are squared."""
    out = np.zeros((4, 4))
    for i in range(4):
        for j in range(4):
            weights: dict[tuple[int, int, int], float] = {}
            for t, w in share.items():
                element = (of[t], *((j, i) if t >= 2 else (i, j)))
                weights[element] = weights.get(element, 0.0) + w
            out[i, j] = sum(w**2 * variance[element] for element, w in weights.items())
    return out


@pytest.mark.parametrize("azimuths", [13, 14])
def test_pooling_leaves_the_pole_and_what_lies_below_the_horizon(azimuths: int) -> None:
    arrays = band(azimuths)
    arrays[3][2, 1] = Origin.NEVER_VISIBLE
    before = [array.copy() for array in arrays]
    symmetry.pool(*arrays, np.ones((3, 2, azimuths)))
    for array, old in zip(arrays, before, strict=True):
        np.testing.assert_array_equal(array[0], old[0])
        np.testing.assert_array_equal(array[2, 1], old[2, 1])


@pytest.mark.parametrize("azimuths", [13, 14])
def test_copies_equal_their_twin(azimuths: int) -> None:
    arrays = band(azimuths)
    mueller, variance, count, origin = (array.copy() for array in arrays)
    symmetry.copy(mueller, variance, count, origin)
    around = azimuths - 1
    for h in range(1, 3):
        for d in range(2):
            for k in range(azimuths):
                if arrays[3][h, d, k] == Origin.MEASURED:
                    np.testing.assert_array_equal(mueller[h, d, k], arrays[0][h, d, k])
                    continue
                of = partners(k % around, around)
                t = next((t for t, q in enumerate(of) if arrays[3][h, d, q] == Origin.MEASURED), None)
                if t is None:
                    assert origin[h, d, k] == Origin.UNSEEN
                    continue
                assert origin[h, d, k] == (Origin.MIRRORED if t == 1 else Origin.RECIPROCAL)
                np.testing.assert_allclose(mueller[h, d, k], TELL[t](arrays[0][h, d, of[t]].astype(float)))
                told = arrays[1][h, d, of[t]]
                np.testing.assert_array_equal(variance[h, d, k], told.T if t >= 2 else told)
                assert count[h, d, k] == arrays[2][h, d, of[t]]


def test_disagreement_equals_its_twin() -> None:
    mueller, variance, _, origin = band(25)
    out = np.empty((3, 2, 2, 50))
    symmetry.compare(mueller, variance, origin, out)
    alone = np.empty_like(out)
    symmetry.compare(mueller, None, origin, alone)
    np.testing.assert_array_equal(alone[..., :18], out[..., :18])
    assert not alone[..., 18:].any()
    assert not out[0].any()
    for h, d, kind in itertools.product((1, 2), (0, 1), (1, 2)):
        expected = np.zeros(50)
        for k in range(24):
            q = partners(k, 24)[kind]
            if q <= k or not (origin[h, d, [k, q]] == Origin.MEASURED).all():
                continue
            one, other = mueller[h, d, k].astype(float), mueller[h, d, q].astype(float)
            off = one - TELL[kind](other)
            other_spread = variance[h, d, q].T if kind == 2 else variance[h, d, q]
            squares = off**2 / (variance[h, d, k] + other_spread)
            expected += np.concatenate(
                [[1, one[0, 0] + other[0, 0]], np.abs(off).ravel(), np.ones(16), squares.ravel()]
            )
        np.testing.assert_allclose(out[h, d, kind - 1], expected, rtol=1e-5)


def test_shapes_that_do_not_fit_are_refused() -> None:
    mueller, variance, count, origin = band(13)
    with pytest.raises(ValueError, match="weight"):
        symmetry.pool(mueller, variance, count, origin, np.ones((3, 2, 12)))
    with pytest.raises(ValueError, match="variance"):
        symmetry.copy(mueller, variance[1:].copy(), count, origin)


def test_any_number_of_threads_gives_the_same_sums(
    printed_by_threads: Callable[[str], set[str]],
) -> None:
    program = """
import hashlib
import numpy as np
from pbrdf._kernels import symmetry
random = np.random.default_rng(1)
mueller, variance = random.uniform(0.5, 1, (2, 9, 8, 37, 4, 4)).astype(np.float32)
out = np.empty((9, 8, 2, 50))
symmetry.compare(mueller, variance, np.full((9, 8, 37), 2, np.uint8), out)
print(hashlib.sha256(out.tobytes()).hexdigest())
"""
    assert len(printed_by_threads(program)) == 1
