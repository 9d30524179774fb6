"""The instruments of a rig's file, opened by their drivers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from pbrdf.errors import InputError
from pbrdf.instruments.aravis_camera import AravisCamera
from pbrdf.instruments.clock import Clock, WallClock
from pbrdf.instruments.grbl import Drive, GrblTable
from pbrdf.instruments.iconasys import IconasysTable, PulseDrive
from pbrdf.instruments.instrument_rig import InstrumentRig, Instruments
from pbrdf.instruments.interface import FrameFormat
from pbrdf.instruments.k10cr1 import K10CR1
from pbrdf.instruments.kinds import Camera, FilterWheel, Rotator
from pbrdf.instruments.manual import ManualTable, Operator
from pbrdf.instruments.optec_ifw import OptecIFW
from pbrdf.instruments.switches import LightSwitch, OperatorSwitch, RelaySwitch


@contextmanager
def open_real(rig: Mapping[str, Any], source: str | Path) -> Iterator[InstrumentRig]:
    """Open the instruments that a rig's file names, and let go of them in the end.

    Parameters
    ----------
    rig : mapping
        The file's content, checked against its schema.
    source : str or Path
        That file, for messages.

    Raises
    ------
    InputError
        If the file names no instruments, or no slot for a band.
    InstrumentError
        If one cannot be opened, or is another than the file says. Nothing has moved then.
    """
    if "instruments" not in rig:
        raise InputError(
            source, "instruments", "is missing", "name each driver and its port, as config/README.md tells"
        )
    named = rig["instruments"]
    clock, operator = WallClock(), Operator()
    logs = Path(named["wire_log"]) if "wire_log" in named else None
    if logs is not None:
        logs.mkdir(parents=True, exist_ok=True)

    with ExitStack() as opened:
        generator, analyser = (
            opened.enter_context(
                K10CR1.open(
                    named[name]["port"],
                    name.replace("_", " "),
                    clock,
                    serial_number=named[name].get("serial"),
                    log=_log(logs, name),
                )
            )
            for name in ("generator_retarder", "analyser_retarder")
        )
        wheel = opened.enter_context(_open_wheel(named["filter_wheel"], clock, logs))
        arm = opened.enter_context(_open_arm(rig, source, clock, operator, logs))
        camera = opened.enter_context(_open_camera(rig))
        instruments = Instruments(
            generator,
            analyser,
            arm,
            wheel,
            camera,
            _slots(rig, source),
            named["filter_wheel"].get("blank_slot") if rig["dark"] == "blank-slot" else None,
            _open_switch(rig, source, operator),
        )
        identity = f"{camera.identity.model} {camera.identity.serial}".strip()
        with InstrumentRig(instruments, f"real rig, {identity}") as whole:
            # the rig closes them from here on
            opened.pop_all()
            yield whole


def frame_format(rig: Mapping[str, Any]) -> FrameFormat:
    """Format of the frames of a rig's camera."""
    camera = rig["camera"]
    bits, shift = camera["adc_bits"], camera["shift"]
    dtype = "uint8" if bits + shift <= 8 else "uint16"
    return FrameFormat(
        camera["rows"], camera["columns"], dtype, bits, shift, float(((1 << bits) - 1) << shift)
    )


def _open_wheel(named: Mapping[str, Any], clock: Clock, logs: Path | None) -> FilterWheel:
    return OptecIFW.open(
        named["port"],
        "filter wheel",
        clock,
        serial_number=named.get("serial"),
        log=_log(logs, "filter_wheel"),
    )


def _open_arm(
    rig: Mapping[str, Any], source: str | Path, clock: Clock, operator: Operator, logs: Path | None
) -> Rotator:
    named = rig["instruments"]["arm"]
    if "arm" not in rig:
        raise InputError(source, "arm", "is missing", "say its radius and where it hits nothing")
    limits = tuple(rig["arm"]["limits_deg"])
    if named["driver"] == "manual":
        return ManualTable("arm", clock, operator, limits_deg=limits)
    for field in ("port", "steps_per_deg"):
        if field not in named:
            raise InputError(source, f"instruments.arm.{field}", "is missing", "add it")
    speed = (named["steps_per_deg"], named["speed_deg_s"], named["acceleration_deg_s2"], limits)
    if named["driver"] == "iconasys-ftdi":
        pulses = PulseDrive(*speed, home_deg=named["home_deg"])
        return IconasysTable.open(named["port"], "arm", clock, drive=pulses, operator=operator)
    drive = Drive(*speed, home_deg=named["home_deg"], has_switch=named["has_switch"])
    return GrblTable.open(
        named["port"],
        "arm",
        clock,
        drive=drive,
        operator=operator,
        serial_number=named.get("serial"),
        log=_log(logs, "arm"),
    )


def _open_camera(rig: Mapping[str, Any]) -> Camera:
    named = rig["instruments"]["camera"]
    column, row = named.get("corner_px", (0, 0))
    return AravisCamera.open(
        named["address"],
        "camera",
        frame_format=frame_format(rig),
        corner_px=(column, row),
        model=named.get("model", ""),
        serial=named.get("serial", ""),
        black_level=named.get("black_level"),
    )


def _open_switch(rig: Mapping[str, Any], source: str | Path, operator: Operator) -> LightSwitch | None:
    if rig["dark"] == "operator":
        return OperatorSwitch(operator)
    if rig["dark"] == "lamp-relay":
        if "relay_port" not in rig:
            raise InputError(source, "relay_port", "is missing", "name the port on which the relay hangs")
        return RelaySwitch(rig["relay_port"])
    if "blank_slot" not in rig["instruments"]["filter_wheel"]:
        raise InputError(
            source,
            "instruments.filter_wheel.blank_slot",
            "is missing",
            "name the slot that lets no light through, or set `dark` to lamp-relay or operator",
        )
    return None


def _slots(rig: Mapping[str, Any], source: str | Path) -> dict[int, int]:
    """Slot of the wheel by band."""
    slots = {int(nm): slot for nm, slot in rig["instruments"]["filter_wheel"]["slots"].items()}
    for band_nm in rig["filters_nm"]:
        if band_nm not in slots:
            raise InputError(
                source, "instruments.filter_wheel.slots", f"has no slot for {band_nm} nm", "add it"
            )
    return slots


def _log(logs: Path | None, name: str) -> str | None:
    return None if logs is None else str(logs / f"{name}.log")
