"""A rig of instruments: moves what has to move, waits for all of it, and exposes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from types import TracebackType
from typing import Any

from pbrdf.errors import InputError, InstrumentError
from pbrdf.instruments.closing import Closing
from pbrdf.instruments.interface import FrameFormat, Setting, Taken
from pbrdf.instruments.kinds import Camera, Exposure, FilterWheel, Rotator
from pbrdf.instruments.movement import Movement
from pbrdf.instruments.switches import LightSwitch
from pbrdf.settings.plan import CapturePlan
from pbrdf.settings.targets import AMBIENT


@dataclass(frozen=True)
class Instruments:
    """What a rig is made of.

    Attributes
    ----------
    generator_retarder, analyser_retarder, arm : Rotator
    wheel : FilterWheel
    camera : Camera
    slots : mapping
        Slot of the wheel by band in nm.
    blank_slot : int or None
        Slot that lets no light through.
    switch : LightSwitch or None
        What covers the lamp where there is no such slot.
    """

    generator_retarder: Rotator
    analyser_retarder: Rotator
    arm: Rotator
    wheel: FilterWheel
    camera: Camera
    slots: Mapping[int, int]
    blank_slot: int | None
    switch: LightSwitch | None


class _Axis:
    """Something that is moved only when it is wanted elsewhere."""

    def __init__(
        self, reading: str, move: Callable[[Any], Movement], read: Callable[[], float | int]
    ) -> None:
        self._reading, self._move, self._read = reading, move, read
        self._stands_at: float | int | None = None
        self._coming: tuple[float | int, Movement] | None = None

    def begin(self, target: float | int) -> None:
        """Begin to move, if it stands elsewhere."""
        if target != self._stands_at:
            self._stands_at = None
            self._coming = (target, self._move(target))

    def settle(self, read_back: dict[str, Any]) -> None:
        """Wait for it, and note where it is."""
        if self._coming is None:
            return
        (target, movement), self._coming = self._coming, None
        movement.wait()
        read_back[self._reading] = round(self._read(), 5)
        self._stands_at = target


class InstrumentRig(Closing):
    """Instruments as one (`pbrdf.instruments.interface.Rig`); a context that stops and closes them.

    Polarisers stand still: a state's first and last angle are where they were mounted.

    Parameters
    ----------
    instruments : Instruments
        All open, with their zeros known.
    identity : str
        See `Rig.identity`.
    announce : callable, optional
        Told the name of each frame before it is taken, and its setting or None for a dark one: emulated
        cameras need it.

    Raises
    ------
    InstrumentError
        If there is no way to take dark frames.
    """

    def __init__(
        self,
        instruments: Instruments,
        identity: str,
        announce: Callable[[str, Setting | None], None] = lambda frame_id, setting: None,
    ) -> None:
        if instruments.blank_slot is None and instruments.switch is None:
            raise InstrumentError("rig", "dark", "cannot be made", "say how, by `dark` in the rig file")
        self.instruments = on = instruments
        self._identity = identity
        self._announce = announce
        self._arm = _Axis("arm_read_deg", on.arm.move_to, on.arm.position_deg)
        self._wheel = _Axis("slot_read", on.wheel.select, on.wheel.slot)
        retarders = (on.generator_retarder, on.analyser_retarder)
        self._generator, self._analyser = (
            _Axis(f"{name}_retarder_read_deg", retarder.move_to, retarder.position_deg)
            for name, retarder in zip(("generator", "analyser"), retarders, strict=True)
        )
        self._read_back: dict[str, Any] = {}
        self._homed = False

    @property
    def identity(self) -> str:
        """What takes the frames."""
        return self._identity

    @property
    def frame_format(self) -> FrameFormat:
        """Format of every frame."""
        return self.instruments.camera.frame_format

    def require(self, plan: CapturePlan) -> None:
        """Refuse a plan beyond the instruments, before anything moves; raises `InstrumentError`."""
        camera = self.instruments.camera
        low, high = camera.exposure_range_s
        metered = () if plan.metering is None else (plan.metering.shortest_s,)
        for exposure_s in (*metered, *plan.exposures_s):
            if not low <= exposure_s <= high:
                raise InstrumentError(
                    camera.name,
                    "exposure",
                    f"{1e3 * exposure_s:g} ms is not within {1e3 * low:g}…{1e3 * high:g} ms",
                    "plan exposures that it can take",
                )
        blank = () if self.instruments.blank_slot is None else (self.instruments.blank_slot,)
        for slot in (*(self.instruments.slots[nm] for nm in plan.bands_nm), *blank):
            if slot > self.instruments.wheel.slots:
                raise InstrumentError(
                    self.instruments.wheel.name,
                    "slot",
                    f"{slot} is beyond the wheel's {self.instruments.wheel.slots}",
                    "correct `slots` in the rig file",
                )

    def expose(self, frame_id: str, setting: Setting) -> Taken:
        """Take a frame once every instrument stands as the setting says."""
        self.home()
        self._cover(False)
        _, generator, analyser, _ = setting.state_deg
        # under ambient light the arm's place means nothing
        if setting.light != AMBIENT:
            self._arm.begin(setting.light.angle_deg)
        self._wheel.begin(self.instruments.slots[setting.band_nm])
        self._generator.begin(generator)
        self._analyser.begin(analyser)
        for axis in (self._arm, self._wheel, self._generator, self._analyser):
            axis.settle(self._read_back)
        self._announce(frame_id, setting)
        return self._taken(self.instruments.camera.expose(setting.exposure_s))

    def expose_dark(self, frame_id: str, exposure_s: float) -> Taken:
        """Take a frame with the blank slot in the beam, or the lamp covered."""
        self.home()
        if self.instruments.blank_slot is None:
            self._cover(True)
        else:
            self._wheel.begin(self.instruments.blank_slot)
            self._wheel.settle(self._read_back)
        self._announce(frame_id, None)
        return self._taken(self.instruments.camera.expose(exposure_s))

    def close(self) -> None:
        """Stop what moves, and let go of all ports."""
        on = self.instruments
        with ExitStack() as everything:
            for instrument in (on.camera, on.wheel, on.arm, on.analyser_retarder, on.generator_retarder):
                everything.callback(instrument.close)
            if on.switch is not None:
                everything.callback(on.switch.close)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is not None:
            self._stop()
        self.close()

    def _stop(self) -> None:
        """Stop every axis; one that does not answer keeps no other from it."""
        for axis in (
            self.instruments.arm,
            self.instruments.analyser_retarder,
            self.instruments.generator_retarder,
        ):
            try:
                axis.stop()
            except (InputError, OSError) as failure:
                print(f"{axis.name}: could not be stopped: {failure}", flush=True)

    def home(self) -> None:
        """Let every axis find its zero, once; the first frame does it at the latest."""
        if self._homed:
            return
        on = self.instruments
        axes = (on.arm, on.wheel, on.generator_retarder, on.analyser_retarder)
        for movement in [axis.home() for axis in axes]:
            movement.wait()
        self._homed = True

    def _cover(self, covered: bool) -> None:
        if self.instruments.switch is not None:
            self.instruments.switch.turn(not covered)

    def _taken(self, exposure: Exposure) -> Taken:
        details: dict[str, Any] = {"exposure_read_s": exposure.exposure_s, "camera_frame": exposure.number}
        if exposure.temperature_c is not None:
            details["temperature_c"] = exposure.temperature_c
        return Taken(exposure.frame, {**self._read_back, **details})
