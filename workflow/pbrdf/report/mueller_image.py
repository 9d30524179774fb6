"""A Mueller image as sixteen panels."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pbrdf.report.figures import Float, Picture, number, picture
from pbrdf.report.scales import logarithmic, signed_gamma
from pbrdf.report.sixteen import draw_bars, draw_sixteen, height_for

MOST_PIXELS = 200
"""Longest side of a panel: what the screen shows of sixteen panels side by side."""

WIDTH, LEFT, BELOW = 7.0, 0.02, 0.75
"""Inches, part of the width, inches."""


def image_panels(mueller: NDArray[np.floating], unit: str, title: str) -> Picture:
    """Draw a Mueller image: M00 on a logarithmic scale, the other elements divided by it.

    Parameters
    ----------
    mueller : ndarray, shape (rows, cols, 4, 4)
        Elements in `unit`; NaN where the pixel is masked. Large images are averaged over square blocks.
    unit : str
        Unit of M00.
    title : str
        Drawn above the panels.
    """
    small = block_means(mueller, block_for(mueller.shape[:2], MOST_PIXELS))
    first = np.where(small[..., 0, 0] > 0, small[..., 0, 0], np.nan)
    low, high = _limits(first)
    scales = (logarithmic(low, high, f"M00, {unit} (logarithmic)"), signed_gamma("Mij/M00"))
    everywhere = np.ones(first.shape, dtype=np.bool_)
    rows, cols = first.shape
    height = height_for((rows, cols), WIDTH, LEFT, BELOW)

    def paint(i: int, j: int) -> NDArray[np.uint8]:
        shown = first if i == j == 0 else small[..., i, j] / first
        return (scales[0] if i == j == 0 else scales[1]).paint(shown, everywhere)[::-1]

    def draw(figure: Figure) -> None:
        figure.text(LEFT, 1 - 0.08 / height, title, fontsize=8.5, weight="bold", va="top")
        draw_sixteen(figure, paint, f"M00, {unit}", left=LEFT, bottom=BELOW / height)
        draw_bars(figure, scales, bottom=0.4 / height)

    return picture((WIDTH, height), draw, _words(title, mueller, unit, low, high))


def median_diagonal(mueller: NDArray[np.floating]) -> tuple[float, float, float, float]:
    """Medians over the known pixels of M00…M33 divided by M00; NaN if no pixel is known."""
    first = mueller[..., 0, 0]
    usable = _known(mueller) & (first > 0)
    if not usable.any():
        return (float("nan"),) * 4
    diagonal = np.diagonal(mueller[usable], axis1=-2, axis2=-1) / first[usable][:, None]
    m0, m1, m2, m3 = (float(value) for value in np.median(diagonal, axis=0))
    return m0, m1, m2, m3


def block_for(shape: tuple[int, ...], most: int) -> int:
    """Side of the blocks over which an image is averaged to have at most `most` pixels a side."""
    return -(-max(shape) // most)


def block_means(mueller: NDArray[np.floating], block: int) -> NDArray[np.floating]:
    """Mean of the known pixels in blocks of `block` × `block`, shape (rows', cols', 4, 4).

    Elements are averaged in their own unit: a mean of ratios would give dark, noisy pixels the
    weight of bright ones. An incomplete block at the right or lower edge is a mean of fewer pixels.
    """
    if block <= 1:
        return mueller
    counts = block_counts(mueller, block)[..., None, None]
    filled = np.where(_known(mueller)[..., None, None], mueller, 0.0)
    means: Float = np.full((*counts.shape[:2], 4, 4), np.nan)
    np.divide(_block_sums(filled, block), counts, out=means, where=counts > 0)
    return means


def block_counts(mueller: NDArray[np.floating], block: int) -> NDArray[np.floating]:
    """Number of known pixels in each of these blocks, shape (rows', cols')."""
    return _block_sums(_known(mueller).astype(np.float64), block)


def _known(mueller: NDArray[np.floating]) -> NDArray[np.bool_]:
    known: NDArray[np.bool_] = np.isfinite(mueller).all(axis=(-2, -1))
    return known


def _block_sums(values: NDArray[np.floating], block: int) -> NDArray[np.floating]:
    starts = [np.arange(0, length, block) for length in values.shape[:2]]
    sums: NDArray[np.floating] = np.add.reduceat(
        np.add.reduceat(values, starts[0], axis=0), starts[1], axis=1
    )
    return sums


def _limits(first: Float) -> tuple[float, float]:
    known = first[np.isfinite(first)]
    if known.size == 0:
        return 0.1, 1.0
    low, high = (float(v) for v in np.percentile(known, [1.0, 99.8]))
    return low, high


def _words(title: str, mueller: NDArray[np.floating], unit: str, low: float, high: float) -> str:
    rows, cols = mueller.shape[:2]
    diagonal = ", ".join(f"M{k}{k} {number(v)}" for k, v in enumerate(median_diagonal(mueller)) if k)
    text = f"{title}: Mueller image of {rows} by {cols} pixels in sixteen panels; "
    return text + f"M00 drawn from {number(low)} to {number(high)} {unit}; medians over M00: {diagonal}."
