"""A camera behind the Aravis library, by PyGObject, which are needed only where such a camera is."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

from pbrdf.errors import InstrumentError
from pbrdf.instruments.genicam import SUCCESS, Delivery, GenicamError, Value
from pbrdf.instruments.kinds import Identity

BUFFERS = 4
"""Frames that may wait; more than one only after something went wrong."""

ETHERNET_PACKET_BYTES = 1500
ETHERNET_SOCKET_BYTES = 4 << 20
ETHERNET_RETENTION_US = 2_000_000
"""How long after a packet the rest of its frame may come; on a busy computer Aravis' 0.1 s are too short."""


def connect(address: str, instrument: str) -> AravisPort:
    """Open a camera.

    Parameters
    ----------
    address : str
        What Aravis knows it by: ``Point Grey Research-14450123``, or the IP address of an Ethernet camera.
    instrument : str
        Its name and address, for messages.

    Raises
    ------
    InstrumentError
        If PyGObject or Aravis is not installed, no camera answers there, or another program has it.
    """
    aravis, failure = _library(instrument)
    try:
        camera = aravis.Camera.new(address)
    except failure as error:
        found = ", ".join(_addresses(aravis)) or "none"
        raise InstrumentError(
            instrument,
            "address",
            f"cannot be opened ({_words(error)}); Aravis finds {found}",
            "see its cable and power, that no other program has it, that this user may use it (udev rules of "
            "Aravis), and name its address in the rig file",
        ) from None
    if camera.is_gv_device() and not camera.get_device().is_controller():
        raise InstrumentError(instrument, "address", "is in use by another program", "end that program")
    return AravisPort(aravis, failure, camera)


def addresses(instrument: str = "camera") -> tuple[str, ...]:
    """Addresses of all cameras that Aravis finds; raises `InstrumentError` if it is not installed."""
    aravis, _ = _library(instrument)
    return _addresses(aravis)


