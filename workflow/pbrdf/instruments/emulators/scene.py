"""What stands before an emulated camera, told by where the emulated instruments really stand."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Protocol

from numpy.typing import NDArray

from pbrdf.instruments.interface import FrameFormat, Setting
from pbrdf.settings.plan import Light
from pbrdf.settings.targets import AMBIENT


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


@dataclass(frozen=True)
class Stand:
    """Where the optics are, from the emulators' side.

    Attributes
    ----------
    generator_deg, analyser_deg, arm_deg : callable
        Angles, degrees.
    slot : callable
        Slot of the wheel in the beam; None while it turns.
    bands_nm : mapping
        Band by slot; no light comes through others.
    """

    generator_deg: Callable[[], float]
    analyser_deg: Callable[[], float]
    arm_deg: Callable[[], float]
    slot: Callable[[], int | None]
    bands_nm: Mapping[int, int]


class Scene:
    """Renders what the instruments' positions imply.

    Parameters
    ----------
    renderer : Renderer
    stand : Stand
    """

    def __init__(self, renderer: Renderer, stand: Stand) -> None:
        self.renderer = renderer
        self._stand = stand
        self._frame_id = ""
        self._setting: Setting | None = None

    def announce(self, frame_id: str, setting: Setting | None) -> None:
        """Name the next frame; without a setting the lamp is to be covered.

        This is the back door by which the rig tells what no instrument can see: noise follows from the name
        alone, and the lamp's drift from the frame's place in the run.
        """
        self._frame_id, self._setting = frame_id, setting

    def frame(self, exposure_s: float) -> NDArray[Any]:
        """Frame (rows, columns) of an exposure that is made now."""
        slot = self._stand.slot()
        band_nm = None if slot is None else self._stand.bands_nm.get(slot)
        if self._setting is None or band_nm is None:
            return self.renderer.expose_dark(self._frame_id, exposure_s)
        light = self._setting.light
        if light != AMBIENT:
            light = Light(light.id, self._stand.arm_deg())
        generator_polariser, _, _, analyser_polariser = self._setting.state_deg
        state = (
            generator_polariser,
            self._stand.generator_deg(),
            self._stand.analyser_deg(),
            analyser_polariser,
        )
        seen = replace(self._setting, light=light, band_nm=band_nm, state_deg=state, exposure_s=exposure_s)
        return self.renderer.expose(self._frame_id, seen)
