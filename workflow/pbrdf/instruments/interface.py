"""What a capture asks of whatever takes its photographs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from numpy.typing import NDArray

from pbrdf.settings.plan import Light, State


@dataclass(frozen=True)
class FrameFormat:
    """Size and word of the camera's frames (`pbrdf.formats.capture_store.FramesHeader`)."""

    rows: int
    columns: int
    dtype: str
    adc_bits: int
    shift: int
    saturation: float

    @classmethod
    def of_camera(cls, camera: Mapping[str, Any]) -> FrameFormat:
        """That of a rig file's `camera`: words of 8 or 16 bits, saturated at the converter's highest."""
        bits, shift = camera["adc_bits"], camera["shift"]
        dtype = "uint8" if bits + shift <= 8 else "uint16"
        return cls(camera["rows"], camera["columns"], dtype, bits, shift, float(((1 << bits) - 1) << shift))


@dataclass(frozen=True)
class Setting:
    """How every instrument stands for one frame.

    Attributes
    ----------
    light : Light
    band_nm : int
    state_deg : State
    exposure_s : float
    position : int
        How many states, repeats included, were taken before in this light and band: lamps drift.
    """

    light: Light
    band_nm: int
    state_deg: State
    exposure_s: float
    position: int


@dataclass(frozen=True)
class Taken:
    """A frame, and what the instruments read back for it.

    Attributes
    ----------
    frame : ndarray, shape (rows, columns)
    details : dict
        For the journal, as JSON holds it, with units in the names: ``exposure_read_s``, ``temperature_c``.
    """

    frame: NDArray[Any]
    details: dict[str, Any]


class Rig(Protocol):
    """A camera, a lamp on an arm, a filter wheel and two retarders, or what stands for them."""

    @property
    def identity(self) -> str:
        """What takes the frames, in a word; frames of different identity are never mixed."""

    @property
    def frame_format(self) -> FrameFormat:
        """Format of every frame."""

    def expose(self, frame_id: str, setting: Setting) -> Taken:
        """Take a frame once every instrument stands as the setting says."""

    def expose_dark(self, frame_id: str, exposure_s: float) -> Taken:
        """Take a frame with the lamp covered."""
