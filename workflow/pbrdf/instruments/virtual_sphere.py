"""The sphere of a material in a virtual rig, as a kernel renders it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf._kernels import render
from pbrdf.errors import InputError
from pbrdf.instruments.virtual_ambient import VirtualAmbientBall
from pbrdf.instruments.virtual_geometry import UP, virtual_arm


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
        If the rig has no sphere of that name.
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
        self._sphere = rig["spheres"][material]
        self._radius_mm = radius_mm
        self._arm = virtual_arm(rig)
        self.centre_mm = np.array([0.0, 0.0, rig["distance_mm"]])

    @property
    def truth(self) -> dict[str, Any]:
        """Name, optics and radius of the sphere."""
        return {"material": self.name, "sphere": self._sphere, "radius_mm": self._radius_mm}

    def mueller_image(self, angle_deg: float, band_nm: int) -> NDArray[np.float32]:
        """Mueller image of the light path (rows, columns, 16), times cos(θi)/d², 1/(sr m²)."""
        camera, optics = self._rig["camera"], self._sphere["bands"][str(band_nm)]
        scene = render.SphereScene(
            centre=self.centre_mm,
            radius=self._radius_mm,
            light=self._arm.light_position(angle_deg),
            generator_axis=self._arm.generator_x(angle_deg),
            analyser_axis=np.array(UP),
        )
        focal, (cx, cy) = camera["focal_px"], camera["principal_px"]
        material = (
            self._sphere["roughness"],
            optics["index"],
            optics.get("extinction", 0.0),
            optics["specular"],
            optics["albedo"],
        )
        pinhole = render.Pinhole(focal, focal, cx, cy)
        image: NDArray[np.float32] = render.render_mueller(
            pinhole, scene, material, camera["rows"], camera["columns"], self._rig["samples"]
        )
        return image


def ambient_sphere(
    rig: dict[str, Any], material: str, radius_mm: float, source: str | Path
) -> VirtualAmbientBall:
    """The sphere of `VirtualSphere`, in its place, under ambient light; raises `InputError` as that does.

    Its surface scatters its albedo and mirrors what Fresnel's equations give at normal incidence.
    """
    sphere = VirtualSphere(rig, material, radius_mm, source)
    bands = rig["spheres"][material]["bands"]

    def reflectance(band_nm: int) -> tuple[float, float]:
        optics = bands[str(band_nm)]
        index, square = optics["index"], optics.get("extinction", 0.0) ** 2
        return optics["albedo"], ((index - 1) ** 2 + square) / ((index + 1) ** 2 + square)

    return VirtualAmbientBall(rig, sphere.name, sphere.centre_mm, radius_mm, reflectance)
