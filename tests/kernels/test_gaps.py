"""Local polynomials in angle space against weighted least squares of NumPy, node by node."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from numpy.typing import NDArray
from pbrdf._kernels import gaps

from pbrdf.tabulation.axes import table_axes

Float = NDArray[np.float64]
Mask = NDArray[np.bool_]

AXES = table_axes(6, 9, 25)
AROUND = 24
NARROWEST, AZIMUTH, FARTHEST = 0.2, 0.3, 0.7


def case() -> tuple[NDArray[np.float32], Mask, Mask]:
    """Positive matrices, four nodes of ten known, three of ten wanted."""
    random = np.random.default_rng(1)
    mueller = random.uniform(0.5, 1.5, (*AXES.shape, 4, 4)).astype(np.float32)
    drawn = random.uniform(size=AXES.shape)
    known, target = drawn < 0.4, drawn > 0.7
    for array in (mueller, known, target):
        array[:, :, -1] = array[:, :, 0]
    mueller[~known] = np.nan
    return mueller, known, target


def beside(h: int, d: int, k: int) -> Iterator[tuple[tuple[int, int, int], float]]:
    """Nodes of the same θh and θd up to two widths of the azimuth away, and their steps in widths."""
    step = 2 * np.pi / AROUND / AZIMUTH
    for b in range(-int(2 / step), int(2 / step) + 1):
        yield (h, d, (k + b) % AROUND), b * step


def line(h: int, d: int, k: int, width: float) -> Iterator[tuple[tuple[int, int, int], float, float]]:
    for e, there in enumerate(AXES.theta_d):
        for signed, azimuth in ((there, k), (-there, k + AROUND // 2)):
            u = (signed - AXES.theta_d[d]) / width
            if abs(u) <= 3 and not (azimuth != k and e == 0):
                for node, v in beside(h, e, azimuth):
                    yield node, u, v


def ways(known: Mask, h: int, d: int, k: int) -> tuple[float, float, float]:
    """Ways to the nearest known nodes: down the line, up the line, along θh."""
    here = AXES.theta_d[d]
    signed = [t for t, there in zip(AXES.theta_d, known[h, :, k], strict=True) if there]
    opposite = known[h, :, (k + AROUND // 2) % AROUND]
    signed += [-t for t, there in zip(AXES.theta_d, opposite, strict=True) if there and t > 0]
    halves = AXES.theta_h[known[:, d, k]]
    return (
        min((here - t for t in signed if t < here), default=np.inf),
        min((t - here for t in signed if t > here), default=np.inf),
        min(np.abs(halves - AXES.theta_h[h]), default=np.inf),
    )


def at_the_middle(rows: list[list[float]], weights: list[float], values: Float, ridge: float) -> Float:
    """Constant of a weighted polynomial whose other terms are held by a ridge."""
    x, w = np.array(rows), np.array(weights)
    held = np.diag([0.0] + [ridge * w.sum()] * (x.shape[1] - 1))
    solution: Float = np.linalg.solve(x.T * w @ x + held, x.T * w @ values)[0]
    return solution


def filled_between(mueller: NDArray[np.float32], known: Mask, at: tuple[int, int, int]) -> Float | None:
    below, above, _ = ways(known, *at)
    if max(below, above) >= FARTHEST:
        return None
    found = [n for n in line(*at, max(NARROWEST, 0.5 * max(below, above))) if known[n[0]]]
    rows = [[1.0, v, u, u * u, u**3] for _, u, v in found]
    weights = [np.exp(-0.5 * (u * u + v * v)) for _, u, v in found]
    values = np.array([mueller[n].ravel() for n, _, _ in found], np.float64)
    return at_the_middle(rows, weights, values, 1e-6)


def filled_beyond(mueller: NDArray[np.float32], known: Mask, at: tuple[int, int, int]) -> Float | None:
    way = min(ways(known, *at))
    if not np.isfinite(way):
        return None
    h, d, k = at
    width = max(2 * NARROWEST, 0.5 * way)
    found = [(n, u, 0.0, v) for n, u, v in line(*at, width) if known[n]]
    for g, there in enumerate(AXES.theta_h):
        t = (there - AXES.theta_h[h]) / width
        if g != h and abs(t) <= 3:
            found += [(n, 0.0, t, v) for n, v in beside(g, d, k) if known[n]]
    rows = [[1.0, v, u, t] for _, u, t, v in found]
    weights = [np.exp(-0.5 * (u * u + t * t + v * v)) for _, u, t, v in found]
    values = np.array([mueller[n].ravel() for n, _, _, _ in found], np.float64)
    normalised = values / values[:, :1]
    normalised[:, 0] = np.log(values[:, 0])
    out = at_the_middle(rows, weights, normalised, 1e-2)
    m00 = np.exp(out[0])
    return np.concatenate([[m00], m00 * out[1:]])


def run(
    name: str, mueller: NDArray[np.float32], known: Mask, target: Mask
) -> tuple[NDArray[np.float32], Mask]:
    out, done = mueller.copy(), np.zeros(AXES.shape, np.uint8)
    widths = (NARROWEST, AZIMUTH, *((FARTHEST,) if name == "between" else ()))
    masks = (known.view(np.uint8), target.view(np.uint8), done)
    getattr(gaps, name)(AXES.theta_h, AXES.theta_d, *widths, out, *masks)
    return out, done.view(np.bool_)


@pytest.mark.parametrize(("name", "twin"), [("between", filled_between), ("beyond", filled_beyond)])
def test_filled_nodes_equal_their_twin(name: str, twin: Callable[..., Float | None]) -> None:
    mueller, known, target = case()
    out, done = run(name, mueller, known, target)
    assert done.sum() > 100
    for at in zip(*np.nonzero(target), strict=True):
        h, d, p = (int(i) for i in at)
        expected = twin(mueller, known, (h, d, p % AROUND))
        assert done[at] == (expected is not None)
        if expected is not None:
            np.testing.assert_allclose(out[at].ravel(), expected, rtol=2e-4, atol=2e-5)
    np.testing.assert_array_equal(out[~done], mueller[~done])


def test_a_cubic_along_the_line_is_found_again_through_its_middle() -> None:
    """θd < 20° hidden: what is known on the far side of θd = 0 makes it an interpolation."""
    h, d, p = np.meshgrid(AXES.theta_h, AXES.theta_d, AXES.phi_d, indexing="ij")
    signed = d * np.where(np.abs(p) > np.pi / 2, -1.0, 1.0)
    cubic = 2 + h + 0.3 * signed - 0.5 * signed**2 + 0.2 * signed**3
    # a line has one half beyond ±90° and one within; at ±90° itself both halves would be positive
    lines = np.abs(np.abs(p) - np.pi / 2) > 0.7
    mueller = np.broadcast_to(cubic[..., None, None], (*AXES.shape, 4, 4)).astype(np.float32)
    known = (d > np.deg2rad(20)) & lines
    target = (d <= np.deg2rad(20)) & lines & (np.abs(np.abs(p) - np.pi / 2) > 1.2)
    start = np.where(known[..., None, None], mueller, np.float32(np.nan))
    out, done = run("between", start, known, target)
    np.testing.assert_array_equal(done, target)
    np.testing.assert_allclose(out[target], mueller[target], rtol=2e-3)


def test_without_opposite_azimuths_a_line_ends_at_zero() -> None:
    axes = table_axes(4, 9, 24)
    known = np.broadcast_to((axes.theta_d > 0.5)[:, None], axes.shape).copy()
    out = np.ones((*axes.shape, 4, 4), np.float32)
    done = np.zeros(axes.shape, np.uint8)
    masks = (known.view(np.uint8), (~known).view(np.uint8), done)
    gaps.between(axes.theta_h, axes.theta_d, 0.1, 0.1, 9.0, out, *masks)
    assert not done.any()
    gaps.beyond(axes.theta_h, axes.theta_d, 0.1, 0.1, out, *masks)
    np.testing.assert_array_equal(done.view(np.bool_), ~known)


def test_shapes_and_widths_that_make_no_sense_are_refused() -> None:
    mueller, known, target = case()
    masks = (known.view(np.uint8), target.view(np.uint8), np.zeros(AXES.shape, np.uint8))
    with pytest.raises(ValueError, match="theta_d has shape"):
        gaps.beyond(AXES.theta_h, AXES.theta_d[1:].copy(), 0.1, 0.1, mueller, *masks)
    with pytest.raises(ValueError, match="width is not positive"):
        gaps.beyond(AXES.theta_h, AXES.theta_d, 0.0, 0.1, mueller, *masks)
