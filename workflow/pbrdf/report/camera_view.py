"""A camera's page: the board's views with their residuals, and where in the frame corners were found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pbrdf.calibration.board_pose import reprojection
from pbrdf.calibration.camera import KIND, Camera
from pbrdf.calibration.chessboard import Board, BoardView, find_view
from pbrdf.calibration.photograph import Photograph
from pbrdf.formats.documents import member, number, numbers, read_document
from pbrdf.report.calibration_parts import (
    VALUE_HEAD,
    CalibrationView,
    Grid,
    Number,
    Section,
    value_row,
)
from pbrdf.report.figures import Float, Picture, picture
from pbrdf.report.figures import number as written
from pbrdf.report.photograph_picture import Grey, exaggeration, grey

CORNER_COLOUR, LINE_COLOUR = "#0072B2", "#D55E00"
ACROSS = 4
VIEW_INCHES, VIEW_PIXELS = 3.05, 240
LINE_SHARE = 0.05
"""Of the frame's larger side: the length at which a typical residual is drawn."""

COEFFICIENTS = ("k1", "k2", "p1", "p2", "k3")


def camera_view(document: str | Path, board: Board, photographs: Mapping[str, str | Path]) -> CalibrationView:
    """Content of a measured camera's page.

    Parameters
    ----------
    document : str or Path
        ``camera.json``.
    board : Board
    photographs : mapping
        By name of the view its manifest.

    Raises
    ------
    InputError
        If the document or a photograph cannot be used.
    """
    content = read_document(document, KIND)
    camera = Camera.read(document)
    views: list[BoardView] = []
    thumbnails: dict[str, Grey] = {}
    for name, manifest in photographs.items():
        image = Photograph.read(manifest).image
        thumbnails[name] = grey(image, VIEW_PIXELS)
        view = find_view(name, image, board)
        views += [] if view is None else [view]
    residuals = {view.name: reprojection(camera, view) for view in views}
    return CalibrationView(
        values=[_values(document, content, camera), _models(document, content)],
        sections=[
            Section(
                "The board in every view",
                [_contact_sheet(camera, views, residuals, thumbnails)],
                _sheet_caption(camera, residuals, thumbnails),
                [_per_view(document, content)],
            ),
            Section(
                "Where corners lie, and how far from their places",
                [_coverage(document, content, camera, views, residuals)],
                "Left: the corners of all views in the frame, each view in a colour of its own, their hull, "
                "and the principal point with its standard errors. The lens is known within the hull. "
                "Right: residuals of all corners, found − projected, and a circle at their rms distance. "
                "Noise scatters evenly about the middle; clusters would be a lens model that is too simple, "
                "or a board that is not flat.",
            ),
        ],
    )


def _values(document: str | Path, content: Mapping[str, Any], camera: Camera) -> Grid:
    focal = numbers(document, content, "standard_errors.focal_px", 2)
    principal = numbers(document, content, "standard_errors.principal_px", 2)
    lens = numbers(document, content, "standard_errors.distortion", 5)
    rows = [
        value_row("focal length along columns, fx", camera.focal_px[0], focal[0], "px"),
        value_row("focal length along rows, fy", camera.focal_px[1], focal[1], "px"),
        value_row("principal point, column", camera.principal_px[0], principal[0], "px"),
        value_row("principal point, row", camera.principal_px[1], principal[1], "px"),
        *(
            value_row(f"distortion {name}", value, error, "1")
            for name, value, error in zip(COEFFICIENTS, camera.distortion, lens, strict=True)
            if error > 0
        ),
        value_row(
            "rms distance of corners from their places", number(document, content, "rms_px"), None, "px"
        ),
        value_row("frame within the hull of all corners", number(document, content, "covered"), None, "1"),
        value_row("views with the board", member(document, content, "boards_found"), None, ""),
        value_row("frame, columns", camera.columns, None, "px"),
        value_row("frame, rows", camera.rows, None, "px"),
    ]
    model = str(member(document, content, "distortion_model"))
    missing = member(document, content, "boards_not_found")
    caption = f"Lens model: {model}. Standard errors are of corners that err independently and alike."
    if missing:
        caption += f" Not found in: {', '.join(map(str, missing))}."
    return Grid(caption, VALUE_HEAD, rows)


def _models(document: str | Path, content: Mapping[str, Any]) -> Grid:
    differ = written(number(document, content, "models_differ_px"))
    return Grid(
        "Lens models that were tried: the lowest Bayesian information criterion is taken. Within the frame "
        f"those with more coefficients move pixels by up to {differ} px.",
        ("model", "rms, px", "criterion"),
        [
            [name, Number(model["rms_px"], 4), Number(model["bic"], 6)]
            for name, model in member(document, content, "models").items()
        ],
    )


def _per_view(document: str | Path, content: Mapping[str, Any]) -> Grid:
    return Grid(
        "Views",
        ("view", "corners", "rms, px", "tilt, °"),
        [
            [name, Number(view["corners"]), Number(view["rms_px"]), Number(view["tilt_deg"])]
            for name, view in member(document, content, "per_view").items()
        ],
    )


