"""The kinds of instruments that a rig has, one class a kind."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from pbrdf.instruments.closing import Closing
from pbrdf.instruments.interface import FrameFormat
from pbrdf.instruments.movement import Movement


@dataclass(frozen=True)
class Identity:
    """What an instrument says it is; empty where it does not say."""

    model: str
    serial: str
    firmware: str


class Instrument(Closing):
    """Anything with a port; a context that closes it, which may also be done twice.

    Attributes
    ----------
    name : str
        What it is in the rig, and its port: ``generator retarder at /dev/ttyUSB0``.
    identity : Identity
        Read when it was opened.
    """

    name: str
    identity: Identity


class Rotator(Instrument):
    """Something that turns to an angle: a rotary stage, or the table that carries the arm."""

    @abstractmethod
    def home(self) -> Movement:
        """Begin to look for the zero."""

    @abstractmethod
    def move_to(self, angle_deg: float) -> Movement:
        """Begin to turn, in the end from lower angles; raises `InstrumentError` beyond its range."""

    @abstractmethod
    def position_deg(self) -> float:
        """Where it stands, as read back."""

    @abstractmethod
    def stop(self) -> None:
        """Stop now."""


class FilterWheel(Instrument):
    """A wheel with numbered slots, the first being 1."""

    @property
    @abstractmethod
    def slots(self) -> int:
        """How many there are."""

    @abstractmethod
    def home(self) -> Movement:
        """Begin to look for the first slot."""

    @abstractmethod
    def select(self, slot: int) -> Movement:
        """Begin to turn to a slot; raises `InstrumentError` for one beyond the wheel."""

    @abstractmethod
    def slot(self) -> int:
        """Which is in the beam, as read back."""


@dataclass(frozen=True)
class Exposure:
    """A frame, and what the camera says of it.

    Attributes
    ----------
    frame : ndarray, shape (rows, columns)
    exposure_s : float
        As read back.
    temperature_c : float or None
        Of the sensor, where the camera tells it.
    number : int
        The camera's own count of frames.
    """

    frame: NDArray[Any]
    exposure_s: float
    temperature_c: float | None
    number: int


class Camera(Instrument):
    """A camera that is told when to expose, all its automatics off."""

    @property
    @abstractmethod
    def frame_format(self) -> FrameFormat:
        """Format of every frame."""

    @property
    @abstractmethod
    def exposure_range_s(self) -> tuple[float, float]:
        """Shortest and longest exposure."""

    @abstractmethod
    def expose(self, exposure_s: float) -> Exposure:
        """Take one frame.

        Raises
        ------
        InstrumentError
            If none comes in time, it is short, stale or of another size, or the exposure was another.
        """
