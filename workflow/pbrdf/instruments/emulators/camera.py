"""A camera with the GenICam features of a Grasshopper3, whose pixels are rendered."""

from __future__ import annotations

from typing import TypeVar

from pbrdf.instruments.clock import Clock
from pbrdf.instruments.emulators.faults import Faults
from pbrdf.instruments.emulators.scene import Scene
from pbrdf.instruments.genicam import SUCCESS, Delivery, GenicamError
from pbrdf.instruments.kinds import Identity

Value = TypeVar("Value", bound=str | bool | int | float)
Plain = str | bool | int | float

MONO16 = 0x01100007
EXPOSURE_US = (20.0, 3.2e7)

ENTRIES = {
    "PixelFormat": ("Mono8", "Mono16"),
    "ExposureAuto": ("Off", "Once", "Continuous"),
    "GainAuto": ("Off", "Once", "Continuous"),
    "ExposureMode": ("Timed", "TriggerWidth"),
    "AcquisitionMode": ("Continuous", "SingleFrame"),
    "TriggerSelector": ("FrameStart",),
    "TriggerSource": ("Line0", "Software"),
    "TriggerMode": ("Off", "On"),
    "ChunkSelector": ("ExposureTime", "FrameCounter"),
}

FACTORY: dict[str, Plain] = {
    "PixelFormat": "Mono8",
    "ExposureAuto": "Continuous",
    "GainAuto": "Continuous",
    "ExposureMode": "Timed",
    "AcquisitionMode": "Continuous",
    "TriggerSelector": "FrameStart",
    "TriggerSource": "Line0",
    "TriggerMode": "Off",
    "ChunkSelector": "FrameCounter",
    "ChunkModeActive": False,
    "ChunkEnable": False,
    "GammaEnabled": True,
    "SharpnessEnabled": True,
    "pgrDefectPixelCorrectionEnable": True,
    "AcquisitionFrameRateEnabled": True,
    "Gain": 6.0,
    "BlackLevel": 0.0,
    "ExposureTime": 5000.0,
    "DeviceTemperature": 38.5,
    "OffsetX": 0,
    "OffsetY": 0,
    "Width": 0,
    "Height": 0,
}
"""As the camera comes: everything automatic is on."""


class EmulatedCamera:
    """A camera at the driver's end of its library (`pbrdf.instruments.genicam.GenicamPort`).

    Faults:

    - ``timeout``: no frame follows a trigger.
    - ``short-frame``: half of the pixels are missing.
    - ``incomplete``: the library says that packets are missing.
    - ``stale-frame``: the frame of before comes once more, then nothing.
    - ``wrong-size``: one row fewer than set.
    - ``wrong-exposure``: the exposure reads back as `value` times what was set.
    - ``control-lost``: the camera is gone, for ever.

    Parameters
    ----------
    scene : Scene
    clock : Clock
    faults : Faults
    """

    def __init__(self, scene: Scene, clock: Clock, faults: Faults) -> None:
        self._scene, self._clock, self._faults = scene, clock, faults
        form = scene.renderer.frame_format
        self._features = {**FACTORY, "Width": form.columns, "Height": form.rows}
        self._factor = 1.0
        self._number = 0
        self._waiting: Delivery | None = None
        self._lost = False

    @property
    def identity(self) -> Identity:
        """Of the paper's model; the serial number says that it is none."""
        return Identity("Grasshopper3 GS3-U3-91S6M", "0", "emulated")

    @property
    def lost(self) -> bool:
        """Whether the fault of that name has struck."""
        return self._lost

    def has(self, feature: str) -> bool:
        """Whether there is such a feature."""
        return feature in self._features or feature == "TriggerSoftware"

    def entries(self, feature: str) -> tuple[str, ...]:
        """Values of an enumeration."""
        return ENTRIES[feature]

    def bounds(self, feature: str) -> tuple[float, float]:
        """Range of the exposure time; of others, none."""
        return EXPOSURE_US if feature == "ExposureTime" else (float("-inf"), float("inf"))

    def read(self, feature: str, kind: type[Value]) -> Value:
        """Value of a feature."""
        self._answer()
        value = self._features[feature]
        if feature == "ExposureTime":
            value = float(value) * self._factor
        if not isinstance(value, kind):
            raise GenicamError(f"{feature} is not of type {kind.__name__}")
        return value

    def write(self, feature: str, value: Plain) -> None:
        """Set a feature."""
        self._answer()
        if feature in ENTRIES and value not in ENTRIES[feature]:
            raise GenicamError(f"{feature} has no entry {value}")
        self._features[feature] = value
        if feature == "ExposureTime":
            self._factor = self._faults.value("wrong-exposure", absent=1.0, struck=2.0)

    def execute(self, command: str) -> None:
        """Take a frame."""
        self._answer()
        exposure_us = float(self._features["ExposureTime"]) * self._factor
        self._clock.sleep(exposure_us / 1e6)
        if self._faults.strikes("timeout"):
            return
        frame = self._scene.frame(exposure_us / 1e6)
        rows = frame.shape[0] - self._faults.strikes("wrong-size")
        pixels = frame[:rows].astype("<u2", copy=False).tobytes()
        if self._faults.strikes("short-frame"):
            pixels = pixels[: len(pixels) // 2]
        status = "missing-packets" if self._faults.strikes("incomplete") else SUCCESS
        if not self._faults.strikes("stale-frame"):
            self._number += 1
        self._waiting = Delivery(status, self._number, rows, frame.shape[1], MONO16, pixels, exposure_us)

    def start(self, exposure_chunk: bool) -> None:
        """Await triggers."""
        self._answer()

    def take(self, timeout_s: float) -> Delivery | None:
        """The frame of the last trigger, once."""
        if self._faults.strikes("control-lost"):
            self._lost = True
        if self._lost:
            return None
        waiting, self._waiting = self._waiting, None
        if waiting is None:
            self._clock.sleep(timeout_s)
        return waiting

    def close(self) -> None:
        """End it."""
        self._waiting = None

    def _answer(self) -> None:
        if self._lost:
            raise GenicamError("no answer")
