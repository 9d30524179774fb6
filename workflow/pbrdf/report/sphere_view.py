"""A sphere's page: its outline over the photograph it was found in, and how far edges lie from it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.outline_cone import off_outline_px
from pbrdf.calibration.outline_edges import Edges, find_edges, without_dead_pixels
from pbrdf.calibration.photograph import Photograph
from pbrdf.calibration.sphere import KIND, Sphere
from pbrdf.formats.documents import number, read_document
from pbrdf.report.calibration_parts import VALUE_HEAD, CalibrationView, Grid, Section, value_row
from pbrdf.report.figures import Float, Picture, picture
from pbrdf.report.figures import number as written
from pbrdf.report.photograph_picture import grey

OUTLINE_COLOUR, EDGE_COLOUR, OUTLIER_COLOUR = "#56B4E9", "#E69F00", "#CC79A7"
MOST_PIXELS = 640
MARGIN = 0.12
"""Room about the outline, of its diameter."""

HALF_PX, HALF_PER_BLUR = 8.0, 5.0
"""Half width of the band in which edges are looked for, px, and its least in deviations of the blur."""


@dataclass(frozen=True)
class _EdgePoints:
    """Edge points about the outline: distance from it, px, and which of them are taken for it."""

    edges: Edges
    distance_px: Float
    on: NDArray[np.bool_]


def sphere_view(document: str | Path, camera_document: str | Path, manifest: str | Path) -> CalibrationView:
    """Content of a measured sphere's page.

    Parameters
    ----------
    document, camera_document : str or Path
        ``sphere.json`` and the session's ``camera.json``.
    manifest : str or Path
        Of the photograph in ambient light.

    Raises
    ------
    InputError
        If an input cannot be used.
    """
    content = read_document(document, KIND)
    sphere, camera = Sphere.read(document), Camera.read(camera_document)
    photograph = Photograph.read(manifest)
    points = _edge_points(document, content, photograph, camera, sphere)
    count = len(points.distance_px)
    return CalibrationView(
        values=[_values(document, content, sphere)],
        sections=[
            Section(
                "The outline in the photograph",
                [_overlay(photograph, camera, sphere, points)],
                f"The sphere in ambient light with the outline of the fitted sphere, and the {count} places "
                "where a step of the image was found about it. Greys go with the square root of the signal.",
            ),
            Section(
                "Distances of edges from the outline",
                [_distances(document, content, points)],
                "Across the outline, positive outside, against the turn about it: 0° is toward the image's "
                "right, 90° toward its bottom. A wave of one period would be a centre that is off, of two "
                "periods focal lengths along columns and rows that disagree or a sphere that is not round, a "
                "constant a wrong distance; lights and shadows show as steps of a few degrees.",
            ),
        ],
        notes=[
            "The radius is given by hand: an error of it moves the centre along the view in proportion, "
            "which the standard error does not know."
        ],
    )


def _values(document: str | Path, content: dict[str, Any], sphere: Sphere) -> Grid:
    across = number(document, content, "standard_errors_mm.across")
    along = number(document, content, "standard_errors_mm.along")
    x, y, z = sphere.centre_mm
    rows = [
        value_row("centre, to the right, x", x, across, "mm"),
        value_row("centre, down, y", y, across, "mm"),
        value_row("centre, along the view, z", z, along, "mm"),
        value_row("radius (given)", sphere.radius_mm, None, "mm"),
        value_row("outline seen", number(document, content, "outline_deg"), None, "°"),
        value_row("edges that lie on it", number(document, content, "inlier_share"), None, "1"),
        value_row("rms distance of these", number(document, content, "residual_px"), None, "px"),
        value_row("blur, standard deviation", number(document, content, "blur_px"), None, "px"),
    ]
    caption = "In the camera's frame. The errors of x and y are the larger of the two across the view."
    return Grid(caption, VALUE_HEAD, rows)


def _edge_points(
    document: str | Path, content: dict[str, Any], photograph: Photograph, camera: Camera, sphere: Sphere
) -> _EdgePoints:
    """Edges as the calibration finds them, about the sphere that it found.

    Its share of edges on the outline are those that lie nearest.
    """
    blur_px = number(document, content, "blur_px")
    whole = without_dead_pixels(photograph.image.astype(np.float32))
    half_px = max(HALF_PX, HALF_PER_BLUR * blur_px)
    edges = find_edges(whole, camera, sphere, half_px, photograph.saturation, blur_px, measure_blur=False)
    distance, _, _ = off_outline_px(sphere, camera, edges.columns, edges.rows)
    kept = round(number(document, content, "inlier_share") * len(distance))
    on = np.zeros(len(distance), np.bool_)
    on[np.argsort(np.abs(distance), kind="stable")[:kept]] = True
    return _EdgePoints(edges, distance, on)


def _overlay(photograph: Photograph, camera: Camera, sphere: Sphere, points: _EdgePoints) -> Picture:
    columns, rows = camera.project(sphere.outline())
    margin = round(MARGIN * float(np.ptp(columns)))
    drawn = grey(photograph.image, MOST_PIXELS, sphere.window(camera, margin))
    width, high = drawn.extent[1] - drawn.extent[0], drawn.extent[2] - drawn.extent[3]
    size = 6.4, 6.4 * high / width + 0.3

    def draw(figure: Figure) -> None:
        axes = figure.add_axes((0.0, 0.0, 1.0, 1 - 0.3 / size[1]))
        drawn.draw(axes)
        axes.plot(columns, rows, lw=1.0, color=OUTLINE_COLOUR, label="fitted outline")
        _marks(axes.plot, points, points.edges.columns, points.edges.rows)
        figure.legend(*axes.get_legend_handles_labels(), loc="upper left", ncols=3, frameon=False)

    middle = [written(float(np.mean([v.min(), v.max()])), 5) for v in (columns, rows)]
    alt = f"Photograph of the sphere; its fitted outline is about column {middle[0]} and row {middle[1]}, "
    alt += (
        f"{written(float(np.ptp(columns)), 4)} px wide; {np.count_nonzero(points.on)} edge points lie on it."
    )
    return picture(size, draw, alt)


def _distances(document: str | Path, content: dict[str, Any], points: _EdgePoints) -> Picture:
    turn = np.degrees(points.edges.turns) % 360
    rms = number(document, content, "residual_px")
    within = np.abs(points.distance_px[points.on]).max(initial=rms)
    limit = 1.15 * float(within + points.edges.errors_px[points.on].max(initial=0.0))
    beyond = int(np.count_nonzero(np.abs(points.distance_px) > limit))

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        figure.subplots_adjust(0.08, 0.16, 0.985, 0.88)
        axes.axhspan(-rms, rms, color="#eef0f3", lw=0, label="rms")
        axes.axhline(0.0, color=OUTLINE_COLOUR, lw=1.2)
        axes.errorbar(
            turn, points.distance_px, yerr=points.edges.errors_px, fmt="none", lw=0.5, color="#999999"
        )
        _marks(axes.plot, points, turn, points.distance_px)
        axes.set_xlim(0, 360)
        axes.set_xticks(range(0, 361, 45))
        axes.set_ylim(-limit, limit)
        axes.set_xlabel("turn about the outline, °")
        axes.set_ylabel("edge − outline, px")
        axes.grid(True)
        title = "Edges and their standard errors"
        axes.set_title(f"{title}; {beyond} lie beyond the picture" if beyond else title, loc="left")
        figure.legend(*axes.get_legend_handles_labels(), loc="upper right", ncols=3, frameon=False)

    alt = f"Distance of {len(turn)} edge points from the outline around it; rms {written(rms)} px."
    return picture((9.4, 3.4), draw, alt)


def _marks(plot: Any, points: _EdgePoints, x: Float, y: Float) -> None:
    off = ~points.on
    plot(x[points.on], y[points.on], ".", ms=6, mew=0, color=EDGE_COLOUR, label="edges on it")
    if off.any():
        plot(x[off], y[off], "x", ms=4.5, mew=1.0, color=OUTLIER_COLOUR, label="edges left out")
