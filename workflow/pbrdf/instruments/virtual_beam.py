"""An optical element in the beam of a virtual rig, with the lamp shining straight into the camera."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf.errors import InputError
from pbrdf.instruments.virtual_geometry import UP, virtual_arm
from pbrdf.optics.elements import IDEAL
from pbrdf.optics.frames import angle_between, change_frames, normalised, transverse

STRAIGHT_DEG = 180.0
"""Angle of the arm at which lamp, element and camera stand in a line."""

HORIZONTAL = (1.0, 0.0, 0.0)
"""X axis, in the camera's frame, that the elements' matrices are told for."""


class VirtualBeam:
    """An element between lamp and camera (`pbrdf.instruments.virtual_rig.Subject`).

    The camera sees the lamp's own disc through the element, and darkness around it.

    Parameters
    ----------
    rig : dict
        The rig's file, checked against its schema.
    element : {"air", "LPH", "LPV", "CPL", "CPR"}
        Nothing, a linear polariser whose axis is the camera's x or y, a left or right circular
        polariser; all ideal.
    source : str or Path
        The rig's file, for messages.

    Raises
    ------
    InputError
        If there is no such element, or the rig does not say how its lamp looks.
    """

    def __init__(self, rig: dict[str, Any], element: str, source: str | Path) -> None:
        if element not in IDEAL:
            raise InputError(source, "element", f"is {element!r}", f"use {', '.join(IDEAL)}")
        if "lamp_disc" not in rig:
            raise InputError(source, "lamp_disc", "is missing", "give radius and radiance of the lamp's disc")
        self.name = f"beam {element}"
        self._rig = rig
        self._element = element
        self._source = source

    @property
    def truth(self) -> dict[str, Any]:
        """Name of the element, and the lamp's disc."""
        return {"element": self._element, "lamp_disc": self._rig["lamp_disc"]}

    def mueller_image(self, angle_deg: float, band_nm: int) -> NDArray[np.float32]:
        """Mueller image of the light path (rows, columns, 16), radiance times the element's matrix.

        Raises
        ------
        InputError
            If the arm does not stand at 180°.
        """
        if angle_deg != STRAIGHT_DEG:
            raise InputError(
                self._source,
                "angle_deg",
                f"is {angle_deg:g}° with {self._element} in the beam",
                f"turn the arm to {STRAIGHT_DEG:g}°",
            )
        arm = virtual_arm(self._rig)
        lamp = arm.light_position(STRAIGHT_DEG)
        mueller = element_mueller(self._element, arm.generator_x(STRAIGHT_DEG), UP, -lamp)
        coverage = _lamp_coverage(self._rig, lamp)
        seen = self._rig["lamp_disc"]["radiance"] * mueller.ravel()
        image: NDArray[np.float32] = (coverage[..., None] * seen).astype(np.float32)
        return image


def element_mueller(
    element: str, x_in: ArrayLike, x_out: ArrayLike, propagation: ArrayLike
) -> NDArray[np.float64]:
    """Mueller matrix (4, 4) of an element between a generator's and an analyser's frame.

    Parameters
    ----------
    element : str
        One of `pbrdf.optics.elements.IDEAL`.
    x_in, x_out : array_like, shape (3,)
        X axes of the two frames, camera's frame.
    propagation : array_like, shape (3,)
        Direction of the beam, camera's frame, of any length.
    """
    along = normalised(propagation)
    own = transverse(HORIZONTAL, along)
    angle_in = angle_between(own, transverse(x_in, along), along)
    angle_out = angle_between(own, transverse(x_out, along), along)
    return change_frames(IDEAL[element], angle_in, angle_out)


def _lamp_coverage(rig: dict[str, Any], lamp: NDArray[np.float64]) -> NDArray[np.float64]:
    """Share of each pixel (rows, columns) that the lamp's disc covers, linear across its edge."""
    camera = rig["camera"]
    focal, (cx, cy) = camera["focal_px"], camera["principal_px"]
    x, y, depth = lamp
    radius = focal * rig["lamp_disc"]["radius_mm"] / depth
    row, column = np.ogrid[: camera["rows"], : camera["columns"]]
    distance = np.hypot(column - (cx + focal * x / depth), row - (cy + focal * y / depth))
    coverage: NDArray[np.float64] = np.clip(radius - distance + 0.5, 0.0, 1.0)
    return coverage
