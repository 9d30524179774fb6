"""A rig that computes what its camera would see.

A pinhole camera at the origin looks along z at the subject; a small lamp turns about the vertical
axis through the subject's centre, at angle 0 between camera and subject. The x axes of generator and
analyser are vertical. Perspective, the lamp's finite distance and drift, imperfect retarders,
vignetting, hot pixels, shot noise, read noise, the converter's steps and saturation are all there.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from functools import cached_property, lru_cache
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from pbrdf._kernels import render
from pbrdf.instruments.interface import FrameFormat, Setting
from pbrdf.instruments.virtual_geometry import virtual_flat, virtual_polarimeter
from pbrdf.instruments.virtual_words import random_word

RENDERER_VERSION = 3
"""To be raised with every change that makes other frames of the same truth: old and new must not mix."""

NO_TRUTH = ("spheres", "lamp_disc", "instruments", "dark", "faults")
"""Keys of a rig's file on which frames do not depend, or only those of subjects, which tell it themselves."""


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
        self._flat = virtual_flat(rig)
        self._dark_electrons_per_s = _dark_current(rig)
        self._received_once = lru_cache(maxsize=1)(self._received)

    @cached_property
    def identity(self) -> str:
        """``virtual``, the version of its renderer and a digest of the truth it renders."""
        rig = {name: value for name, value in self._rig.items() if name not in NO_TRUTH}
        truth = json.dumps([rig, self._subject.name, self._subject.truth], sort_keys=True)
        return f"virtual rig {RENDERER_VERSION}, truth {hashlib.sha256(truth.encode()).hexdigest()[:16]}"

    @cached_property
    def frame_format(self) -> FrameFormat:
        """Format of every frame."""
        return replace(FrameFormat.of_camera(self._rig["camera"]), dtype="uint16")

    def expose(self, frame_id: str, setting: Setting) -> NDArray[Any]:
        """Frame (rows, columns) uint16; its noise depends on seed, subject and `frame_id` alone."""
        polarimeter = virtual_polarimeter(self._rig, setting.band_nm)
        weights = polarimeter.measurement_matrix(np.deg2rad([setting.state_deg]))[0]
        lamp = self._rig["lamp_electrons_per_s"][str(setting.band_nm)] * lamp_power(self._rig, setting)
        image = self._received_once(setting.light.angle_deg, setting.band_nm)
        return self._frame(image, weights, lamp, setting.exposure_s, frame_id)

    def expose_dark(self, frame_id: str, exposure_s: float) -> NDArray[Any]:
        """Frame (rows, columns) uint16 with the lamp covered."""
        camera = self._rig["camera"]
        nothing = np.zeros((camera["rows"], camera["columns"], 16), np.float32)
        return self._frame(nothing, np.zeros(16), 0.0, exposure_s, frame_id)

    def _received(self, angle_deg: float, band_nm: int) -> NDArray[np.float32]:
        return self._subject.mueller_image(angle_deg, band_nm) * self._flat[..., None]

    def _frame(
        self,
        image: NDArray[np.float32],
        weights: NDArray[np.float64],
        electrons_per_s: float,
        exposure_s: float,
        frame_id: str,
    ) -> NDArray[np.uint16]:
        camera = self._rig["camera"]
        sensor = render.Sensor(
            camera["electrons_per_dn"],
            camera["read_noise_electrons"],
            camera["offset_dn"],
            camera["adc_bits"],
            camera["shift"],
        )
        key = random_word(f"{self._rig['seed']}/{self._subject.name}/{frame_id}")
        dark = self._dark_electrons_per_s * np.float32(exposure_s)
        frame = np.empty(image.shape[:2], np.uint16)
        render.expose(image, weights, electrons_per_s * exposure_s, dark, sensor, key, frame)
        return frame


def lamp_power(rig: dict[str, Any], setting: Setting) -> float:
    """Relative power of a virtual rig's lamp when a state is taken: one on average over its period.

    Parameters
    ----------
    rig : dict
        The rig's file, checked against its schema.
    setting : Setting
        Its light, band and position tell the power; the phase also depends on the seed.
    """
    if "lamp_drift" not in rig:
        return 1.0
    drift = rig["lamp_drift"]
    start = random_word(f"{rig['seed']}/lamp/{setting.light.id}/{setting.band_nm}") / 2.0**64
    turns = setting.position / drift["period_states"] + start
    return float(1.0 + drift["amplitude"] * np.sin(2 * np.pi * turns))


def _dark_current(rig: dict[str, Any]) -> NDArray[np.float32]:
    """Electrons that each pixel (rows, columns) makes in a second without light."""
    camera = rig["camera"]
    size = (camera["rows"], camera["columns"])
    if "hot_pixels" not in rig:
        return np.zeros(size, np.float32)
    hot = rig["hot_pixels"]
    # NumPy promises the raw words of a generator for ever, not the numbers it makes of them
    words = np.random.Philox(key=random_word(f"{rig['seed']}/hot pixels")).random_raw(size[0] * size[1])
    drawn = (words >> np.uint64(11)) * 2.0**-53
    current: NDArray[np.float32] = np.where(drawn < hot["share"], hot["electrons_per_s"], 0.0).astype(
        np.float32
    )
    return current.reshape(size)
