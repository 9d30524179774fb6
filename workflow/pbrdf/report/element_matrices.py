"""Mueller matrices of elements as coloured numbers: a column an element, a row a kind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from pbrdf.report.figures import Float, Picture, number, picture
from pbrdf.report.scales import signed_gamma

WIDTH, CELL_HEIGHT, GAP, LEFT, ABOVE, BELOW = 12.2, 0.32, 0.14, 0.3, 0.3, 0.62
"""Inches: the figure, a cell, the room between matrices, and that for names and colour bar."""

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
"""Of red, green and blue (Rec. 709)."""

DARK = 0.45
"""Luminance below which a number is written in white."""

EXACT = 1e-9
"""Distance from a whole number that is rounding of an ideal element's cosines."""

Kinds = Mapping[str, Sequence[Float]]


def matrices_picture(elements: Sequence[str], kinds: Kinds, title: str) -> Picture:
    """Draw matrices with their numbers in the cells.

    Parameters
    ----------
    elements : sequence of str
        Names of the columns.
    kinds : mapping of str to sequence of ndarray, shape (4, 4)
        By the name of a row, the matrices of its elements, divided by M00.
    title : str
        What all of them belong to.
    """
    scale = signed_gamma("Mij/M00")
    block_height = 4 * CELL_HEIGHT
    height = ABOVE + len(kinds) * (block_height + GAP) + BELOW
    block_width = (WIDTH - LEFT) / len(elements) - GAP

    def draw(figure: Figure) -> None:
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set_axis_off()
        axes.set_xlim(0.0, WIDTH)
        axes.set_ylim(height, 0.0)
        axes.set_autoscale_on(False)
        cells, colours = [], []
        for column, element in enumerate(elements):
            x = LEFT + column * (block_width + GAP)
            axes.text(x + block_width / 2, 0.7 * ABOVE, element, fontsize=9.5, ha="center", weight="bold")
            for row, matrices in enumerate(kinds.values()):
                y = ABOVE + row * (block_height + GAP)
                painted = scale.mappable.to_rgba(np.clip(matrices[column], -1.0, 1.0))
                for (i, j), value in np.ndenumerate(matrices[column]):
                    corner = (x + j * block_width / 4, y + i * CELL_HEIGHT)
                    cells.append(Rectangle(corner, block_width / 4, CELL_HEIGHT))
                    colours.append(painted[i, j])
                    axes.text(
                        corner[0] + block_width / 8,
                        corner[1] + CELL_HEIGHT / 2,
                        cell_text(value),
                        fontsize=7.5,
                        ha="center",
                        va="center_baseline",
                        color="white" if painted[i, j, :3] @ LUMINANCE < DARK else "black",
                    )
        for row, kind in enumerate(kinds):
            y = ABOVE + row * (block_height + GAP) + block_height / 2
            axes.text(0.55 * LEFT, y, kind, fontsize=9.5, ha="center", va="center", rotation=90)
        axes.add_collection(PatchCollection(cells, facecolors=colours, edgecolors="#b0b0b0", linewidths=0.4))
        scale.draw_bar(figure, 0.3, 0.38 / height, 0.4, 0.12 / height)

    return picture((WIDTH, height), draw, _words(elements, kinds, title))


def cell_text(value: float) -> str:
    """Value to three decimals, whole numbers as they are, with a true minus sign and no −0."""
    if abs(value - round(value)) < EXACT:
        return f"{round(value)}".replace("-", "−")
    # adding zero turns −0 into 0
    return f"{round(value, 3) + 0.0:.3f}".replace("-", "−")


def _words(elements: Sequence[str], kinds: Kinds, title: str) -> str:
    text = f"{title}: Mueller matrices over M00 of {', '.join(elements)} as coloured numbers, "
    text += f"in rows {', '.join(kinds)}."
    for kind, matrices in kinds.items():
        diagonals = "; ".join(
            f"{element} {', '.join(number(float(v)) for v in np.diagonal(matrix))}"
            for element, matrix in zip(elements, matrices, strict=True)
        )
        text += f" Diagonals, {kind}: {diagonals}."
    return text
