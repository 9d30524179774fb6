"""A rig without instruments: its frames come straight from what renders them."""

from __future__ import annotations

from typing import Any, Protocol

from numpy.typing import NDArray

from pbrdf.instruments.interface import FrameFormat, Setting, Taken


class Renderer(Protocol):
    """What a camera would see."""

    @property
    def identity(self) -> str:
        """In a word; frames of different identity are never mixed."""

    @property
    def frame_format(self) -> FrameFormat:
        """Format of every frame."""

    def expose(self, frame_id: str, setting: Setting) -> NDArray[Any]:
        """Frame (rows, columns) with every instrument as the setting says."""

    def expose_dark(self, frame_id: str, exposure_s: float) -> NDArray[Any]:
        """Frame (rows, columns) with the lamp covered."""


class RenderedRig:
    """A renderer in place of a rig (`pbrdf.instruments.interface.Rig`)."""

    def __init__(self, renderer: Renderer) -> None:
        self._renderer = renderer

    @property
    def identity(self) -> str:
        """That of the renderer."""
        return self._renderer.identity

    @property
    def frame_format(self) -> FrameFormat:
        """That of the renderer."""
        return self._renderer.frame_format

    def expose(self, frame_id: str, setting: Setting) -> Taken:
        """Take a frame."""
        return Taken(self._renderer.expose(frame_id, setting), {})

    def expose_dark(self, frame_id: str, exposure_s: float) -> Taken:
        """Take a frame with the lamp covered."""
        return Taken(self._renderer.expose_dark(frame_id, exposure_s), {})
