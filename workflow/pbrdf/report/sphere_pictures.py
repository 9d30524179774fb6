"""The lit sphere drawn: the table beside its fits, and what their light's polarisation is."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from io import BytesIO

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from pbrdf.fitting import FitResult
from pbrdf.formats.table_data import TableData
from pbrdf.models.table import Table
from pbrdf.optics.stokes import degree_of_polarisation
from pbrdf.report.figures import Float, Picture, number, picture
from pbrdf.report.fit_view import model_of, model_title
from pbrdf.report.lit_sphere import (
    INCIDENT,
    LAMP_DEG,
    Evaluator,
    SphereView,
    photograph,
    reflected_stokes,
    sphere_view,
    white_level,
)
from pbrdf.report.polarisation_colours import (
    chirality_colours,
    degree_colours,
    orientation_colours,
    type_colours,
)
from pbrdf.report.scales import UNKNOWN_COLOUR, colour_bytes

COLUMNS = {
    "degree (DoP)": degree_colours,
    "orientation (AoLP)": orientation_colours,
    "chirality": chirality_colours,
    "type": type_colours,
}
_KEYS = (
    "black 0, red 1",
    "+s1 green, −s1 red, +s2 yellow, −s2 blue",
    "right blue, left yellow",
    "linear cyan, circular yellow",
)


def evaluators(table: TableData, fits: list[FitResult]) -> dict[str, Evaluator]:
    """Evaluator of the table, and of each fit, by title."""

    def of_table(to_light: Float, to_camera: Float, band: int) -> Float:
        return Table(table).evaluate(to_light, to_camera, table.wavelengths_nm[band])

    def of_fit(fit: FitResult) -> Evaluator:
        return lambda to_light, to_camera, band: model_of(fit).evaluate(to_light, to_camera, fit.band(band))

    return {"Table": of_table} | {model_title(fit.model): of_fit(fit) for fit in fits}


def sphere_pictures(table: TableData, fits: list[FitResult], band: int) -> dict[str, Picture]:
    """Draw the lit sphere of table and fits, a picture for each light that falls in, by its name."""
    view, sources = sphere_view(), evaluators(table, fits)
    white = white_level(view, sources, table.wavelengths_nm)
    return {
        name: _picture(view, sources, table.wavelengths_nm, band, name, incident, white)
        for name, incident in INCIDENT.items()
    }


def thumbnail(table: TableData, fits: list[FitResult], band: int, side: int = 96) -> tuple[str, str]:
    """Small picture as a ``data:`` address, and its words: table and best fit, photograph beside type."""
    view = sphere_view(side)
    sources = dict(list(evaluators(table, fits).items())[:2])
    incident = INCIDENT["unpolarised light"]
    white = white_level(view, sources, table.wavelengths_nm)
    tiles = []
    for evaluate in sources.values():
        stokes = reflected_stokes(view, evaluate, band, incident)
        tiles.append(_tile(view, photograph(view, evaluate, table.wavelengths_nm, incident, white), stokes))
        tiles.append(_tile(view, type_colours(_divisible(stokes)), stokes))
    buffer = BytesIO()
    Image.fromarray(np.concatenate(tiles, axis=1)).save(buffer, format="png", optimize=True)
    words = " and ".join(sources)
    alt = f"{words}: sphere under a lamp {LAMP_DEG:g}° aside, each as photograph and as type of polarisation."
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode("ascii"), alt


def _picture(
    view: SphereView,
    sources: Mapping[str, Evaluator],
    wavelengths_nm: Float,
    band: int,
    name: str,
    incident: tuple[float, ...],
    white: float,
) -> Picture:
    rows, described = [], []
    for title, evaluate in sources.items():
        stokes = reflected_stokes(view, evaluate, band, incident)
        tiles = [_tile(view, photograph(view, evaluate, wavelengths_nm, incident, white), stokes)]
        tiles += [_tile(view, colours(_divisible(stokes)), stokes) for colours in COLUMNS.values()]
        rows.append((title, tiles))
        described.append(f"{title}: {_words(stokes)}")
    nm = number(float(wavelengths_nm[band]), 4)
    height = 0.55 + 1.62 * len(rows)

    def draw(figure: Figure) -> None:
        panels = figure.subplots(len(rows), 1 + len(COLUMNS), squeeze=False)
        figure.subplots_adjust(
            left=0.055, right=0.995, top=1 - 0.32 / height, bottom=0.2 / height, wspace=0.03, hspace=0.04
        )
        figure.text(0.045, 1 - 0.02 / height, f"In {name}, polarisation at {nm} nm", va="top", weight="bold")
        for row, (title, tiles) in zip(panels, rows, strict=True):
            for axes, tile in zip(row, tiles, strict=True):
                axes.imshow(tile, interpolation="none")
                axes.set_axis_off()
            # a long title runs over the sphere above unless it is broken
            name_of_row, size = title.replace(", ", ",\n"), 8.0 if "," not in title else 6.5
            row[0].text(
                *(-0.06, 0.5, name_of_row),
                rotation=90,
                va="center",
                ha="right",
                multialignment="center",
                fontsize=size,
                transform=row[0].transAxes,
            )
        for axes, title in zip(panels[0], ("photograph", *COLUMNS), strict=True):
            axes.set_title(title, pad=2)
        for axes, key in zip(panels[-1], ("", *_KEYS), strict=True):
            axes.text(0.5, -0.02, key, ha="center", va="top", fontsize=6.0, transform=axes.transAxes)

    alt = (
        f"Sphere in {name} from a lamp {LAMP_DEG:g}° to the left; columns: photograph, degree, orientation, "
    )
    return picture((9.4, height), draw, alt + f"chirality and type of polarisation. {' '.join(described)}")


def _tile(view: SphereView, rgb: Float, stokes: Float) -> NDArray[np.uint8]:
    """Colours as bytes: white around the sphere, grey where the table knows nothing, black in the dark."""
    tile = np.round(255 * np.nan_to_num(rgb)).astype(np.uint8)
    tile[view.on_sphere & np.isnan(stokes[..., 0])] = colour_bytes(UNKNOWN_COLOUR)[:3]
    tile[~view.on_sphere] = 255
    return tile


def _divisible(stokes: Float) -> Float:
    """Stokes vectors with an intensity of 1 where there is no light, so that nothing is divided by 0."""
    some = stokes.copy()
    some[..., 0] = np.where(some[..., 0] > 0, some[..., 0], 1.0)
    some[..., 1:] = np.where(stokes[..., :1] > 0, some[..., 1:], 0.0)
    return some


def _words(stokes: Float) -> str:
    bright = stokes[stokes[..., 0] > 0]
    if not bright.size:
        return "nothing known."
    degree = degree_of_polarisation(bright)
    return f"DoP median {number(float(np.median(degree)), 2)}, at most {number(float(degree.max()), 2)}."
