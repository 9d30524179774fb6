"""Nodes between two lights against plain NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pbrdf._kernels import merge

Float = NDArray[np.float64]
Slice = tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.uint16], Float]

NODES = np.array([0.1, 0.2, 0.3, 0.4, 0.5])
SHAPE = (5, 7)


def light(seed: int, middle: float) -> Slice:
    """A light that does not see some nodes, and has no point at all for some others."""
    random = np.random.default_rng(seed)
    mueller, variance = random.uniform(0.1, 1, (2, *SHAPE, 4, 4)).astype(np.float32)
    count = random.integers(0, 4, SHAPE).astype(np.uint16)
    mueller[count == 0] = variance[count == 0] = np.nan
    theta_d = middle + random.uniform(-0.04, 0.04, SHAPE)
    theta_d[random.uniform(size=SHAPE) < 0.1] = np.nan
    return mueller, variance, count, theta_d


def empty() -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.uint16]]:
    shape = (SHAPE[0], len(NODES), SHAPE[1])
    return (
        np.full((*shape, 4, 4), np.nan, np.float32),
        np.full((*shape, 4, 4), np.nan, np.float32),
        np.zeros(shape, np.uint16),
    )


def twin(low: Slice, high: Slice, widest: float) -> tuple[Any, Any, Any]:
    """The same by loops."""
    mueller, variance, count = empty()
    for h in range(SHAPE[0]):
        for p in range(SHAPE[1]):
            a, b = low[3][h, p], high[3][h, p]
            for d, node in enumerate(NODES):
                if not a <= node <= b or a == b:
                    continue
                w = (node - a) / (b - a)
                parts = [(1 - w, low), (w, high)]
                used = [(share, part) for share, part in parts if share > 0]
                if any(part[2][h, p] == 0 for _, part in used) or (len(used) == 2 and b - a > widest):
                    continue
                mueller[h, d, p] = sum(share * part[0][h, p] for share, part in used)
                variance[h, d, p] = sum(share**2 * part[1][h, p] for share, part in used)
                count[h, d, p] = sum(int(part[2][h, p]) for _, part in used)
    return mueller, variance, count


@pytest.mark.parametrize("widest", [0.24, np.inf])
def test_nodes_between_two_lights_equal_their_twin(widest: float) -> None:
    low, high = light(1, 0.15), light(2, 0.38)
    out = empty()
    merge.interpolate(*low, *high, NODES, widest, *out)
    expected = twin(low, high, widest)
    assert np.isfinite(expected[0][..., 0, 0]).sum() > 10
    np.testing.assert_allclose(out[0], expected[0], rtol=1e-6)
    np.testing.assert_allclose(out[1], expected[1], rtol=1e-6)
    np.testing.assert_array_equal(out[2], expected[2])


def test_a_node_on_a_light_needs_no_other() -> None:
    """However far the next light is, and whether or not it sees the node."""
    low, high = light(1, 0.15), light(2, 0.45)
    low[3][:], high[3][:] = 0.2, 0.5
    out = empty()
    merge.interpolate(*low, *high, NODES, 0.01, *out)
    for d, part in ((1, low), (4, high)):
        np.testing.assert_array_equal(out[0][:, d], part[0])
        np.testing.assert_array_equal(out[2][:, d], part[2])
    assert not out[2][:, [0, 2, 3]].any()


def test_nodes_elsewhere_stay_as_they_are() -> None:
    out = empty()
    for array in out:
        array[...] = 7
    merge.interpolate(*light(1, 0.15), *light(2, 0.38), NODES, np.inf, *out)
    assert (out[0][:, 4] == 7).all() and (out[2][:, 4] == 7).all()


def test_more_pixels_than_the_count_can_hold_stop_at_its_top() -> None:
    low, high = light(1, 0.15), light(2, 0.38)
    for part in (low, high):
        part[2][...] = 60000
    out = empty()
    merge.interpolate(*low, *high, NODES, np.inf, *out)
    assert out[2].max() == 65535


def test_lights_of_other_nodes_are_refused() -> None:
    low, high = light(1, 0.15), light(2, 0.38)
    with pytest.raises(ValueError, match="theta_d of a light"):
        merge.interpolate(*low, *high[:3], high[3][1:].copy(), NODES, np.inf, *empty())
