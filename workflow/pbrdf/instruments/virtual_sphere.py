"""The sphere of a material in a virtual rig."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.instruments.virtual_ambient import VirtualAmbientBall
from pbrdf.instruments.virtual_geometry import virtual_arm
from pbrdf.instruments.virtual_optics import optics_of
from pbrdf.instruments.virtual_surface import LitSphere


class VirtualSphere:
    """The sphere of one material on a virtual rig's turntable (`pbrdf.instruments.virtual_rig.Subject`).

    Parameters
    ----------
    rig : dict
        The rig's file, checked against its schema.
    material : str
        Name of one of its spheres.
    radius_mm : float
        Radius of the sphere.
    source : str or Path
        The rig's file, for messages.

    Raises
    ------
    InputError
        If the rig has no sphere of that name, or what it is made of cannot be read.
    """

    def __init__(self, rig: dict[str, Any], material: str, radius_mm: float, source: str | Path) -> None:
        if material not in rig["spheres"]:
            raise InputError(
                source,
                "spheres",
                f"has none called `{material}`",
                f"add it, or use {', '.join(rig['spheres'])}",
            )
        self.name = material
        self._rig = rig
        self.optics = optics_of(rig["spheres"][material], source, f"spheres.{material}")
        self._radius_mm = radius_mm
        self._arm = virtual_arm(rig)
        self.centre_mm = np.array([0.0, 0.0, rig["distance_mm"]])

    @property
    def truth(self) -> dict[str, Any]:
        """Name, optics and radius of the sphere."""
        return {"material": self.name, "sphere": self.optics.truth, "radius_mm": self._radius_mm}

    def mueller_image(self, angle_deg: float, band_nm: int) -> NDArray[np.float32]:
        """Mueller image of the light path (rows, columns, 16), times cos(θi)/d², 1/(sr m²)."""
        scene = LitSphere(
            self.centre_mm,
            self._radius_mm,
            self._arm.light_position(angle_deg),
            self._arm.generator_x(angle_deg),
        )
        return self.optics.mueller_image(self._rig, scene, band_nm)


def ambient_sphere(
    rig: dict[str, Any], material: str, radius_mm: float, source: str | Path
) -> VirtualAmbientBall:
    """The sphere of `VirtualSphere`, in its place, under ambient light; raises `InputError` as that does."""
    sphere = VirtualSphere(rig, material, radius_mm, source)
    return VirtualAmbientBall(rig, sphere.name, sphere.centre_mm, radius_mm, sphere.optics.reflectance)
