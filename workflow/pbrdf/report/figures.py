"""Pictures for pages: one style, the same bytes for the same numbers, and words for screen readers."""

from __future__ import annotations

import base64
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from io import BytesIO

import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

Float = NDArray[np.float64]

STYLE: dict[str, object] = {
    "svg.hashsalt": "pbrdf",
    "svg.fonttype": "path",
    "image.composite_image": False,
    "font.family": "DejaVu Sans",
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.labelsize": 8.0,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "legend.fontsize": 7.5,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "axes.axisbelow": True,
    "grid.linewidth": 0.4,
    "grid.color": "#d8d8d8",
}
"""Fonts as outlines and a fixed salt: no picture depends on the reader's fonts or on the run."""

_EMBEDDED_PNG = re.compile(rb"data:image/png;base64,([A-Za-z0-9+/=\s]+)")


@dataclass(frozen=True)
class Picture:
    """A drawing and what it shows.

    Attributes
    ----------
    svg : bytes
        The drawing.
    alt : str
        What it shows, in words and figures.
    width, height : int
        CSS pixels at its natural size.
    draw : callable
        Fills a figure of that size with it.
    """

    svg: bytes
    alt: str
    width: int
    height: int
    draw: Callable[[Figure], None] = field(compare=False, repr=False)

    @property
    def uri(self) -> str:
        """``data:`` address of the drawing.

        As an image and not as inline SVG: several inline drawings would share element ids.
        """
        return "data:image/svg+xml;base64," + base64.b64encode(self.svg).decode("ascii")


def picture(size: tuple[float, float], draw: Callable[[Figure], None], alt: str) -> Picture:
    """Draw on a fresh figure in the pages' style.

    Parameters
    ----------
    size : tuple of float
        Width and height, inches of 96 CSS pixels.
    draw : callable
        Fills the figure.
    alt : str
        What the picture shows.
    """
    with matplotlib.style.context(["default", STYLE]):
        figure = Figure(figsize=size)
        draw(figure)
        buffer = BytesIO()
        silent = {"Creator": None, "Date": None, "Format": None, "Type": None}
        figure.savefig(buffer, format="svg", metadata=silent)
    width, height = (round(96 * inches) for inches in size)
    return Picture(_EMBEDDED_PNG.sub(_with_palette, buffer.getvalue()), alt, width, height, draw)


def _with_palette(embedded: re.Match[bytes]) -> bytes:
    """Replace an image of few colours by one with a palette: a fifth of the bytes where it is noisy."""
    rgba = np.asarray(Image.open(BytesIO(base64.b64decode(embedded[1]))).convert("RGBA"))
    packed = np.ascontiguousarray(rgba).view(">u4")[..., 0]
    colours, indices = np.unique(packed, return_inverse=True)
    palette = colours.view(np.uint8).reshape(-1, 4)
    if len(palette) > 256 or np.any(palette[:, 3] != 255):
        return embedded[0]
    small = Image.fromarray(indices.reshape(packed.shape).astype(np.uint8), mode="P")
    small.putpalette(palette[:, :3].tobytes())
    buffer = BytesIO()
    small.save(buffer, format="png", optimize=True)
    return b"data:image/png;base64," + base64.b64encode(buffer.getvalue())


def number(value: float, digits: int = 3, zeros: bool = False) -> str:
    """Value with significant digits, a true minus sign, and powers of ten written out.

    Zeros at the end are written only where `zeros` says that they are known.
    """
    if not np.isfinite(value):
        return "not known"
    text = f"{value:#.{digits}g}" if zeros else f"{value:.{digits}g}"
    if "e" in text and 1.0 <= abs(value) < 1e6:
        text = f"{float(text):.0f}"
    elif "e" in text:
        mantissa, exponent = text.split("e")
        superscripts = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
        text = f"{mantissa.rstrip('.')}·10{str(int(exponent)).translate(superscripts)}"
    return text.rstrip(".").replace("-", "−")


THETA_H_TICKS = (0.0, 2.0, 10.0, 30.0, 60.0)


def quadratic_theta_h(axes: Axes) -> None:
    """Let x run with √θh, as the published tables space their nodes, and label it in degrees."""
    low, high = axes.get_xlim()
    ticks = [tick for tick in THETA_H_TICKS if low <= np.sqrt(tick) <= high]
    axes.set_xticks(np.sqrt(ticks), [f"{tick:g}" for tick in ticks])


@dataclass(frozen=True)
class Raster:
    """A regular row of pixels over the nodes of an axis.

    Attributes
    ----------
    nodes : ndarray, int
        Node nearest to each pixel.
    low, high : float
        Outer edges of the first and the last pixel, in the axis' coordinate.
    """

    nodes: NDArray[np.intp]
    low: float
    high: float

    def place(self, coordinate: float) -> float:
        """Tell where a coordinate lies between the outer edges, which are at 0 and 1."""
        return (coordinate - self.low) / (self.high - self.low)


def raster(coordinate: Float, most: int) -> Raster:
    """Lay pixels over an axis, each showing its nearest node.

    Parameters
    ----------
    coordinate : ndarray, shape (N,)
        Ascending node positions on paper (√θh, φd, …).
    most : int
        Largest number of pixels. An evenly spaced axis that has fewer nodes gets one pixel a node.
    """
    span = float(coordinate[-1] - coordinate[0])
    if coordinate.size == 1:
        return Raster(np.zeros(1, dtype=np.intp), float(coordinate[0]) - 0.5, float(coordinate[0]) + 0.5)
    even = np.allclose(np.diff(coordinate), span / (coordinate.size - 1), rtol=1e-3)
    pixels = min(most, coordinate.size) if even else most
    at = np.linspace(coordinate[0], coordinate[-1], pixels)
    nodes = np.abs(at[:, None] - coordinate[None, :]).argmin(axis=1)
    half = 0.5 * span / (pixels - 1)
    return Raster(nodes, float(coordinate[0]) - half, float(coordinate[-1]) + half)
