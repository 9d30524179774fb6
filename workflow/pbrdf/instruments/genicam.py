"""A GenICam camera as its driver needs it, whatever library speaks to it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, TypeVar

from pbrdf.instruments.kinds import Identity

Value = TypeVar("Value", bound=str | bool | int | float)

SUCCESS = "success"
"""Status of a frame that arrived whole."""


class GenicamError(Exception):
    """A call that failed, in the library's words."""


@dataclass(frozen=True)
class Delivery:
    """What the library hands over for a frame; of a frame that failed only `status` and `number`.

    Attributes
    ----------
    status : str
        `SUCCESS`, or the library's word for what went wrong.
    number : int
        The camera's own count of frames.
    rows, columns : int
    pixel_format : int
        Code of the GenICam pixel format naming convention.
    pixels : bytes
        Little-endian words, row by row; chunk data may follow.
    exposure_us : float or None
        As the frame's own chunk tells it.
    """

    status: str
    number: int
    rows: int = 0
    columns: int = 0
    pixel_format: int = 0
    pixels: bytes = b""
    exposure_us: float | None = None


class GenicamPort(Protocol):
    """An open camera. Its calls raise `GenicamError`, `close` and `lost` excepted."""

    @property
    def identity(self) -> Identity:
        """Model, serial number and firmware."""

    @property
    def lost(self) -> bool:
        """Whether the library has told that the camera is gone."""

    def has(self, feature: str) -> bool:
        """Whether the feature exists and may be used now."""

    def entries(self, feature: str) -> tuple[str, ...]:
        """Values that an enumeration can take now."""

    def bounds(self, feature: str) -> tuple[float, float]:
        """Least and greatest value of a float feature."""

    def read(self, feature: str, kind: type[Value]) -> Value:
        """Value of a feature."""

    def write(self, feature: str, value: str | bool | int | float) -> None:
        """Set a feature."""

    def execute(self, command: str) -> None:
        """Give a command."""

    def start(self, exposure_chunk: bool) -> None:
        """Make room for frames as large as they are now, and await triggers."""

    def take(self, timeout_s: float) -> Delivery | None:
        """The next frame; None if there is none by then."""

    def close(self) -> None:
        """Stop, and destroy all that the library made; may be called twice."""
