"""A camera by Aravis, set so that its frames count photons: nothing automatic, nothing corrected."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf.errors import InstrumentError
from pbrdf.instruments import aravis_port
from pbrdf.instruments.genicam import SUCCESS, Delivery, GenicamError, GenicamPort
from pbrdf.instruments.genicam_settings import (
    PIXEL_FORMATS,
    configure,
    first_known,
    lacking,
    mark_exposures,
)
from pbrdf.instruments.interface import FrameFormat
from pbrdf.instruments.kinds import Camera, Exposure, Identity

LARGEST_DEVIATION = 0.01
"""Of an exposure from the one asked for."""

SLICE_S = 0.1
"""Longest wait between two looks whether the camera is still there."""

WAITING = 8
"""Frames that are dropped at most before a trigger."""

RUN_AGAIN = "see its cable and power, and run again: what is taken is kept"
EASE_THE_BUS = (
    "see its cable and what else uses that bus, for USB set usbcore.usbfs_memory_mb to 1000, and run again"
)

EXPOSURE_TIME = ("ExposureTime", "ExposureTimeAbs")
TEMPERATURE = ("DeviceTemperature", "TemperatureAbs")


class AravisCamera(Camera):
    """A GenICam camera triggered by software; `open` makes it.

    After an error that leaves its state unknown all that the library made is destroyed; `open` again then.

    Parameters
    ----------
    port : GenicamPort
        An open camera, set as it should be, that awaits triggers.
    name : str
        What it is in the rig, and its address.
    frame_format : FrameFormat
    reply_timeout_s : float
        Longest wait for a frame after its exposure.
    """

    def __init__(
        self, port: GenicamPort, name: str, frame_format: FrameFormat, reply_timeout_s: float
    ) -> None:
        self._port: GenicamPort | None = port
        self.name, self._format = name, frame_format
        self._reply_timeout_s = reply_timeout_s
        self.identity = port.identity
        exposure = first_known(port, EXPOSURE_TIME)
        if exposure is None:
            raise lacking(name, EXPOSURE_TIME)
        self._exposure_feature = exposure
        low_us, high_us = port.bounds(exposure)
        self._range_s = (low_us / 1e6, high_us / 1e6)
        self._temperature_feature = first_known(port, TEMPERATURE)
        self._asked_s: float | None = None
        self._last_number: int | None = None

    @classmethod
    def open(
        cls,
        address: str,
        name: str,
        *,
        frame_format: FrameFormat,
        corner_px: tuple[int, int] = (0, 0),
        model: str = "",
        serial: str = "",
        black_level: float | None = None,
        reply_timeout_s: float = 5.0,
        connect: Callable[[str, str], GenicamPort] = aravis_port.connect,
    ) -> AravisCamera:
        """Open a camera, set all that bears on its frames, and read it back.

        Parameters
        ----------
        address : str
            See `pbrdf.instruments.aravis_port.connect`.
        name : str
            What it is in the rig.
        frame_format : FrameFormat
            Rows, columns and word of its frames: uint16 is Mono16, uint8 is Mono8.
        corner_px : (int, int)
            Sensor column and row of the first pixel: with rows and columns the region of interest.
        model, serial : str
            What it must say it is; empty for anything.
        black_level : float, optional
            In the camera's unit; by default it stays where it is.
        reply_timeout_s : float
            Longest wait for a frame after its exposure.
        connect : callable
            Opens the port from its address and, for messages, the instrument's name.

        Raises
        ------
        InstrumentError
            If there is no such camera, it is another than it should be, lacks a feature that is needed, or
            does not take a setting.
        """
        instrument = f"{name} at {address}"
        port = connect(address, instrument)
        try:
            _require_identity(port.identity, instrument, model, serial)
            configure(port, instrument, frame_format, corner_px, black_level)
            camera = cls(port, instrument, frame_format, reply_timeout_s)
            port.start(exposure_chunk=mark_exposures(port, instrument))
        except GenicamError as error:
            port.close()
            raise _silent(instrument, error) from None
        except BaseException:
            port.close()
            raise
        return camera

    @property
    def frame_format(self) -> FrameFormat:
        """Format of every frame."""
        return self._format

    @property
    def exposure_range_s(self) -> tuple[float, float]:
        """Shortest and longest exposure."""
        return self._range_s

    def close(self) -> None:
        """Let go of the camera; may be called twice."""
        if self._port is not None:
            self._port.close()
        self._port = None

    def expose(self, exposure_s: float) -> Exposure:
        """Take one frame; see `Camera.expose`."""
        port = self._port
        if port is None:
            raise InstrumentError(self.name, "camera", "is closed", "open it again")
        low_s, high_s = self._range_s
        if not low_s <= exposure_s <= high_s:
            raise InstrumentError(
                self.name, "exposure", f"is {exposure_s:g} s", f"stay within {low_s:g}…{high_s:g} s"
            )
        try:
            return self._exposed(port, exposure_s)
        except GenicamError as error:
            self.close()
            raise _silent(self.name, error) from None
        except BaseException:
            self.close()
            raise

    def _exposed(self, port: GenicamPort, exposure_s: float) -> Exposure:
        if exposure_s != self._asked_s:
            port.write(self._exposure_feature, 1e6 * exposure_s)
            self._asked_s = exposure_s
        found_s = port.read(self._exposure_feature, float) / 1e6
        self._require_exposure(self._exposure_feature, found_s, exposure_s)
        self._drop_waiting(port)
        port.execute("TriggerSoftware")
        delivery = self._delivered(port, found_s + self._reply_timeout_s)
        frame = self._frame(delivery)
        if delivery.exposure_us is not None:
            found_s = delivery.exposure_us / 1e6
            self._require_exposure("ChunkExposureTime", found_s, exposure_s)
        temperature = self._temperature_feature
        temperature_c = None if temperature is None else port.read(temperature, float)
        return Exposure(frame, found_s, temperature_c, delivery.number)

    def _require_exposure(self, feature: str, found_s: float, asked_s: float) -> None:
        if not abs(found_s - asked_s) <= LARGEST_DEVIATION * asked_s:
            raise InstrumentError(
                self.name,
                feature,
                f"reads {found_s:g} s where {asked_s:g} s were asked for",
                "plan exposures that the camera can take",
            )

    def _drop_waiting(self, port: GenicamPort) -> None:
        """Forget frames that came before the trigger."""
        for _ in range(WAITING):
            waiting = port.take(0.0)
            if waiting is None:
                return
            if self._advances(waiting.number):
                self._last_number = waiting.number

    def _delivered(self, port: GenicamPort, timeout_s: float) -> Delivery:
        """The frame that the trigger made; frames of before are dropped."""
        stale, left_s = 0, timeout_s
        while left_s > 0.0:
            wait_s = min(SLICE_S, left_s)
            delivery = port.take(wait_s)
            # Counted whether or not it was waited out, so that a stream of old frames ends too.
            left_s -= wait_s
            if delivery is not None and self._advances(delivery.number):
                self._last_number = delivery.number
                return delivery
            stale += delivery is not None
            if port.lost:
                raise InstrumentError(self.name, "control", "was lost", RUN_AGAIN)
        after = f" after {stale} stale ones" if stale else ""
        raise InstrumentError(self.name, "frame", f"has not come within {timeout_s:g} s{after}", RUN_AGAIN)

    def _advances(self, number: int) -> bool:
        """Whether a frame is later than the last; GigE Vision counts to 65535, then from 1."""
        if self._last_number is None:
            return True
        ahead = number - self._last_number
        wraps = max(number, self._last_number) < 1 << 16
        return 0 < ahead % (1 << 16) < 1 << 15 if wraps else ahead > 0

    def _frame(self, delivery: Delivery) -> NDArray[Any]:
        """Pixels of a whole frame; raises `InstrumentError` for any other."""
        form = self._format
        _, code = PIXEL_FORMATS[form.dtype]
        word = np.dtype(form.dtype).newbyteorder("<")
        size = form.rows * form.columns
        problem = None
        if delivery.status != SUCCESS:
            problem = f"{delivery.number} did not arrive whole ({delivery.status})"
        elif (delivery.rows, delivery.columns) != (form.rows, form.columns):
            problem = f"{delivery.number} has {delivery.rows} × {delivery.columns} pixels"
        elif delivery.pixel_format != code:
            problem = f"{delivery.number} has the pixel format {delivery.pixel_format:#010x}"
        elif len(delivery.pixels) < size * word.itemsize:
            problem = f"{delivery.number} is short: {len(delivery.pixels)} of {size * word.itemsize} bytes"
        if problem is not None:
            raise InstrumentError(self.name, "frame", problem, EASE_THE_BUS)
        frame = np.frombuffer(delivery.pixels, word, size).reshape(form.rows, form.columns)
        stray = int(np.bitwise_or.reduce(frame, axis=None)) & ((1 << form.shift) - 1)
        if stray:
            raise InstrumentError(
                self.name,
                "frame",
                f"{delivery.number} has bits set below the left shift of {form.shift}",
                "correct `adc_bits` and `shift` in the rig file",
            )
        return frame.astype(form.dtype, copy=False)


def _require_identity(found: Identity, instrument: str, model: str, serial: str) -> None:
    for field, wanted, is_ in (("model", model, found.model), ("serial", serial, found.serial)):
        if wanted and is_ != wanted:
            raise InstrumentError(
                instrument,
                field,
                f"is {is_!r}, not {wanted!r}",
                "connect that camera, or correct the rig file",
            )


def _silent(instrument: str, error: GenicamError) -> InstrumentError:
    return InstrumentError(instrument, "control", f"fails ({error})", RUN_AGAIN)
