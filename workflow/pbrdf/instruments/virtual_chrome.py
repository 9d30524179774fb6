"""A mirror ball in front of a virtual rig's camera: where the lamp stands is told by its highlight."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

from pbrdf.errors import InputError
from pbrdf.instruments.virtual_ambient import VirtualAmbientBall, ball_normals
from pbrdf.instruments.virtual_geometry import UP, virtual_arm
from pbrdf.instruments.virtual_view import BLUR_PX, Float, rays_through
from pbrdf.optics.frames import angle_between, change_frames, normalised, table_axis, transverse

OFFSET_MM = (1.2, -0.8, 2.0)
"""Where the ball stands beside the arm's centre: nobody places it exactly."""

REFLECTANCE = 0.55
"""Of chromium in the visible near normal incidence."""

IDEAL_MIRROR = np.diag([1.0, 1.0, -1.0, -1.0])
"""Between table frames: what vibrates along s stays, what vibrates along p turns round."""

SAMPLES = 256
"""Rays along each side of the square that holds the lamp's image."""

MARGIN = 1.5
"""Side of that square over the least that a mirror of the ball's curvature needs."""


class VirtualChrome:
    """A chrome ball under the lamp (`pbrdf.instruments.virtual_rig.Subject`).

    A ray that the ball mirrors onto the lamp's disc sees its radiance, dimmed by `REFLECTANCE` at every
    angle; an ideal mirror changes its polarisation. The lens blurs the tiny image of the disc.

    Parameters
    ----------
    rig : dict
        The rig's file, checked against its schema.
    radius_mm : float
        Radius of the ball.
    source : str or Path
        The rig's file, for messages.

    Raises
    ------
    InputError
        If the rig does not say how its lamp looks.
    """

    name = "chrome"

    def __init__(self, rig: dict[str, Any], radius_mm: float, source: str | Path) -> None:
        if "lamp_disc" not in rig:
            raise InputError(source, "lamp_disc", "is missing", "give radius and radiance of the lamp's disc")
        self._rig = rig
        self._arm = virtual_arm(rig)
        self.centre_mm: Float = np.asarray(self._arm.centre_mm) + OFFSET_MM
        self.radius_mm = radius_mm

    @property
    def truth(self) -> dict[str, Any]:
        """Place, size and reflectance of the ball, and the lamp's disc."""
        return {
            "centre_mm": self.centre_mm.tolist(),
            "radius_mm": self.radius_mm,
            "reflectance": REFLECTANCE,
            "lamp_disc": self._rig["lamp_disc"],
            "blur_px": BLUR_PX,
        }

    def mueller_image(self, angle_deg: float, band_nm: int) -> NDArray[np.float32]:
        """Mueller image of the light path (rows, columns, 16), radiance; black but for the highlight."""
        camera, lamp = self._rig["camera"], self._arm.light_position(angle_deg)
        normal = highlight_normal(self.centre_mm, self.radius_mm, lamp)
        point = self.centre_mm + self.radius_mm * normal
        to_light, to_camera = normalised(lamp - point), normalised(-point)
        if not normal @ to_camera > 0:
            return np.zeros((camera["rows"], camera["columns"], 16), np.float32)
        mueller = self._mirror(to_light, to_camera, angle_deg)
        seen = REFLECTANCE * self._rig["lamp_disc"]["radiance"] * mueller.ravel()
        image: NDArray[np.float32] = (self._lamp_share(point, lamp)[..., None] * seen).astype(np.float32)
        return image

    def _mirror(self, to_light: Float, to_camera: Float, angle_deg: float) -> Float:
        """Ideal mirror (4, 4) between the frames of generator and analyser."""
        s = table_axis(to_light, to_camera)
        x_in = transverse(self._arm.generator_x(angle_deg), -to_light)
        x_out = transverse(UP, to_camera)
        angle_in = angle_between(s, x_in, -to_light)
        return change_frames(IDEAL_MIRROR, angle_in, angle_between(s, x_out, to_camera))

    def _lamp_share(self, point: Float, lamp: Float) -> Float:
        """Share of each pixel (rows, columns) that shows the lamp's disc, blurred by the lens."""
        camera = self._rig["camera"]
        focal, (cx, cy) = camera["focal_px"], camera["principal_px"]
        disc = self._rig["lamp_disc"]["radius_mm"]
        # a mirror turns the normal by half of what the ray turns
        half = MARGIN * focal / point[2] * self.radius_mm * disc / np.linalg.norm(lamp - point) / 2
        step = 2 * half / SAMPLES
        offsets = step * (np.arange(SAMPLES) + 0.5) - half
        columns = focal * point[0] / point[2] + cx + offsets
        rows = focal * point[1] / point[2] + cy + offsets
        bright = self._mirrors_lamp(columns, rows[:, None], lamp).astype(np.float64)
        down = _pixel_shares(rows, camera["rows"])
        right = _pixel_shares(columns, camera["columns"])
        share: Float = step**2 * (down @ bright @ right.T)
        return share

    def _mirrors_lamp(self, columns: Float, rows: Float, lamp: Float) -> NDArray[np.bool_]:
        """Whether the ball shows the lamp's disc at places of the image."""
        toward = normalised(rays_through(self._rig, columns, rows))
        hit, normal = ball_normals(toward, self.centre_mm, self.radius_mm)
        mirrored = toward - 2 * np.sum(toward * normal, -1, keepdims=True) * normal
        from_lamp = self.centre_mm + self.radius_mm * normal - lamp
        # the disc faces the arm's centre
        facing = normalised(np.asarray(self._arm.centre_mm) - lamp)
        slope = mirrored @ facing
        with np.errstate(divide="ignore", invalid="ignore"):
            meets = from_lamp - ((from_lamp @ facing) / slope)[..., None] * mirrored
        inside = np.linalg.norm(meets, axis=-1) < self._rig["lamp_disc"]["radius_mm"]
        shows: NDArray[np.bool_] = hit & (slope < 0) & inside
        return shows


def chrome_ambient(rig: dict[str, Any], radius_mm: float, source: str | Path) -> VirtualAmbientBall:
    """The ball of `VirtualChrome`, in the same place, mirrors the room; raises `InputError` as that does."""
    ball = VirtualChrome(rig, radius_mm, source)
    return VirtualAmbientBall(rig, ball.name, ball.centre_mm, ball.radius_mm, lambda _: (0.0, REFLECTANCE))


def highlight_normal(centre: Float, radius: float, lamp: Float) -> Float:
    """Normal (3,) of the point of a ball at which the camera sees the lamp mirrored."""
    normal = normalised(normalised(lamp - centre) + normalised(-centre))
    # each step shrinks the error by about the ratio of the ball's radius to the distances
    for _ in range(50):
        point = centre + radius * normal
        normal = normalised(normalised(lamp - point) + normalised(-point))
    return normal


def _pixel_shares(places: Float, pixels: int) -> Float:
    """Share (pixels, places) of a point's light that each pixel along one side of the image receives."""
    edges = np.arange(pixels + 1)[:, None] - 0.5
    shares: Float = np.diff(special.ndtr((edges - places) / BLUR_PX), axis=0)
    return shares
