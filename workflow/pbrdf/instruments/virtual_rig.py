"""A rig that computes what its camera would see.

A pinhole camera at the origin looks along z at a sphere; a small lamp turns about the vertical axis
through the sphere's centre, at angle 0 between camera and sphere. The x axes of generator and
analyser are vertical. Perspective, the lamp's finite distance, imperfect retarders, shot noise, read
noise, the converter's steps and saturation are all there.
"""

from __future__ import annotations

import hashlib
import json
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf._kernels import render
from pbrdf.errors import InputError
from pbrdf.instruments.interface import FrameFormat, Setting
from pbrdf.instruments.virtual_geometry import UP, virtual_arm, virtual_polarimeter

RENDERER_VERSION = 1
"""To be raised with every change that makes other frames of the same truth: old and new must not mix."""


class VirtualRig:
    """A virtual rig holding the sphere of one material.

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
        self._rig = rig
        self._material = material
        self._radius_mm = radius_mm
        self._arm = virtual_arm(rig)
        self._mueller_image = lru_cache(maxsize=1)(self._render)

    @cached_property
    def identity(self) -> str:
        """``virtual``, the version of its renderer and a digest of the truth it renders."""
        rig = {**self._rig, "spheres": self._rig["spheres"][self._material]}
        truth = json.dumps([rig, self._material, self._radius_mm], sort_keys=True)
        return f"virtual rig {RENDERER_VERSION}, truth {hashlib.sha256(truth.encode()).hexdigest()[:16]}"

    @cached_property
    def frame_format(self) -> FrameFormat:
        """Format of every frame."""
        camera = self._rig["camera"]
        highest = ((1 << camera["adc_bits"]) - 1) << camera["shift"]
        return FrameFormat(
            camera["rows"], camera["columns"], "uint16", camera["adc_bits"], camera["shift"], float(highest)
        )

    def expose(self, frame_id: str, setting: Setting) -> NDArray[Any]:
        """Frame (rows, columns) uint16; its noise depends on seed, material and `frame_id` alone."""
        polarimeter = virtual_polarimeter(self._rig, setting.band_nm)
        weights = polarimeter.measurement_matrix(np.deg2rad([setting.state_deg]))[0]
        electrons = self._rig["lamp_electrons_per_s"][str(setting.band_nm)] * setting.exposure_s
        image = self._mueller_image(setting.light.angle_deg, setting.band_nm)
        return self._frame(image, weights, electrons, frame_id)

    def expose_dark(self, frame_id: str, exposure_s: float) -> NDArray[Any]:
        """Frame (rows, columns) uint16 with the lamp covered."""
        camera = self._rig["camera"]
        nothing = np.zeros((camera["rows"], camera["columns"], 16), np.float32)
        return self._frame(nothing, np.zeros(16), 0.0, frame_id)

    def _render(self, angle_deg: float, band_nm: int) -> NDArray[np.float32]:
        camera = self._rig["camera"]
        sphere = self._rig["spheres"][self._material]
        optics = sphere["bands"][str(band_nm)]
        scene = render.SphereScene(
            centre=np.array([0.0, 0.0, self._rig["distance_mm"]]),
            radius=self._radius_mm,
            light=self._arm.light_position(angle_deg),
            generator_axis=self._arm.generator_x(angle_deg),
            analyser_axis=np.array(UP),
        )
        focal, (cx, cy) = camera["focal_px"], camera["principal_px"]
        material = (
            sphere["roughness"],
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

    def _frame(
        self, image: NDArray[np.float32], weights: NDArray[np.float64], electrons: float, frame_id: str
    ) -> NDArray[np.uint16]:
        camera = self._rig["camera"]
        sensor = render.Sensor(
            camera["electrons_per_dn"],
            camera["read_noise_electrons"],
            camera["offset_dn"],
            camera["adc_bits"],
            camera["shift"],
        )
        name = f"{self._rig['seed']}/{self._material}/{frame_id}"
        key = int.from_bytes(hashlib.blake2b(name.encode(), digest_size=8).digest(), "little")
        frame = np.empty(image.shape[:2], np.uint16)
        render.expose(image, weights, electrons, sensor, key, frame)
        return frame
