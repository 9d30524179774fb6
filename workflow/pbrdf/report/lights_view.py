"""A page of lights: highlights on the chrome ball, found and fitted, and the arm's circle."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.lights import KIND
from pbrdf.calibration.photograph import Photograph
from pbrdf.calibration.sphere import Sphere
from pbrdf.formats.documents import member, number, numbers, positive, read_document, unit_vector
from pbrdf.optics.arm import Arm
from pbrdf.report.arm_picture import arm_from_above
from pbrdf.report.calibration_parts import (
    NONE,
    VALUE_HEAD,
    CalibrationView,
    Cell,
    Grid,
    Number,
    Section,
    value_row,
)
from pbrdf.report.figures import Float, Picture, picture
from pbrdf.report.figures import number as written
from pbrdf.report.photograph_picture import grey

FOUND_COLOUR, FITTED_COLOUR, OUTLINE_COLOUR = "#E69F00", "#56B4E9", "#56B4E9"
COLUMN_COLOUR, ROW_COLOUR = "#0072B2", "#D55E00"
MOST_PIXELS = 640
MARGIN_PX = 4
LABELS = 15
"""At most about so many angles are written beside the highlights."""

LABEL_POINTS = 38.0
"""Distance of an angle from its highlight: the blob itself stays free."""

ROOM = 0.12
"""Room about the highlights in the enlarged picture, of the ball's radius."""


@dataclass(frozen=True)
class Highlights:
    """Highlights by angle of the arm, ascending.

    Attributes
    ----------
    names : list of str
        The lights.
    angles_deg : ndarray, shape (n,)
    found, residuals : ndarray, shape (n, 2)
        Columns and rows, px: places, and these less the fitted ones.
    direction_errors_deg : ndarray, shape (n,)
    """

    names: list[str]
    angles_deg: Float
    found: Float
    residuals: Float
    direction_errors_deg: Float

    @property
    def fitted(self) -> Float:
        """Columns and rows, px, shape (n, 2)."""
        places: Float = self.found - self.residuals
        return places


def lights_view(
    document: str | Path, camera_document: str | Path, manifests: Iterable[str | Path]
) -> CalibrationView:
    """Content of a page of measured lights.

    Parameters
    ----------
    document, camera_document : str or Path
        ``lights.json`` and the session's ``camera.json``.
    manifests : iterable of str or Path
        Of the chrome ball, a light each.

    Raises
    ------
    InputError
        If an input cannot be used.
    """
    content = read_document(document, KIND)
    camera = Camera.read(camera_document)
    x, y, z = numbers(document, content, "ball.centre_mm", 3)
    ball = Sphere((x, y, z), positive(document, content, "ball.radius_mm"))
    highlights = _highlights(document, content)
    left_out = member(document, content, "left_out")
    arm = _arm(document, content)
    brightest = _brightest(manifests)
    named = f"{len(left_out)} angles without a usable highlight: " if left_out else ""
    return CalibrationView(
        values=[_values(document, content)],
        sections=[
            Section(
                "Highlights on the ball",
                _overlays(brightest, camera, ball, highlights),
                "The brightest value of each pixel over all angles of the arm, with the place of each "
                "highlight as found (circles) and as the fitted arm puts it (crosses), and the ball's "
                "outline from ambient light. Greys go with the square root of the signal; single bright "
                "pixels are hot ones.",
            ),
            Section(
                "Residuals",
                [_residuals(highlights)],
                "Above: found − fitted place, by angle. A trend would be an arm that is no circle, or a ball "
                "that is misplaced. Below: standard error of the direction toward the light in its worst "
                "direction.",
            ),
            Section(
                "The arm's circle from above",
                [arm_from_above(arm, ball, highlights.angles_deg, [float(name) for name in left_out])],
                "In the plane of the arm, seen along its axis. Circles: lights whose highlight was found; "
                f"crosses: lights that only the circle places. {named}{_reasons(left_out)}",
                [_by_angle(highlights)],
            ),
        ],
        notes=[str(note) for note in member(document, content, "notes")],
    )


