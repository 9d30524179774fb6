"""Flat things in front of a virtual rig's camera: a bright field, and a white tile that the lamp lights."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf.instruments.virtual_geometry import virtual_arm
from pbrdf.instruments.virtual_view import rays_through, unpolarised

FIELD_RADIANCE = 1.0


class VirtualField:
    """An evenly bright field that fills the frame (`pbrdf.instruments.virtual_rig.Subject`)."""

    name = "bright field"

    def __init__(self, rig: dict[str, Any]) -> None:
        self._shape = (rig["camera"]["rows"], rig["camera"]["columns"])

    @property
    def truth(self) -> dict[str, Any]:
        """The field's radiance, in the unit that the lamp's power counts."""
        return {"field_radiance": FIELD_RADIANCE}

    def mueller_image(self, angle_deg: float, band_nm: int) -> NDArray[np.float32]:
        """Mueller image (rows, columns, 16) of unpolarised light; neither angle nor band matters."""
        return unpolarised(np.full(self._shape, FIELD_RADIANCE))


class VirtualTile:
    """A Lambertian tile at the arm's centre, facing the camera (`pbrdf.instruments.virtual_rig.Subject`).

    It fills the frame, and depolarises whatever the lamp sends: ``M00 = ρ/π``, all else zero.

    Parameters
    ----------
    rig : dict
        The rig's file, checked against its schema.
    reflectance : float
        ρ.
    """

    name = "white tile"

    def __init__(self, rig: dict[str, Any], reflectance: float) -> None:
        self._rig = rig
        self._reflectance = reflectance

    @property
    def truth(self) -> dict[str, Any]:
        """The tile's reflectance."""
        return {"tile_reflectance": self._reflectance}

    def mueller_image(self, angle_deg: float, band_nm: int) -> NDArray[np.float32]:
        """Mueller image (rows, columns, 16), ρ/π times cos(θi)/d² of each pixel, 1/(sr m²)."""
        camera = self._rig["camera"]
        rows, columns = np.arange(camera["rows"])[:, None], np.arange(camera["columns"])
        points = self._rig["distance_mm"] * rays_through(self._rig, columns, rows)
        to_light = 1e-3 * (virtual_arm(self._rig).light_position(angle_deg) - points)
        distance = np.linalg.norm(to_light, axis=-1)
        # the tile's normal is −z
        cosine = np.maximum(-to_light[..., 2] / distance, 0.0)
        return unpolarised(self._reflectance / np.pi * cosine / distance**2)
