"""Where a table's values come from, and how many pixels stand behind them."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from pbrdf.formats.table_data import Origin, TableData
from pbrdf.report.figures import Float, Picture, number, picture, quadratic_theta_h, raster
from pbrdf.report.scales import NEVER_VISIBLE_COLOUR, UNKNOWN_COLOUR, colour_bytes, from_zero
from pbrdf.report.visibility import ORIGIN_NAMES, visible_nodes

# Okabe and Ito's colours, which stay apart for colour-blind eyes
ORIGIN_COLOURS = {
    Origin.NEVER_VISIBLE: NEVER_VISIBLE_COLOUR,
    Origin.UNSEEN: UNKNOWN_COLOUR,
    Origin.MEASURED: "#0072B2",
    Origin.MIRRORED: "#56B4E9",
    Origin.RECIPROCAL: "#009E73",
    Origin.INPAINTED: "#E69F00",
}
MOST_PIXELS = 91


def coverage_maps(table: TableData, band: int) -> Picture:
    """Draw, over θh and θd, what lies behind the nodes of one band.

    Left: the pixels behind a visible node, mean over φd; where the table has no counts, the
    share of visible nodes that are known. Right: the most frequent origin over φd, where the table
    tells origins.
    """
    visible = visible_nodes(table, band)
    if table.count is not None:
        values = mean_over_phi(table.count[band].astype(np.float64), visible)
        label = "pixels a node, mean over φd"
    else:
        known = np.isfinite(table.mueller[band, ..., 0, 0])
        values = 100.0 * mean_over_phi(known.astype(np.float64), visible)
        label = "known nodes, % of the visible ones over φd"
    high = float(np.nanmax(values, initial=0.0))
    scale = from_zero(high if high > 0 else 1.0, label)
    most = _most_frequent(table.origin[band], visible) if table.origin is not None else None

    def draw(figure: Figure) -> None:
        panels = figure.subplots(1, 2 if most is not None else 1, squeeze=False)[0]
        figure.subplots_adjust(left=0.07, right=0.985, top=0.86, bottom=0.3, wspace=0.16)
        title = f"Coverage at {number(float(table.wavelengths_nm[band]), 4)} nm"
        figure.text(0.07, 0.975, title, fontsize=8.5, weight="bold", va="top")
        node_map(panels[0], scale.paint(values, np.isfinite(values)), table.theta_h, table.theta_d)
        panels[0].set_title("Pixels" if table.count is not None else "Known nodes", loc="left")
        box = panels[0].get_position()
        scale.draw_bar(figure, box.x0, 0.13, box.width, 0.03)
        if most is not None:
            colours = np.stack([colour_bytes(c) for c in ORIGIN_COLOURS.values()])
            node_map(panels[1], colours[most], table.theta_h, table.theta_d)
            panels[1].set_title("Most frequent origin over φd", loc="left")
            _origin_legend(figure, panels[1])

    size = (9.4, 4.4) if most is not None else (5.4, 4.4)
    return picture(size, draw, _words(table, band, values, label))


def _origin_legend(figure: Figure, axes: Axes) -> None:
    patches = [
        Patch(facecolor=colour, edgecolor="#444444", linewidth=0.4, label=ORIGIN_NAMES[origin])
        for origin, colour in ORIGIN_COLOURS.items()
    ]
    box = axes.get_position()
    figure.legend(
        handles=patches,
        loc="upper center",
        bbox_to_anchor=(box.x0 + box.width / 2, 0.19),
        ncols=3,
        frameon=False,
    )


def node_map(axes: Axes, rgba: NDArray[np.uint8], theta_h: Float, theta_d: Float) -> None:
    """Draw colours of nodes, shape (H, D, 4), over θh and θd, which are in radians."""
    across = raster(np.sqrt(np.degrees(theta_h)), MOST_PIXELS)
    up = raster(np.degrees(theta_d), MOST_PIXELS)
    pixels = rgba[np.ix_(across.nodes, up.nodes)].transpose(1, 0, 2)
    extent = (across.low, across.high, up.low, up.high)
    axes.imshow(pixels, extent=extent, origin="lower", aspect="auto", interpolation="none")
    quadratic_theta_h(axes)
    axes.set_yticks([tick for tick in range(0, 91, 15) if up.low <= tick <= up.high])
    axes.set_xlabel("θh, ° (drawn over √θh)")
    axes.set_ylabel("θd, °")


def mean_over_phi(values: Float, visible: NDArray[np.bool_]) -> Float:
    """Mean of values (H, D, P) over the visible nodes of φd, shape (H, D); NaN where there is none."""
    number_visible = visible.sum(axis=-1)
    total = np.where(visible, values, 0.0).sum(axis=-1)
    mean: Float = np.where(number_visible > 0, total / np.maximum(number_visible, 1), np.nan)
    return mean


def _most_frequent(origin: NDArray[np.uint8], visible: NDArray[np.bool_]) -> NDArray[np.intp]:
    counts = np.stack([np.count_nonzero((origin == o) & visible, axis=-1) for o in Origin], axis=-1)
    return np.where(counts.sum(axis=-1) > 0, counts.argmax(axis=-1), Origin.NEVER_VISIBLE)


def _words(table: TableData, band: int, values: Float, label: str) -> str:
    text = f"Map over θh and θd at {number(float(table.wavelengths_nm[band]), 4)} nm: {label}"
    if np.any(np.isfinite(values)):
        text += f", from {number(float(np.nanmin(values)))} to {number(float(np.nanmax(values)))}"
    if table.origin is not None:
        text += "; beside it the most frequent origin of the values, whose shares the table below lists"
    return text + "."
