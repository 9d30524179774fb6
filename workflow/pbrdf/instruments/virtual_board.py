"""A chessboard in front of a virtual rig's camera, in a pose of its own in every view."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf.instruments.virtual_view import Float, seen_by_pixels, unpolarised
from pbrdf.instruments.virtual_words import drawn
from pbrdf.optics.arm import turned

WHITE, BLACK, BACKDROP = 0.36, 0.012, 0.02
"""Radiance of the board's squares and of what is behind it, in the unit that the lamp's power counts."""

RIM = 0.5
"""Width of the white rim around the squares, in squares: finders want one."""

FILLED = 0.95
"""Share of the frame, along its narrower side, that a board with its rim spans."""

LEAST_TILT_DEG, MOST_TILT_DEG, MOST_ROLL_DEG = 30.0, 50.0, 15.0

GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))
"""Steps of it go around evenly, however many there are."""

SAMPLES = 8


class VirtualBoard:
    """A chessboard under ambient light (`pbrdf.instruments.virtual_rig.Subject`).

    The board's plane is tilted by `LEAST_TILT_DEG` to `MOST_TILT_DEG` toward a side that goes around
    with the views, turned in itself, and as near as the frame allows. The rig's seed and the view choose.

    Parameters
    ----------
    rig : dict
        The rig's file, checked against its schema.
    board : mapping
        The config's `session.board`: inner corners along and down, side of a square.
    view : int
        From 1 on.
    """

    def __init__(self, rig: dict[str, Any], board: Mapping[str, Any], view: int) -> None:
        self.name = f"board {view}"
        self._rig = rig
        self._squares = np.array(board["corners"], dtype=np.float64) + 1.0
        self._square_mm = float(board["square_mm"])
        self.rotation, self.origin_mm = self._pose(view)

    @property
    def truth(self) -> dict[str, Any]:
        """Board and pose: rotation and place of its first inner corner in the camera's frame."""
        return {
            "squares": self._squares.tolist(),
            "square_mm": self._square_mm,
            "rotation": np.round(self.rotation, 12).tolist(),
            "origin_mm": np.round(self.origin_mm, 9).tolist(),
            "radiances": [WHITE, BLACK, BACKDROP],
        }

    def mueller_image(self, angle_deg: float, band_nm: int) -> NDArray[np.float32]:
        """Mueller image (rows, columns, 16) of the board; neither angle nor band matters."""
        return unpolarised(seen_by_pixels(self._rig, self._radiance, SAMPLES))

    def _radiance(self, rays: Float) -> Float:
        """Radiance along rays: where each meets the board's plane, and the square it meets there."""
        normal = self.rotation[:, 2]
        meets = rays * ((normal @ self.origin_mm) / (rays @ normal))[..., None]
        # in squares from the corner of the first one
        x, y = ((meets - self.origin_mm) @ self.rotation[:, axis] / self._square_mm + 1.0 for axis in (0, 1))
        across, down = self._squares
        squares = (x > 0) & (x < across) & (y > 0) & (y < down)
        rim = (x > -RIM) & (x < across + RIM) & (y > -RIM) & (y < down + RIM)
        odd = (np.floor(x) + np.floor(y)) % 2 == 0
        return np.where(squares & odd, BLACK, np.where(rim, WHITE, BACKDROP))

    def _pose(self, view: int) -> tuple[Float, Float]:
        """Rotation (3, 3) whose columns are the board's axes, and its first inner corner (3,), mm."""
        camera = self._rig["camera"]
        tilt, side, roll, right, down = drawn(f"{self._rig['seed']}/{self.name}", 5)
        azimuth = GOLDEN_ANGLE * view + 0.5 * side
        tilt_deg = LEAST_TILT_DEG + tilt * (MOST_TILT_DEG - LEAST_TILT_DEG)
        flat = np.stack([turned(axis, (0, 0, 1), MOST_ROLL_DEG * (2 * roll - 1)) for axis in np.eye(3)[:2]])
        about = (np.cos(azimuth), np.sin(azimuth), 0.0)
        along, across = (turned(axis, about, tilt_deg) for axis in flat)
        rotation = np.stack([along, across, np.cross(along, across)], -1)
        # corners of the rim from the board's middle
        half = (self._squares / 2 + RIM) * self._square_mm
        signs = np.array([(-1, -1), (-1, 1), (1, -1), (1, 1)])
        rim = (signs * half) @ rotation[:, :2].T
        size = np.array([camera["columns"], camera["rows"]])
        middle = _fitted(rim, camera, size, np.array([right, down]))
        first = (1.0 - self._squares / 2) * self._square_mm
        origin: Float = middle + rotation[:, :2] @ first
        return rotation, origin


def _fitted(rim: Float, camera: Mapping[str, Any], size: Float, place: Float) -> Float:
    """Middle (3,) of a board whose rim (4, 3) spans `FILLED` of the frame; `place` shares the slack."""
    focal, principal = camera["focal_px"], np.array(camera["principal_px"])
    middle = np.array([0.0, 0.0, focal * np.ptp(rim[:, :2]) / (FILLED * size.min())])
    for _ in range(50):
        points = rim + middle
        shown = focal * points[:, :2] / points[:, 2:] + principal
        first, span = shown.min(axis=0), np.ptp(shown, axis=0)
        # a quarter of the slack stays free on each side
        wanted = (size - span) * (0.25 + 0.5 * place) - 0.5
        middle[:2] += (wanted - first) * middle[2] / focal
        middle *= (span / (FILLED * size)).max()
    return middle
