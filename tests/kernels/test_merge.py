"""Nodes between lights against plain NumPy."""

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


def beyond(part: Slice, h: int, p: int, distance: float, gap: float, widest: float) -> bool:
    """Whether a light at this distance beyond the two helps."""
    return bool(part[2][h, p] > 0 and 0.5 * gap <= distance <= widest)


def twin(lights: list[Slice], low: int, widest: float) -> tuple[Any, Any, Any]:
    """The same by loops: weights that give every power of θd its value, by Vandermonde's matrix."""
    mueller, variance, count = empty()
    for h in range(SHAPE[0]):
        for p in range(SHAPE[1]):
            theta_d = [part[3][h, p] for part in lights]
            a, b = theta_d[low], theta_d[low + 1]
            used = [low, low + 1]
            if low and beyond(lights[0], h, p, a - theta_d[0], b - a, widest):
                used.insert(0, 0)
            if len(lights) > low + 2 and beyond(lights[-1], h, p, theta_d[-1] - b, b - a, widest):
                used.append(low + 2)
            for d, node in enumerate(NODES):
                if not a <= node <= b or a == b:
                    continue
                if any(lights[i][2][h, p] == 0 for i in (low, low + 1)) or b - a > widest:
                    continue
                powers = np.vander([theta_d[i] - node for i in used], increasing=True).T
                weights = np.linalg.solve(powers, np.eye(len(used))[0])
                mueller[h, d, p] = sum(w * lights[i][0][h, p] for w, i in zip(weights, used, strict=True))
                variance[h, d, p] = sum(w**2 * lights[i][1][h, p] for w, i in zip(weights, used, strict=True))
                count[h, d, p] = sum(int(lights[i][2][h, p]) for i in used)
    return mueller, variance, count


LIGHTS = [light(3, -0.05), light(1, 0.15), light(2, 0.38), light(4, 0.6)]


@pytest.mark.parametrize("widest", [0.24, np.inf])
@pytest.mark.parametrize(("first", "last"), [(1, 3), (0, 3), (1, 4), (0, 4)])
def test_nodes_between_lights_equal_their_twin(first: int, last: int, widest: float) -> None:
    lights, low = LIGHTS[first:last], 1 - first
    out = empty()
    merge.interpolate(lights, low, NODES, widest, *out)
    expected = twin(lights, low, widest)
    assert np.isfinite(expected[0][..., 0, 0]).sum() > 10
    np.testing.assert_allclose(out[0], expected[0], rtol=2e-6, atol=1e-6)
    np.testing.assert_allclose(out[1], expected[1], rtol=2e-6)
    np.testing.assert_array_equal(out[2], expected[2])


def test_a_light_close_to_one_of_the_two_does_not_amplify_noise() -> None:
    low, high, near = light(1, 0.1), light(2, 0.5), light(3, 0.5)
    for part, theta_d in ((low, 0.1), (high, 0.5), (near, 0.501)):
        part[1][...] = 1
        part[2][...] = 1
        part[3][:] = theta_d
    out = empty()
    merge.interpolate([low, high, near], 0, NODES, np.inf, *out)
    assert out[1].max() <= 1


def test_a_node_on_a_light_needs_no_other() -> None:
    """However far the next light is, and whether or not it sees the node."""
    low, high = light(1, 0.15), light(2, 0.45)
    low[3][:], high[3][:] = 0.2, 0.5
    out = empty()
    merge.interpolate([low, high], 0, NODES, 0.01, *out)
    for d, part in ((1, low), (4, high)):
        np.testing.assert_array_equal(out[0][:, d], part[0])
        np.testing.assert_array_equal(out[2][:, d], part[2])
    assert not out[2][:, [0, 2, 3]].any()


def test_nodes_elsewhere_stay_as_they_are() -> None:
    out = empty()
    for array in out:
        array[...] = 7
    merge.interpolate([light(1, 0.15), light(2, 0.38)], 0, NODES, np.inf, *out)
    assert (out[0][:, 4] == 7).all() and (out[2][:, 4] == 7).all()


def test_more_pixels_than_the_count_can_hold_stop_at_its_top() -> None:
    low, high = light(1, 0.15), light(2, 0.38)
    for part in (low, high):
        part[2][...] = 60000
    out = empty()
    merge.interpolate([low, high], 0, NODES, np.inf, *out)
    assert out[2].max() == 65535


def test_lights_of_other_nodes_are_refused() -> None:
    low, high = light(1, 0.15), light(2, 0.38)
    with pytest.raises(ValueError, match="theta_d of a light"):
        merge.interpolate([low, (*high[:3], high[3][1:].copy())], 0, NODES, np.inf, *empty())


@pytest.mark.parametrize(("number", "low"), [(1, 0), (2, 1), (4, 0), (5, 1), (3, -1)])
def test_lights_that_do_not_stand_beside_the_two_are_refused(number: int, low: int) -> None:
    lights = [light(seed, 0.1 * seed) for seed in range(number)]
    with pytest.raises(ValueError, match="bracket"):
        merge.interpolate(lights, low, NODES, np.inf, *empty())
