"""A map of an image, with its colour bar."""

from __future__ import annotations

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pbrdf.report.figures import Float, Picture, number, picture
from pbrdf.report.scales import Scale, from_zero, round_up

WIDTH, EDGE, ABOVE, BELOW = 4.3, 0.06, 0.27, 0.52
"""Inches."""

BELOW_ZERO_COLOUR = "#D55E00"
"""Vermilion, which stays apart from cividis for colour-blind eyes."""

MOST_EIGENVALUE = 0.25
"""That of an ideal depolariser, M00 being 1."""


def map_picture(title: str, values: Float, scale: Scale, weak: NDArray[np.bool_] | None = None) -> Picture:
    """Draw one number a pixel.

    Parameters
    ----------
    title : str
    values : ndarray, shape (rows, cols)
        In the scale's unit. NaN is drawn dark grey.
    scale : Scale
    weak : ndarray of bool, shape (rows, cols), optional
        Where the value is noise: drawn light grey.
    """
    weak = np.zeros(values.shape, np.bool_) if weak is None else weak
    rgba = scale.paint(np.where(weak, np.nan, values), ~weak)
    shown = values[~weak & np.isfinite(values)]
    aspect = min(max(values.shape[0] / values.shape[1], 1 / 3), 3.0)
    height = ABOVE + (WIDTH - 2 * EDGE) * aspect + BELOW

    def draw(figure: Figure) -> None:
        figure.text(EDGE / WIDTH, 1 - 0.06 / height, title, fontsize=8.5, weight="bold", va="top")
        place = (EDGE / WIDTH, BELOW / height, 1 - 2 * EDGE / WIDTH, 1 - (ABOVE + BELOW) / height)
        axes = figure.add_axes(place)
        axes.imshow(rgba, aspect="auto", interpolation="none")
        axes.set_xticks([])
        axes.set_yticks([])
        scale.draw_bar(figure, 0.08, 0.36 / height, 0.84, 0.09 / height)

    return picture((WIDTH, height), draw, _words(title, scale.label, shown, values))


def share_scale(values: Float, label: str) -> Scale:
    """Linear scale from zero to a round number, at most 1, that holds 99.8 % of the values up to 1."""
    known = values[np.isfinite(values)]
    high = float(np.percentile(known, 99.8)) if known.size else 0.0
    return from_zero(min(round_up(high), 1.0) if high > 0 else 1.0, label)


def range_scale(values: Float, step: float, end: float, label: str) -> Scale:
    """Linear scale between multiples of `step`, from 0 to `end` at most, that hold 99.6 % of the values."""
    known = values[np.isfinite(values)]
    low, high = (float(v) for v in np.percentile(known, [0.2, 99.8])) if known.size else (0.0, end)
    most = round(end / step)
    first = min(max(int(np.floor(low / step)), 0), most - 1)
    last = max(min(int(np.ceil(high / step)), most), first + 1)
    stride = next(stride for stride in (1, 2, 3, 5, 10) if last - first <= 6 * stride)
    ticks = tuple(step * k for k in range(first, last + 1, stride))
    scale = from_zero(end, label)
    return Scale(ScalarMappable(Normalize(step * first, step * last), scale.mappable.cmap), label, ticks)


def eigenvalue_scale(label: str) -> Scale:
    """Linear scale of the smallest eigenvalue of a coherency matrix, with a colour for all below zero."""
    scale = from_zero(MOST_EIGENVALUE, label)
    colours = scale.mappable.cmap.with_extremes(under=BELOW_ZERO_COLOUR)
    # matplotlib's stubs know only its default, False
    colours.colorbar_extend = "min"  # type: ignore[assignment]
    return Scale(ScalarMappable(Normalize(0.0, MOST_EIGENVALUE), colours), label, scale.ticks)


def _words(title: str, label: str, shown: Float, values: Float) -> str:
    rows, cols = values.shape
    text = f"Map of {rows} by {cols} points: {title}, as {label}"
    if not shown.size:
        return text + "; nothing is known."
    low, middle, high = (float(v) for v in np.percentile(shown, [1, 50, 99]))
    text += f"; 98 % of the points lie from {number(low)} to {number(high)}, "
    return text + f"half of them above {number(middle)}."
