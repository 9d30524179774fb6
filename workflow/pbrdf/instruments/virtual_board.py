"""A chessboard in front of a virtual rig's camera, in a pose of its own in every view."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf.instruments.virtual_view import Float, seen_by_pixels, unpolarised
from pbrdf.instruments.virtual_words import drawn
from pbrdf.optics.arm import turned
from pbrdf.optics.frames import normalised

WHITE, BLACK, BACKDROP = 0.36, 0.012, 0.02
"""Radiance of the board's squares and of what is behind it, in the unit that the lamp's power counts."""

RIM = 0.5
"""Width of the white rim around the squares, in squares: finders want one."""

MARGIN = 0.01
"""Share of the frame that stays free along each side."""

LEAST_TILT_DEG, MOST_TILT_DEG, MOST_ROLL_DEG = 30.0, 45.0, 10.0

CORNERS = np.array([(-1, -1), (1, 1), (1, -1), (-1, 1)])
"""Corners of the frame toward which boards are moved, in turn; columns, rows."""

GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))
"""Steps of it go around evenly, however many there are."""

SAMPLES = 8

_STEPS = 50
"""Of the search for the board's place; each halves what is left."""


class VirtualBoard:
    """A chessboard under ambient light (`pbrdf.instruments.virtual_rig.Subject`).

    The board's plane is tilted out of the line of sight's normal by `LEAST_TILT_DEG` to `MOST_TILT_DEG`
    toward a side that goes around with the views. Lying and standing in turn, it is as near as the frame
    allows and moved into a corner of the frame, so that a few views show corners nearly everywhere. The
    rig's seed and the view choose.

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
        tilt, side, roll = drawn(f"{self._rig['seed']}/{self.name}", 3)
        azimuth = GOLDEN_ANGLE * view + 0.5 * side
        about = (np.cos(azimuth), np.sin(azimuth), 0.0)
        tilt_deg = LEAST_TILT_DEG + tilt * (MOST_TILT_DEG - LEAST_TILT_DEG)
        roll_deg = MOST_ROLL_DEG * (2 * roll - 1) + 90.0 * (view % 2)
        orientation = np.stack(
            [turned(turned(axis, (0, 0, 1), roll_deg), about, tilt_deg) for axis in np.eye(3)], -1
        )
        half = (self._squares / 2 + RIM) * self._square_mm
        rim = np.append(CORNERS * half, np.zeros((4, 1)), axis=1)
        # lying and standing boards visit each corner
        corner = CORNERS[(view - 1) // 2 % len(CORNERS)]
        turn, middle = _fitted(rim @ orientation.T, self._rig["camera"], corner)
        rotation: Float = turn @ orientation
        first = (1.0 - self._squares / 2) * self._square_mm
        origin: Float = middle + rotation[:, :2] @ first
        return rotation, origin


def _fitted(rim: Float, camera: Mapping[str, Any], corner: NDArray[Any]) -> tuple[Float, Float]:
    """Turn (3, 3) from the line of sight to the camera, and middle (3,), of a board as near as may be.

    The board's `rim` (4, 3) is given along its line of sight. Its box in the image lies in a `corner` of
    the frame less `MARGIN`.
    """
    focal, principal = camera["focal_px"], np.array(camera["principal_px"])
    size = np.array([camera["columns"], camera["rows"]])
    first, last = MARGIN * size - 0.5, (1.0 - MARGIN) * size - 0.5
    place = (first + last) / 2
    for _ in range(_STEPS):
        sight = np.append((place - principal) / focal, 1.0)
        turn = _toward(sight)
        points = rim @ turn.T
        # each corner of the rim is seen (focal * aside) / (depth + its own) beside the board's middle
        aside = points[:, :2] - points[:, 2:] * sight[:2]
        room = np.where(aside > 0, last - place, place - first)
        middle = sight * (focal * np.abs(aside) / room - points[:, 2:]).max()
        shown = focal * (points + middle)[:, :2] / (points + middle)[:, 2:] + principal
        wanted = np.where(corner > 0, last - shown.max(axis=0), first - shown.min(axis=0))
        place = np.clip(place + wanted / 2, first + size / 4, last - size / 4)
    return turn, middle


def _toward(sight: Float) -> Float:
    """Rotation (3, 3) that takes the camera's z to a line of sight."""
    z = normalised(sight)
    x = normalised(np.cross((0.0, 1.0, 0.0), z))
    return np.stack([x, np.cross(z, x), z], -1)