def _highlights(document: str | Path, content: Mapping[str, Any]) -> Highlights:
    found = member(document, content, "highlights_px")
    residuals = member(document, content, "residuals_px")
    errors = member(document, content, "standard_errors.direction_deg")
    names = sorted(set(found) & set(residuals) & set(errors))
    return Highlights(
        names,
        np.array([float(name) for name in names]),
        np.array([numbers(document, {"place": found[name]}, "place", 2) for name in names]),
        np.array([numbers(document, {"place": residuals[name][0]}, "place", 2) for name in names]),
        np.array([number(document, {"error": errors[name]}, "error") for name in names]),
    )


def _arm(document: str | Path, content: Mapping[str, Any]) -> Arm:
    """The arm, whatever the verdict on it: an unusable one is looked at most."""
    x, y, z = numbers(document, content, "centre_mm", 3)
    offsets = {}
    for name, offset in member(document, content, "offsets_mm").items():
        dx, dy, dz = numbers(document, {"offset": offset}, "offset", 3)
        offsets[round(float(name), 2)] = (dx, dy, dz)
    return Arm(
        (x, y, z),
        unit_vector(document, content, "axis"),
        unit_vector(document, content, "start"),
        positive(document, content, "radius_mm"),
        unit_vector(document, content, "generator_axis"),
        offsets,
    )


def _values(document: str | Path, content: Mapping[str, Any]) -> Grid:
    errors = numbers(document, content, "standard_errors.centre_mm", 3)
    centre = numbers(document, content, "centre_mm", 3)
    ball = numbers(document, content, "ball.centre_mm", 3)
    rows = [
        value_row(f"centre of the circle, {name}", value, error, "mm")
        for name, value, error in zip("xyz", centre, errors, strict=True)
    ]
    radius = number(document, content, "radius_mm")
    rows.append(value_row("radius", radius, number(document, content, "standard_errors.radius_mm"), "mm"))
    rows += [_vector(document, content, "axis", "axis of the arm", "standard_errors.axis_deg")]
    rows += [_vector(document, content, "start", "toward the light at 0°", "standard_errors.start_deg")]
    rows += [_vector(document, content, "generator_axis", "x axis of the generator's frame at 0°", None)]
    rows += [
        value_row(f"centre of the ball, {n}", v, None, "mm", 6) for n, v in zip("xyz", ball, strict=True)
    ]
    rows.append(
        value_row("radius of the ball (given)", number(document, content, "ball.radius_mm"), None, "mm")
    )
    caption = (
        "In the camera's frame: x right, y down, z along the view. Errors of directions: of the axis in its "
        "worst direction, of the turn about it."
    )
    return Grid(caption, VALUE_HEAD, rows)


def _vector(
    document: str | Path, content: Mapping[str, Any], field: str, name: str, error: str | None
) -> list[Cell]:
    words = ", ".join(written(v, 5) for v in numbers(document, content, field, 3))
    deviation = NONE if error is None else f"{written(number(document, content, error), 2)}°"
    return [name, words, deviation, "unit vector"]


def _by_angle(highlights: Highlights) -> Grid:
    rows = zip(
        highlights.names, highlights.found, highlights.residuals, highlights.direction_errors_deg, strict=True
    )
    return Grid(
        "Highlights by angle of the arm",
        (
            "light at, °",
            "column, px",
            "row, px",
            "column residual, px",
            "row residual, px",
            "direction's error, °",
        ),
        [
            [
                name,
                *(Number(float(v), 5) for v in place),
                *(Number(float(v), 2) for v in left),
                Number(float(e), 2),
            ]
            for name, place, left, e in rows
        ],
    )


def _reasons(left_out: Mapping[str, Any]) -> str:
    by_reason: dict[str, list[str]] = {}
    for name, reason in left_out.items():
        by_reason.setdefault(str(reason), []).append(name)
    sentences = (
        f"{', '.join(f'{name}°' for name in names)} ({reason})" for reason, names in by_reason.items()
    )
    return f"{'; '.join(sentences)}." if left_out else ""


def _brightest(manifests: Iterable[str | Path]) -> Float:
    """Largest value of each pixel over the photographs, read one at a time."""
    brightest: Float | None = None
    for manifest in manifests:
        image = Photograph.read(manifest).image
        brightest = image if brightest is None else np.maximum(brightest, image)
    if brightest is None:
        raise ValueError("no photographs of the chrome ball")
    return brightest


