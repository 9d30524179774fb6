"""Four rows of four panels, M00 to M33, as slices and Mueller images show them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pbrdf.report.scales import Scale

_RIGHT, _TOP, _GAP_X, _GAP_Y = 0.99, 0.938, 0.012, 0.026
_TICK = 0.005

Ticks = Sequence[tuple[float, str]]


def draw_sixteen(
    figure: Figure,
    paint: Callable[[int, int], NDArray[np.uint8]],
    first_title: str,
    *,
    left: float,
    bottom: float,
    x_ticks: Ticks = (),
    y_ticks: Ticks = (),
) -> None:
    """Draw the panels of a figure from `left` and `bottom` (parts of its size) to its upper right.

    All on one axes: sixteen of Matplotlib's cost ten times as long.

    Parameters
    ----------
    figure : Figure
    paint : callable
        Gives the colours of an element, shape (rows, cols, 4), lowest row first.
    first_title : str
        Title of M00; the others are named Mij/M00.
    left, bottom : float
    x_ticks, y_ticks : sequence of (place, label)
        Marks below the last row and left of the first column; place runs from 0 to 1 over a panel, and
        those outside are left out.
    """
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(0.0, 1.0)
    axes.set_autoscale_on(False)
    width = (_RIGHT - left - 3 * _GAP_X) / 4
    height = (_TOP - bottom - 3 * _GAP_Y) / 4
    marks: list[list[tuple[float, float]]] = []
    for i in range(4):
        for j in range(4):
            x, y = left + j * (width + _GAP_X), _TOP - (i + 1) * height - i * _GAP_Y
            box = (x, x + width, y, y + height)
            axes.imshow(paint(i, j), extent=box, origin="lower", aspect="auto", interpolation="none")
            marks.append([(x, y), (x + width, y), (x + width, y + height), (x, y + height), (x, y)])
            name = first_title if i == j == 0 else f"M{i}{j}/M00"
            axes.text(x, y + height + 0.003, name, fontsize=6.5, va="bottom")
            for place, label in x_ticks if i == 3 else ():
                if 0.0 <= place <= 1.0:
                    at = x + place * width
                    marks.append([(at, y), (at, y - _TICK)])
                    axes.text(at, y - 1.6 * _TICK, label, fontsize=6.0, ha="center", va="top")
            for place, label in y_ticks if j == 0 else ():
                if 0.0 <= place <= 1.0:
                    at = y + place * height
                    marks.append([(x, at), (x - _TICK, at)])
                    axes.text(x - 1.6 * _TICK, at, label, fontsize=6.0, ha="right", va="center")
    axes.add_collection(LineCollection(marks, colors="black", linewidths=0.6), autolim=False)


def height_for(shape: tuple[int, int], width: float, left: float, below: float) -> float:
    """Height of a figure, inches, in which the pixels of images of `shape` (rows, cols) are square.

    `width` is the figure's, `below` the room left for colour bars, both in inches; `left` is a part of
    the width. Images more than three times as long as wide, either way, are squeezed to that.
    """
    aspect = min(max(shape[0] / shape[1], 1 / 3), 3.0)
    panels = (_RIGHT - left - 3 * _GAP_X) * width * aspect
    return (panels + below) / (_TOP - 3 * _GAP_Y)


def draw_bars(figure: Figure, scales: tuple[Scale, Scale], bottom: float) -> None:
    """Draw the colour bar of M00 at the lower left and that of the other elements beside it."""
    scales[0].draw_bar(figure, 0.1, bottom, 0.33, 0.016)
    scales[1].draw_bar(figure, 0.5, bottom, 0.46, 0.016)
