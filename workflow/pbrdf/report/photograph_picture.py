"""Photographs in grey, small enough for a page, as ground for marks drawn in their own pixels."""

from __future__ import annotations

from dataclasses import dataclass

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from pbrdf.report.figures import Float

GREYS = 64
"""Levels of grey: finer ones cannot be told apart on a screen."""

DARKEST, BRIGHTEST = 0.5, 99.8
"""Percentiles of the pixels at black and at white."""


@dataclass(frozen=True)
class Grey:
    """A photograph's pixels as drawn.

    Attributes
    ----------
    rgba : ndarray, shape (rows, columns, 4), uint8
    extent : tuple of float
        Left, right, bottom and top edges in the photograph's own pixels, the first pixel's centre being
        (0, 0).
    block : int
        Pixels of the photograph along the side of one that is drawn.
    """

    rgba: NDArray[np.uint8]
    extent: tuple[float, float, float, float]
    block: int

    def draw(self, axes: Axes) -> None:
        """Fill axes with the photograph; marks then go by its pixels."""
        axes.imshow(self.rgba, extent=self.extent, interpolation="none", aspect="equal")
        axes.set_autoscale_on(False)
        axes.set_xticks([])
        axes.set_yticks([])


def grey(image: Float, most: int, window: tuple[slice, slice] | None = None) -> Grey:
    """Make a photograph ready to be drawn, over the square root of its signal.

    Parameters
    ----------
    image : ndarray, shape (rows, columns)
        Linear signal.
    most : int
        Largest number of rows and of columns that are drawn: larger photographs are drawn as means over
        blocks.
    window : tuple of slice, optional
        Rows and columns to draw, with known ends; all by default.
    """
    rows, columns = window or (slice(0, image.shape[0]), slice(0, image.shape[1]))
    part = image[rows, columns]
    block = max(1, int(np.ceil(max(part.shape) / most)))
    height, width = (max(length // block, 1) * block for length in part.shape)
    part = part[:height, :width]
    high, wide = (min(block, length) for length in part.shape)
    means = part.reshape(part.shape[0] // high, high, part.shape[1] // wide, wide).mean(axis=(1, 3))
    dark, bright = np.percentile(means, (DARKEST, BRIGHTEST))
    shade = np.sqrt(np.clip((means - dark) / max(float(bright - dark), 1e-300), 0.0, 1.0))
    levels = matplotlib.colormaps["gray"](np.linspace(0.0, 1.0, GREYS), bytes=True)
    left, top = columns.start - 0.5, rows.start - 0.5
    extent = (left, left + part.shape[1], top + part.shape[0], top)
    return Grey(levels[np.rint(shade * (GREYS - 1)).astype(np.intp)], extent, block)


def exaggeration(typical: float, wanted: float) -> float:
    """1, 2 or 5 times a power of ten by which a typical length is drawn about as long as wanted."""
    if not typical > 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(wanted / typical))
    return float(
        max(step * power for step in (1.0, 2.0, 5.0) if step * power * typical <= wanted * (1 + 1e-9))
    )