def _overlays(image: Float, camera: Camera, ball: Sphere, highlights: Highlights) -> list[Picture]:
    """The highlights enlarged, and the whole ball."""
    whole = ball.window(camera, MARGIN_PX)
    radius = (whole[1].stop - whole[1].start) / 2
    strip = [
        _about(highlights.found[:, axis], radius, bounds) for axis, bounds in ((1, whole[0]), (0, whole[1]))
    ]
    return [
        _overlay(image, camera, ball, highlights, (strip[0], strip[1]), 12.2, labelled=True),
        _overlay(image, camera, ball, highlights, whole, 5.4, labelled=False),
    ]


def _about(places: Float, radius: float, bounds: slice) -> slice:
    """Pixels about places, within bounds."""
    room = max(MARGIN_PX, ROOM * radius)
    first, last = int(np.floor(places.min() - room)), int(np.ceil(places.max() + room)) + 1
    return slice(max(first, bounds.start), min(last, bounds.stop))


def _overlay(
    image: Float,
    camera: Camera,
    ball: Sphere,
    highlights: Highlights,
    window: tuple[slice, slice],
    width: float,
    labelled: bool,
) -> Picture:
    drawn = grey(image, MOST_PIXELS, window)
    columns, rows = drawn.extent[1] - drawn.extent[0], drawn.extent[2] - drawn.extent[3]
    size = width, width * rows / columns + 0.3
    step = max(1, -(-len(highlights.names) // LABELS))

    def draw(figure: Figure) -> None:
        axes = figure.add_axes((0.0, 0.0, 1.0, 1 - 0.3 / size[1]))
        drawn.draw(axes)
        axes.plot(*camera.project(ball.outline()), lw=0.8, color=OUTLINE_COLOUR, label="outline")
        axes.plot(*highlights.fitted.T, "+", ms=7, mew=1.2, color=FITTED_COLOUR, label="fitted")
        if labelled:
            axes.plot(*highlights.found.T, "o", ms=11, mew=1.1, mfc="none", color=FOUND_COLOUR, label="found")
            shown = list(zip(highlights.angles_deg, highlights.found, strict=True))[::step]
            for index, (angle, place) in enumerate(shown):
                # above and below by turns, clear of the highlights: they crowd toward the outline
                upward = 1 if index % 2 else -1
                axes.annotate(
                    f"{written(float(angle), 4)}°",
                    (float(place[0]), float(place[1])),
                    xytext=(0, upward * LABEL_POINTS),
                    textcoords="offset points",
                    color="white",
                    fontsize=7.5,
                    ha="center",
                    va="center",
                    arrowprops={"arrowstyle": "-", "color": "#9a9a9a", "lw": 0.5, "shrinkB": 8.0},
                )
        figure.legend(*axes.get_legend_handles_labels(), loc="upper left", ncols=3, frameon=False)

    rms = float(np.sqrt(np.mean(np.sum(highlights.residuals**2, axis=1))))
    what = "Highlights" if labelled else "The ball with its highlights"
    alt = f"{what} at {len(highlights.names)} angles of the arm; rms distance of found from fitted "
    return picture(size, draw, f"{alt}{written(rms)} px.")


def _residuals(highlights: Highlights) -> Picture:
    def draw(figure: Figure) -> None:
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
        figure.subplots_adjust(0.08, 0.11, 0.985, 0.92, hspace=0.1)
        above.axhline(0.0, color="#555555", lw=0.6)
        series: Sequence[tuple[str, str, str]] = (("column", COLUMN_COLOUR, "o-"), ("row", ROW_COLOUR, "s-"))
        for index, (name, colour, style) in enumerate(series):
            values = highlights.residuals[:, index]
            above.plot(highlights.angles_deg, values, style, ms=3.5, mew=0, lw=0.6, color=colour, label=name)
        above.set_ylabel("found − fitted, px")
        below.plot(
            highlights.angles_deg, highlights.direction_errors_deg, "o-", ms=3, lw=0.6, color="#555555"
        )
        below.set_ylim(bottom=0.0)
        below.set_ylabel("direction's error, °")
        below.set_xlabel("angle of the arm, °")
        for axes in (above, below):
            axes.grid(True)
        figure.legend(*above.get_legend_handles_labels(), loc="upper right", ncols=2, frameon=False)

    worst = float(np.abs(highlights.residuals).max())
    alt = f"Residuals of highlights by angle of the arm, at most {written(worst)} px; standard errors of "
    alt += f"directions up to {written(float(highlights.direction_errors_deg.max()))}°."
    return picture((9.4, 4.2), draw, alt)
