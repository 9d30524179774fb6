"""Colours of a picture, with the bar that explains them."""

from __future__ import annotations

from dataclasses import dataclass

import matplotlib
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import FuncNorm, ListedColormap, LogNorm, Normalize, to_hex, to_rgba
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, NullLocator
from numpy.typing import NDArray

from pbrdf.report.figures import Float, number

LEVELS = 64
"""Colours of a map: finer steps cannot be told apart in a panel and make a noisy table's page large."""

NEVER_VISIBLE_COLOUR = "#d2d2d2"
UNKNOWN_COLOUR = "#7f7f7f"

GAMMA = 2.2
"""Exponent of the signed scale: small off-diagonal elements would drown in a linear one."""


@dataclass(frozen=True)
class Scale:
    """How values become colours, and how the colour bar says so.

    Attributes
    ----------
    mappable : ScalarMappable
    label : str
        Quantity and unit.
    ticks : tuple of float
        Values that the bar names.
    """

    mappable: ScalarMappable
    label: str
    ticks: tuple[float, ...]

    def paint(self, values: Float, visible: NDArray[np.bool_]) -> NDArray[np.uint8]:
        """Colours (..., 4) of values: two greys tell what cannot be seen from what is not known."""
        rgba = np.array(self.mappable.to_rgba(values, bytes=True))
        rgba[np.isnan(values) & visible] = colour_bytes(UNKNOWN_COLOUR)
        rgba[~visible] = colour_bytes(NEVER_VISIBLE_COLOUR)
        return rgba

    def draw_bar(self, figure: Figure, left: float, bottom: float, width: float, height: float) -> None:
        """Draw the colour bar at a place in parts of the figure's size."""
        axes = figure.add_axes((left, bottom, width, height))
        bar = figure.colorbar(self.mappable, cax=axes, orientation="horizontal")
        bar.set_label(self.label, fontsize=7.0, labelpad=1.5)
        axes.xaxis.set_minor_locator(NullLocator())
        bar.set_ticks(list(self.ticks), labels=[number(tick, 2) for tick in self.ticks])
        axes.tick_params(labelsize=6.5)


def logarithmic(low: float, high: float, label: str) -> Scale:
    """Scale of positive values, widened where it would span less than a factor of two."""
    if high < 2.0 * low:
        middle = float(np.sqrt(low * high))
        low, high = middle / float(np.sqrt(2.0)), middle * float(np.sqrt(2.0))
    ticks = tuple(float(tick) for tick in np.geomspace(low, high, 4))
    return Scale(ScalarMappable(LogNorm(low, high), _size_colours()), label, ticks)


def from_zero(high: float, label: str) -> Scale:
    """Linear scale from zero."""
    ticks = tuple(float(t) for t in MaxNLocator(5).tick_values(0.0, high) if t <= high * (1 + 1e-9))
    return Scale(ScalarMappable(Normalize(0.0, high), _size_colours()), label, ticks)


def signed(limit: float, label: str) -> Scale:
    """Linear scale from −limit to limit."""
    ticks = tuple(float(tick) for tick in np.linspace(-limit, limit, 5))
    return Scale(ScalarMappable(Normalize(-limit, limit), _signed_colours()), label, ticks)


def signed_gamma(quantity: str) -> Scale:
    """Scale from −1 to 1 with a sign-preserving gamma."""
    norm = FuncNorm(
        (lambda x: np.sign(x) * np.abs(x) ** (1 / GAMMA), lambda x: np.sign(x) * np.abs(x) ** GAMMA),
        vmin=-1.0,
        vmax=1.0,
    )
    label = f"{quantity}, no unit (signed gamma 1/{GAMMA})"
    return Scale(ScalarMappable(norm, _signed_colours()), label, (-1.0, -0.5, -0.1, 0.0, 0.1, 0.5, 1.0))


def round_up(value: float) -> float:
    """Smallest 1, 2 or 5 times a power of ten that is not below `value` (> 0)."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= value * (1 - 1e-9)))


def colour_bytes(colour: str) -> NDArray[np.uint8]:
    """Red, green, blue and opacity of a named colour, shape (4,)."""
    return np.round(255 * np.array(to_rgba(colour))).astype(np.uint8)


def bar_colours() -> tuple[list[str], list[str]]:
    """Colours of the signed scales and of those of sizes, from low to high, as ``#rrggbb``."""
    maps = (_signed_colours(), _size_colours())
    signed_side, size_side = ([to_hex(c) for c in m(np.arange(m.N))] for m in maps)
    return signed_side, size_side


def _signed_colours() -> ListedColormap:
    """Orange below zero, white at zero, purple above.

    ColorBrewer's PuOr keeps its two sides apart under all three kinds of dichromacy, which red-green
    maps do not, falls evenly in lightness on both sides (so that size still shows in grey print), and
    has white at zero, where dark-centred maps such as vanimo print as ink. Its darkest ends are left
    out: brown and purple meet in black there.
    """
    # an odd number of levels keeps one for zero
    return ListedColormap(matplotlib.colormaps["PuOr"](np.linspace(0.08, 0.92, LEVELS + 1)), name="signed")


def _size_colours() -> ListedColormap:
    """Cividis, which looks alike to colour-blind and other eyes."""
    return ListedColormap(matplotlib.colormaps["cividis"](np.linspace(0.0, 1.0, LEVELS)), name="size")