class AravisPort:
    """An open camera (`pbrdf.instruments.genicam.GenicamPort`); `connect` makes it.

    Parameters
    ----------
    aravis : module
        Aravis by introspection.
    failure : type
        What its calls raise.
    camera : Aravis.Camera
    """

    def __init__(self, aravis: Any, failure: type[Exception], camera: Any) -> None:
        self._aravis, self._failure = aravis, failure
        self._camera = camera
        self._device = camera.get_device()
        # Otherwise Aravis passes on a width beyond the sensor, and not every camera refuses it.
        self._device.set_range_check_policy(aravis.RangeCheckPolicy.ENABLE)
        self._stream: Any = None
        self._parser: Any = None
        self._lost = False
        self._handler = self._device.connect("control-lost", self._note_loss)

    def _note_loss(self, _device: Any) -> None:
        self._lost = True

    @property
    def lost(self) -> bool:
        """Whether Aravis has told that the camera is gone."""
        return self._lost

    @property
    def identity(self) -> Identity:
        """Model, serial number and firmware."""
        with self._calls():
            firmware = next(f for f in ("DeviceFirmwareVersion", "DeviceVersion", "") if not f or self.has(f))
            return Identity(
                self._camera.get_model_name(),
                self._camera.get_device_serial_number(),
                self.read(firmware, str) if firmware else "",
            )

    def has(self, feature: str) -> bool:
        """Whether the feature exists and may be used now."""
        with self._calls():
            return bool(self._device.is_feature_available(feature))

    def entries(self, feature: str) -> tuple[str, ...]:
        """Values that an enumeration can take now."""
        with self._calls():
            return tuple(self._device.dup_available_enumeration_feature_values_as_strings(feature))

    def bounds(self, feature: str) -> tuple[float, float]:
        """Least and greatest value of a float feature."""
        with self._calls():
            low, high = self._device.get_float_feature_bounds(feature)
            return low, high

    def read(self, feature: str, kind: type[Value]) -> Value:
        """Value of a feature."""
        with self._calls():
            return kind(getattr(self._device, f"get_{_WORDS[kind]}_feature_value")(feature))

    def write(self, feature: str, value: str | bool | int | float) -> None:
        """Set a feature."""
        with self._calls():
            getattr(self._device, f"set_{_WORDS[type(value)]}_feature_value")(feature, value)

    def execute(self, command: str) -> None:
        """Give a command."""
        with self._calls():
            self._device.execute_command(command)

    def start(self, exposure_chunk: bool) -> None:
        """Make room for frames as large as they are now, and await triggers."""
        with self._calls():
            if self._camera.is_gv_device():
                self._stream = self._ethernet_stream()
            else:
                self._stream = self._camera.create_stream(None, None)
            payload = self._camera.get_payload()
            for _ in range(BUFFERS):
                self._stream.push_buffer(self._aravis.Buffer.new_allocate(payload))
            self._parser = self._camera.create_chunk_parser() if exposure_chunk else None
            self._camera.start_acquisition()

    def _ethernet_stream(self) -> Any:
        """A stream that works without the right to open packet sockets, as user and root alike."""
        self._camera.gv_set_stream_options(self._aravis.GvStreamOption.PACKET_SOCKET_DISABLED)
        self._camera.gv_set_packet_size_adjustment(self._aravis.GvPacketSizeAdjustment.NEVER)
        self._camera.gv_set_packet_size(ETHERNET_PACKET_BYTES)
        stream = self._camera.create_stream(None, None)
        # The system's default of 208 KiB loses packets of every frame.
        stream.set_property("socket-buffer", self._aravis.GvStreamSocketBuffer.FIXED)
        stream.set_property("socket-buffer-size", ETHERNET_SOCKET_BYTES)
        stream.set_property("frame-retention", ETHERNET_RETENTION_US)
        return stream

    def take(self, timeout_s: float) -> Delivery | None:
        """The next frame; None if there is none by then."""
        stream = self._stream
        buffer = stream.timeout_pop_buffer(round(1e6 * timeout_s)) if timeout_s else stream.try_pop_buffer()
        if buffer is None:
            return None
        with self._calls():
            try:
                return self._delivery(buffer)
            finally:
                stream.push_buffer(buffer)

    def _delivery(self, buffer: Any) -> Delivery:
        status, number = buffer.get_status().value_nick, buffer.get_frame_id()
        if status != SUCCESS:
            return Delivery(status, number)
        exposure_us = None
        if self._parser is not None:
            exposure_us = float(self._parser.get_float_value(buffer, "ChunkExposureTime"))
        return Delivery(
            status,
            number,
            buffer.get_image_height(),
            buffer.get_image_width(),
            buffer.get_image_pixel_format(),
            buffer.get_data(),
            exposure_us,
        )

    def close(self) -> None:
        """Stop, and destroy all that Aravis made; may be called twice."""
        if self._device is None:
            return
        self._device.disconnect(self._handler)
        if not self._lost and self._stream is not None:
            # A camera that no longer hears this is destroyed all the same.
            with contextlib.suppress(self._failure):
                self._camera.stop_acquisition()
        self._stream = self._parser = self._device = self._camera = None

    @contextlib.contextmanager
    def _calls(self) -> Iterator[None]:
        """Calls of the library, whose failures become `GenicamError`."""
        if self._device is None:
            raise GenicamError("it is closed")
        try:
            yield
        except self._failure as error:
            raise GenicamError(_words(error)) from None


_WORDS = {str: "string", bool: "boolean", int: "integer", float: "float"}


def _library(instrument: str) -> tuple[Any, type[Exception]]:
    """Aravis and what its calls raise."""
    try:
        import gi

        gi.require_version("Aravis", "0.8")
        from gi.repository import Aravis, GLib
    except ImportError as error:
        raise InstrumentError(
            instrument,
            "PyGObject",
            f"cannot be imported ({error})",
            "do `apt-get install python3-gi gir1.2-aravis-0.8`, then "
            "`ln -s /usr/lib/python3/dist-packages/gi` into the environment's site-packages",
        ) from None
    except ValueError as error:
        raise InstrumentError(
            instrument, "Aravis", f"is missing ({error})", "do `apt-get install gir1.2-aravis-0.8`"
        ) from None
    failure: type[Exception] = GLib.Error
    return Aravis, failure


def _addresses(aravis: Any) -> tuple[str, ...]:
    aravis.update_device_list()
    return tuple(aravis.get_device_id(index) for index in range(aravis.get_n_devices()))


def _words(error: Exception) -> str:
    """What went wrong, without GLib's own numbers."""
    return str(getattr(error, "message", error))
