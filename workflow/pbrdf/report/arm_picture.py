"""The arm's circle seen along its axis: camera, ball and lights."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from numpy.typing import NDArray

from pbrdf.calibration.sphere import Sphere
from pbrdf.optics.arm import Arm
from pbrdf.report.figures import Float, Picture, number, picture

LIGHT_COLOUR, CIRCLE_COLOUR, VIEW_COLOUR = "#D55E00", "#56B4E9", "#555555"
WIDTH = 8.4
LOW_SHARE = 0.3
"""Of the radius: how much of the circle beyond the lights' half is shown."""

LABEL_STEP_DEG = 30.0


def arm_from_above(arm: Arm, ball: Sphere, angles_deg: Float, others_deg: Sequence[float]) -> Picture:
    """Draw the circle, the camera at the origin, the ball and the lights.

    Parameters
    ----------
    arm : Arm
    ball : Sphere
    angles_deg : ndarray, shape (n,)
        Lights that were seen.
    others_deg : sequence of float
        Lights that were not.
    """
    centre = np.asarray(arm.centre_mm)
    up = np.asarray(arm.start)
    across = np.cross(arm.axis, up)

    def flat(points: Float) -> NDArray[np.float64]:
        """Places (..., 2) in the arm's plane, the light at angle zero to the left."""
        relative = points - centre
        places: Float = np.stack([-(relative @ up), relative @ across], -1)
        return places

    turns = np.arange(0.0, 360.5, 1.0)
    on_circle = Arm(arm.centre_mm, arm.axis, arm.start, arm.radius_mm, arm.generator_axis)
    circle = flat(np.array([on_circle.light_position(float(t)) for t in turns]))
    lights = flat(np.array([arm.light_position(float(a)) for a in angles_deg]))
    camera, middle = flat(np.zeros(3)), flat(np.asarray(ball.centre_mm))
    low = -LOW_SHARE * arm.radius_mm
    left = min(float(circle[:, 0].min()), float(camera[0])) - 0.06 * arm.radius_mm
    right = 1.14 * arm.radius_mm
    high = 1.12 * arm.radius_mm

    def draw(figure: Figure) -> None:
        axes = figure.add_axes((0.085, 0.085, 0.9, 0.9))
        axes.plot(*circle.T, lw=0.8, color=CIRCLE_COLOUR, label="circle")
        for light in lights:
            axes.plot([middle[0], light[0]], [middle[1], light[1]], lw=0.3, color="#bbbbbb")
        axes.plot([camera[0], middle[0]], [camera[1], middle[1]], lw=0.8, ls="--", color=VIEW_COLOUR)
        axes.plot(*lights.T, "o", ms=4, mew=0, color=LIGHT_COLOUR, label="lights seen")
        if len(others_deg):
            unseen = flat(np.array([arm.light_position(a) for a in others_deg]))
            axes.plot(*unseen.T, "x", ms=4, color=LIGHT_COLOUR, label="lights not seen")
        axes.plot(*camera, "s", ms=6, color="black", label="camera")
        axes.add_patch(Circle((middle[0], middle[1]), ball.radius_mm, color=VIEW_COLOUR, label="ball"))
        for angle in np.arange(0.0, 181.0, LABEL_STEP_DEG):
            place = flat(on_circle.light_position(float(angle))) * 1.06
            # the line of view passes through the one at 0°
            ground = {"boxstyle": "square,pad=0.15", "fc": "white", "ec": "none"}
            axes.annotate(
                f"{angle:g}°", (place[0], place[1]), fontsize=7, ha="center", va="center", bbox=ground
            )
        axes.set_aspect("equal")
        axes.set_xlim(left, right)
        axes.set_ylim(low, high)
        axes.set_xlabel("from the circle's centre, away from the light at 0°, mm")
        axes.set_ylabel("across, toward the light at 90°, mm")
        axes.grid(True)
        axes.legend(loc="lower center", bbox_to_anchor=(0.62, 0.02), ncols=3, frameon=True)

    height = WIDTH * (high - low) / (right - left)
    alt = f"Circle of radius {number(arm.radius_mm, 4)} mm with {len(lights)} lights, the camera "
    alt += f"{number(float(np.linalg.norm(centre)), 4)} mm from its centre and the ball "
    alt += f"{number(float(np.linalg.norm(ball.centre_mm)), 4)} mm from the camera."
    return picture((WIDTH, height), draw, alt)
