"""A session's photographs of a chrome ball to its ``lights.json``."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pbrdf.calibration.arm_fit import fit_arm
from pbrdf.calibration.arm_problem import BallHighlights, GivenRadius
from pbrdf.calibration.camera import Camera
from pbrdf.calibration.highlights import Highlight, find_highlight
from pbrdf.calibration.lights import KIND
from pbrdf.calibration.measured_lights import measured_lights
from pbrdf.calibration.outline import OutlineFit, fit_outline
from pbrdf.calibration.photograph import Photograph
from pbrdf.calibration.polarimeter import PolarimeterCalibration
from pbrdf.calibration.sphere import Sphere
from pbrdf.errors import InputError
from pbrdf.formats.documents import write_document
from pbrdf.formats.receipt import digest, digests
from pbrdf.optics.arm import generator_axis_at_zero
from pbrdf.settings.plan import light_id

STRAIGHT_DEG = 180.0
"""Angle of the arm at which the polarimeter is calibrated: there both modules' frames have one x axis."""

LIMIT_DEG = 0.25
"""Standard error of a light's direction from which the calibration must not be used: a quarter of the
finest table's step in θd. Balls of a thousand pixels' radius give a twentieth of a degree and better."""


def calibrate_lights(
    manifests: Iterable[str | Path],
    ambient: str | Path,
    camera: str | Path,
    polarimeter: str | Path,
    radius_mm: float,
    arm_radius: GivenRadius | None,
    document: str | Path,
) -> None:
    """Measure the arm's circle, and how the generator turns with it.

    Parameters
    ----------
    manifests : iterable of str or Path
        Of the chrome ball, a light each; frames lie beside it.
    ambient : str or Path
        Manifest of the same ball in ambient light.
    camera, polarimeter : str or Path
        The session's documents: the polarimeter's frames are those of the straight line, 180°.
    radius_mm : float
        Radius of the ball, measured by hand.
    arm_radius : GivenRadius or None
        Radius of the arm's circle, measured by hand: a ball in one place hardly tells it.
    document : str or Path
        What is written.

    Raises
    ------
    InputError
        If a photograph or a document cannot be used, two have the same angle, the ball's outline is not
        seen, or too few highlights are. An angle whose highlight is not seen is left out and named in the
        document.
    """
    manifests = list(manifests)
    eye = Camera.read(camera)
    axis = PolarimeterCalibration.read(polarimeter).analyser_axis
    outline = _ball(ambient, eye, radius_mm)
    inside = ball_pixels(eye, outline.sphere)
    found: dict[float, Highlight] = {}
    without: dict[str, str] = {}
    for manifest in manifests:
        photograph = Photograph.read(manifest)
        if photograph.angle_deg in found or light_id(photograph.angle_deg) in without:
            problem = f"is {photograph.angle_deg:.2f}°, and so is another photograph's"
            raise InputError(manifest, "angle_deg", problem, "give each angle once")
        try:
            found[photograph.angle_deg] = find_highlight(
                photograph.image, inside, photograph.saturation, source=manifest
            )
        except InputError as error:
            without[light_id(photograph.angle_deg)] = f"{error.field} {error.problem}"
    series = BallHighlights(
        outline.sphere,
        np.array(list(found)),
        np.array([one.column for one in found.values()]),
        np.array([one.row for one in found.values()]),
        np.array([one.error_px for one in found.values()]),
        outline.covariance,
    )
    fit = fit_arm(eye, [series], arm_radius, Path(ambient).parents[2], LIMIT_DEG)
    content = measured_lights(fit, generator_axis_at_zero(axis, STRAIGHT_DEG, fit.axis))
    write_document(
        document,
        KIND,
        {
            **content,
            "ball": {"centre_mm": list(outline.sphere.centre_mm), "radius_mm": radius_mm},
            "highlights_px": {light_id(a): [one.column, one.row] for a, one in found.items()},
            "left_out": without,
            "inputs": {
                "chrome": digest(manifests),
                **digests({"chrome_ambient": ambient, "camera": camera}),
            },
        },
    )


def ball_pixels(camera: Camera, ball: Sphere) -> NDArray[np.bool_]:
    """Pixels (rows, columns) whose middle shows the ball."""
    rows, columns = np.mgrid[: camera.rows, : camera.columns]
    distance = float(np.linalg.norm(ball.centre_mm))
    cosine = camera.rays(columns, rows) @ np.array(ball.centre_mm) / distance
    seen: NDArray[np.bool_] = cosine > np.sqrt(1 - (ball.radius_mm / distance) ** 2)
    return seen


def _ball(ambient: str | Path, camera: Camera, radius_mm: float) -> OutlineFit:
    photograph = Photograph.read(ambient)
    try:
        return fit_outline(photograph.image, camera, radius_mm, photograph.saturation)
    except InputError as error:
        raise InputError(ambient, error.field, error.problem, error.remedy) from None
