"""A stand-in for a GenICam camera and its library, which fails as cameras do."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pbrdf.errors import InstrumentError
from pbrdf.instruments.aravis_camera import AravisCamera
from pbrdf.instruments.genicam import SUCCESS, Delivery, GenicamError
from pbrdf.instruments.interface import FrameFormat
from pbrdf.instruments.kinds import Identity

FORMAT = FrameFormat(6, 8, "uint16", 14, 2, 65532.0)
PIXELS = (np.arange(48, dtype="<u2") * 1000 & 0xFFFC).tobytes()
SETTINGS = {
    "ExposureAuto": "Continuous",
    "GainAuto": "Continuous",
    "BlackLevelAuto": "Continuous",
    "SharpnessAuto": "Continuous",
    "AcquisitionFrameRateEnabled": True,
    "GammaEnabled": True,
    "Gamma": 1.25,
    "SharpnessEnabled": True,
    "pgrDefectPixelCorrectionEnable": True,
    "Gain": 12.5,
    "BlackLevel": 1.5,
    "ExposureTime": 5000.0,
    "PixelFormat": "Mono8",
    "OffsetX": 40,
    "OffsetY": 20,
    "Width": 3376,
    "Height": 2704,
    "TriggerMode": "Off",
    "TriggerSource": "Line0",
    "AcquisitionMode": "SingleFrame",
    "TriggerSoftware": None,
    "AcquisitionStop": None,
}
SENSOR = {"OffsetX": ("Width", 3376), "OffsetY": ("Height", 2704)}


class StandIn:
    """A camera and its library; `deliveries` replaces what triggers make, `refuses` what it takes."""

    def __init__(self, **settings: Any) -> None:
        self.settings = SETTINGS | settings
        self.identity = Identity("GS3-U3-91S6M", "14450123", "2.28.3")
        self.lost = False
        self.closed = 0
        self.started: bool | None = None
        self.written: list[tuple[str, Any]] = []
        self.refuses: dict[str, str] = {}
        self.reads_as: dict[str, Any] = {}
        self.waiting: list[Delivery] = []
        self.triggered: list[list[Delivery | None]] | None = None
        self.number = 7
        self.lost_after_takes: int | None = None
        self.waited_s = 0.0

    def has(self, feature: str) -> bool:
        return feature in self.settings

    def entries(self, feature: str) -> tuple[str, ...]:
        return {"TriggerSelector": ("AcquisitionStart", "FrameStart"), "ChunkSelector": ("ExposureTime",)}[
            feature
        ]

    def bounds(self, feature: str) -> tuple[float, float]:
        assert feature == "ExposureTime"
        return 10.0, 31.9e6

    def read(self, feature: str, kind: type) -> Any:
        value = self.reads_as.get(feature, self.settings[feature])
        if feature in self.refuses and self.refuses[feature].startswith("read"):
            raise GenicamError(self.refuses[feature])
        assert type(value) is kind, feature
        return value

    def write(self, feature: str, value: Any) -> None:
        assert not self.closed
        if feature in self.refuses:
            raise GenicamError(self.refuses[feature])
        if feature in SENSOR:
            size, largest = SENSOR[feature]
            assert value + self.settings.get(size, 0) <= largest
        self.settings[feature] = value
        self.written.append((feature, value))

    def execute(self, command: str) -> None:
        if command in self.refuses:
            raise GenicamError(self.refuses[command])
        if command == "TriggerSoftware":
            self.number += 1
            self.waiting += self._made()

    def _made(self) -> list[Delivery]:
        if self.triggered is not None:
            return self.triggered.pop(0)
        return [self.delivery(self.number)]

    def delivery(self, number: int, **other: Any) -> Delivery:
        whole = Delivery(SUCCESS, number, 6, 8, 0x01100007, PIXELS)
        return replace(whole, **other)

    def start(self, exposure_chunk: bool) -> None:
        self.started = exposure_chunk

    def take(self, timeout_s: float) -> Delivery | None:
        if self.waiting:
            return self.waiting.pop(0)
        self.waited_s += timeout_s
        if self.lost_after_takes is not None:
            self.lost_after_takes -= 1
            self.lost = self.lost_after_takes <= 0
        return None

    def close(self) -> None:
        self.closed += 1


def opened(port: StandIn, **settings: Any) -> AravisCamera:
    return AravisCamera.open(
        "here", "camera", connect=lambda *_: port, **({"frame_format": FORMAT} | settings)
    )


def refused_open(port: StandIn, **settings: Any) -> InstrumentError:
    with pytest.raises(InstrumentError) as refused:
        opened(port, **settings)
    assert "\n" not in str(refused.value)
    assert refused.value.source == "camera at here"
    assert port.closed
    return refused.value