def _factor(camera: Camera, residuals: Mapping[str, Float]) -> float:
    lengths = np.concatenate([np.hypot(*each.T) for each in residuals.values()] or [np.zeros(1)])
    typical = float(np.sqrt(np.mean(lengths**2)))
    return exaggeration(typical, LINE_SHARE * max(camera.rows, camera.columns))


def _sheet_caption(camera: Camera, residuals: Mapping[str, Float], thumbnails: Mapping[str, Grey]) -> str:
    words = "Dots: corners as found. Lines: found − projected, drawn "
    words += f"{written(_factor(camera, residuals))} times as long. "
    block = next(iter(thumbnails.values())).block
    if block > 1:
        words += f"Photographs are drawn as means over {block} × {block} pixels. "
    return words + "Greys go with the square root of the signal."


def _contact_sheet(
    camera: Camera,
    views: Sequence[BoardView],
    residuals: Mapping[str, Float],
    thumbnails: Mapping[str, Grey],
) -> Picture:
    down = -(-len(thumbnails) // ACROSS)
    height = VIEW_INCHES * camera.rows / camera.columns + 0.24
    factor = _factor(camera, residuals)
    by_name = {view.name: view for view in views}

    def draw(figure: Figure) -> None:
        panels = figure.subplots(down, ACROSS, squeeze=False).ravel()
        figure.subplots_adjust(0.004, 0.004, 0.996, 1 - 0.2 / (down * height), wspace=0.03, hspace=0.09)
        for axes in panels[len(thumbnails) :]:
            axes.set_axis_off()
        for axes, (name, drawn) in zip(panels, thumbnails.items(), strict=False):
            drawn.draw(axes)
            if name not in by_name:
                axes.set_title(f"{name}: no board found", loc="left", pad=2)
                continue
            axes.set_title(name, loc="left", pad=2)
            corners = by_name[name].corners_px.astype(np.float64)
            ends = corners + factor * residuals[name]
            lines = np.full((len(corners), 3, 2), np.nan)
            lines[:, 0], lines[:, 1] = corners, ends
            axes.plot(*lines.reshape(-1, 2).T, lw=1.3, color=LINE_COLOUR)
            axes.plot(*corners.T, ".", ms=5, mew=0.3, mec="white", color=CORNER_COLOUR)

    rms = ", ".join(
        f"{name} {written(float(np.sqrt(np.mean(np.sum(each**2, axis=1)))))}"
        for name, each in residuals.items()
    )
    alt = f"{len(thumbnails)} photographs of a board with its corners and their residuals; rms, px: {rms}."
    return picture((ACROSS * VIEW_INCHES, down * height), draw, alt)


def _coverage(
    document: str | Path,
    content: Mapping[str, Any],
    camera: Camera,
    views: Sequence[BoardView],
    residuals: Mapping[str, Float],
) -> Picture:
    errors = numbers(document, content, "standard_errors.principal_px", 2)
    rms = number(document, content, "rms_px")
    every = np.concatenate([view.corners_px for view in views])
    hull = cv2.convexHull(every).reshape(-1, 2)
    colours = [f"C{index % 10}" for index in range(len(views))]

    def draw(figure: Figure) -> None:
        frame, scatter = figure.subplots(1, 2)
        figure.subplots_adjust(0.06, 0.11, 0.985, 0.93, wspace=0.16)
        frame.set_title("Corners in the frame", loc="left")
        frame.fill(*hull.T, color="#eef0f3", lw=0)
        for view, colour in zip(views, colours, strict=True):
            frame.plot(*view.corners_px.T, ".", ms=3, mew=0, color=colour)
        column, row = camera.principal_px
        frame.errorbar(
            column,
            row,
            xerr=errors[0],
            yerr=errors[1],
            color="black",
            capsize=3,
            lw=1,
            label="principal point",
        )
        frame.set_xlim(-0.5, camera.columns - 0.5)
        frame.set_ylim(camera.rows - 0.5, -0.5)
        frame.set_aspect("equal")
        frame.legend(loc="upper left", frameon=True)
        _pixels(frame, "column, px", "row, px")
        scatter.set_title("Residuals of corners", loc="left")
        for view, colour in zip(views, colours, strict=True):
            scatter.plot(*residuals[view.name].T, ".", ms=3, mew=0, color=colour)
        turn = np.linspace(0, 2 * np.pi, 181)
        scatter.plot(rms * np.cos(turn), rms * np.sin(turn), lw=1, color="black", label="rms")
        limit = 1.05 * max(float(np.abs(each).max()) for each in residuals.values())
        scatter.set_xlim(-limit, limit)
        scatter.set_ylim(limit, -limit)
        scatter.set_aspect("equal")
        scatter.grid(True)
        scatter.legend(loc="upper left", frameon=True)
        _pixels(scatter, "column, found − projected, px", "row, found − projected, px")

    covered = number(document, content, "covered")
    alt = (
        f"{len(every)} corners cover {written(100 * covered)} % of the frame; rms residual {written(rms)} px."
    )
    return picture((9.4, 4.7), draw, alt)


def _pixels(axes: Axes, across: str, down: str) -> None:
    axes.set_xlabel(across)
    axes.set_ylabel(down)
