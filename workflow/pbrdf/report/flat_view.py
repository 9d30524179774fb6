"""A flat field's page: the response of the pixels in every band."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pbrdf.calibration.flat_field import KIND, flat_image
from pbrdf.formats.band_exr import read_band
from pbrdf.formats.documents import number, read_document, wavelengths
from pbrdf.report.calibration_parts import CalibrationView, Cell, Grid, Number, Section
from pbrdf.report.figures import Float, Picture, picture
from pbrdf.report.figures import number as written
from pbrdf.report.map_pictures import map_picture, range_scale

MOST_PIXELS = 400
STEP, MOST = 0.01, 1.2
"""Of the colour bars: relative response."""

BINS = 48
BAND_COLOURS = ("#0072B2", "#56B4E9", "#009E73", "#E69F00", "#D55E00", "#CC79A7", "#000000")


def flat_view(document: str | Path) -> CalibrationView:
    """Content of a measured flat field's page; its image lies beside the document.

    Raises
    ------
    InputError
        If the document or its image cannot be used.
    """
    content = read_document(document, KIND)
    bands = wavelengths(document, content, "bands")
    pictures = {nm: _blocks(read_band(flat_image(document), nm)) for nm in bands}
    scale = range_scale(
        np.concatenate([p.ravel() for p in pictures.values()]), STEP, MOST, "relative response"
    )
    rows: list[list[Cell]] = [
        [
            f"{name} nm",
            *(
                Number(number(document, content, f"bands.{name}.{field}"), digits)
                for field, digits in (
                    ("least", 4),
                    ("greatest", 4),
                    ("pixel_relative_standard_error", 2),
                    ("missing_share", 2),
                )
            ),
        ]
        for name in bands.values()
    ]
    return CalibrationView(
        values=[
            Grid(
                f"Response by band: {content.get('normalisation', 'relative')}",
                (
                    "band",
                    "least",
                    "greatest",
                    "standard error of a pixel, relative",
                    "share of pixels without one",
                ),
                rows,
            )
        ],
        sections=[
            Section(
                "Response of the pixels",
                [map_picture(f"{nm} nm", values, scale) for nm, values in pictures.items()],
                "One scale for all bands; at most 0.2 % of the pixels lie beyond either end of it. Dark "
                "grey: no response (hot, dead and stuck pixels). What is measured is divided by it.",
                side_by_side=True,
            ),
            Section(
                "Fall-off toward the corners",
                [_fall_off(pictures)],
                "Mean response by distance from the middle of the frame. Vignetting falls smoothly and "
                "depends little on the band.",
            ),
        ],
    )


def _blocks(response: NDArray[np.float32]) -> Float:
    """Response as drawn: means over blocks that leave out pixels without one."""
    values = response.astype(np.float64)
    block = max(1, int(np.ceil(max(values.shape) / MOST_PIXELS)))
    if block == 1:
        return values
    rows, columns = (length // block for length in values.shape)
    parts = values[: rows * block, : columns * block].reshape(rows, block, columns, block)
    known = np.isfinite(parts)
    count = known.sum(axis=(1, 3))
    total = np.where(known, parts, 0.0).sum(axis=(1, 3))
    means: Float = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    return means


def _fall_off(pictures: dict[int, Float]) -> Picture:
    curves = {nm: _by_distance(values) for nm, values in pictures.items()}

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        figure.subplots_adjust(0.08, 0.15, 0.985, 0.95)
        for index, (nm, (distance, mean)) in enumerate(curves.items()):
            axes.plot(distance, mean, lw=1.2, color=BAND_COLOURS[index % len(BAND_COLOURS)], label=f"{nm} nm")
        axes.set_xlabel("distance from the middle, of that to a corner")
        axes.set_ylabel("mean relative response")
        axes.set_xlim(0, 1)
        axes.grid(True)
        axes.legend(loc="lower left", frameon=False)

    ends = ", ".join(f"{nm} nm {written(float(mean[-1]), 4)}" for nm, (_, mean) in curves.items())
    alt = f"Mean response by distance from the middle of the frame; in the corners: {ends}."
    return picture((9.4, 3.4), draw, alt)


def _by_distance(values: Float) -> tuple[Float, Float]:
    rows, columns = (np.linspace(-1.0, 1.0, length) for length in values.shape)
    high, wide = values.shape
    distance = np.hypot(rows[:, None] * high, columns * wide) / np.hypot(high, wide)
    known = np.isfinite(values)
    index = np.minimum((distance[known] * BINS).astype(np.intp), BINS - 1)
    count = np.bincount(index, minlength=BINS)
    mean = np.bincount(index, values[known], minlength=BINS) / np.maximum(count, 1)
    filled = count > 0
    return ((np.arange(BINS) + 0.5) / BINS)[filled], mean[filled]
