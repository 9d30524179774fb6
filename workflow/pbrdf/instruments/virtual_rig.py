"""A rig that computes what its camera would see.

A pinhole camera at the origin looks along z at the subject; a small lamp turns about the vertical
axis through the subject's centre, at angle 0 between camera and subject. The x axes of generator and
analyser are vertical. Perspective, the lamp's finite distance, imperfect retarders, shot noise, read
noise, the converter's steps and saturation are all there.
"""

from __future__ import annotations

import hashlib
import json
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from pbrdf._kernels import render
from pbrdf.instruments.interface import FrameFormat, Setting
from pbrdf.instruments.virtual_geometry import virtual_polarimeter

RENDERER_VERSION = 1
"""To be raised with every change that makes other frames of the same truth: old and new must not mix."""

PARTS_OF_SUBJECTS = ("spheres", "lamp_disc")
"""Keys of a rig's file that say something of single subjects: these tell it themselves."""


class Subject(Protocol):
    """What stands between lamp and camera."""

    @property
    def name(self) -> str:
        """Name; the noise of its frames depends on it."""

    @property
    def truth(self) -> Any:
        """All that its images depend on besides the rig, as JSON holds it."""

    def mueller_image(self, angle_deg: float, band_nm: int) -> NDArray[np.float32]:
        """Mueller image of the light path between the modules' frames (rows, columns, 16), 1/(sr m²)."""


class VirtualRig:
    """A virtual rig holding one subject (`pbrdf.instruments.interface.Rig`).

    Parameters
    ----------
    rig : dict
        The rig's file, checked against its schema.
    subject : Subject
    """

    def __init__(self, rig: dict[str, Any], subject: Subject) -> None:
        self._rig = rig
        self._subject = subject

    @cached_property
    def identity(self) -> str:
        """``virtual``, the version of its renderer and a digest of the truth it renders."""
        rig = {name: value for name, value in self._rig.items() if name not in PARTS_OF_SUBJECTS}
        truth = json.dumps([rig, self._subject.name, self._subject.truth], sort_keys=True)
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
        """Frame (rows, columns) uint16; its noise depends on seed, subject and `frame_id` alone."""
        polarimeter = virtual_polarimeter(self._rig, setting.band_nm)
        weights = polarimeter.measurement_matrix(np.deg2rad([setting.state_deg]))[0]
        electrons = self._rig["lamp_electrons_per_s"][str(setting.band_nm)] * setting.exposure_s
        image = self._subject.mueller_image(setting.light.angle_deg, setting.band_nm)
        return self._frame(image, weights, electrons, frame_id)

    def expose_dark(self, frame_id: str, exposure_s: float) -> NDArray[Any]:
        """Frame (rows, columns) uint16 with the lamp covered."""
        camera = self._rig["camera"]
        nothing = np.zeros((camera["rows"], camera["columns"], 16), np.float32)
        return self._frame(nothing, np.zeros(16), 0.0, frame_id)

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
        name = f"{self._rig['seed']}/{self._subject.name}/{frame_id}"
        key = int.from_bytes(hashlib.blake2b(name.encode(), digest_size=8).digest(), "little")
        frame = np.empty(image.shape[:2], np.uint16)
        render.expose(image, weights, electrons, sensor, key, frame)
        return frame
