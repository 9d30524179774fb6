"""The instruments of a rig's file, opened by their drivers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
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
from pbrdf.instruments.kinds import Camera, FilterWheel, Instrument, Rotator
from pbrdf.instruments.manual import ManualTable, Operator
from pbrdf.instruments.optec_ifw import OptecIFW
from pbrdf.instruments.switches import LightSwitch, OperatorSwitch, RelaySwitch

Openers = dict[str, Callable[[], Instrument]]


def openers(rig: Mapping[str, Any], source: str | Path) -> Openers:
    """What opens each instrument that a rig's file names, by its name in the rig.

    Parameters
    ----------
    rig : mapping
        The file's content, checked against its schema.
    source : str or Path
        That file, for messages.

    Raises
    ------
    InputError
        If the file names no instruments, or says too little of one. The functions raise `InstrumentError`.
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

    def stage(name: str) -> Callable[[], Instrument]:
        return lambda: K10CR1.open(
            named[name]["port"],
            name.replace("_", " "),
            clock,
            serial_number=named[name].get("serial"),
            log=_log(logs, name),
        )

    return {
        "generator_retarder": stage("generator_retarder"),
        "analyser_retarder": stage("analyser_retarder"),
        "filter_wheel": lambda: _open_wheel(named["filter_wheel"], clock, logs),
        "arm": _arm_opener(rig, source, clock, operator, logs),
        "camera": lambda: _open_camera(rig),
    }


@contextmanager
def open_real(rig: Mapping[str, Any], source: str | Path) -> Iterator[InstrumentRig]:
    """Open the instruments that a rig's file names, and let go of them in the end.

    For parameters and errors see `openers`.

    Raises
    ------
    InputError
        If the file says too little.
    InstrumentError
        If an instrument cannot be opened, or is another than the file says. Nothing has moved then.
    """
    to_open = openers(rig, source)
    slots, blank = _slots(rig, source), _blank_slot(rig, source)
    with ExitStack() as opened:
        found: dict[str, Any] = {name: opened.enter_context(one()) for name, one in to_open.items()}
        switch = _open_switch(rig, source)
        if switch is not None:
            opened.callback(switch.close)
        camera = found["camera"].identity
        instruments = Instruments(
            found["generator_retarder"],
            found["analyser_retarder"],
            found["arm"],
            found["filter_wheel"],
            found["camera"],
            slots,
            blank,
            switch,
        )
        identity = f"real rig, {camera.model} {camera.serial}".strip()
        yield opened.enter_context(InstrumentRig(instruments, identity))


def _open_wheel(named: Mapping[str, Any], clock: Clock, logs: Path | None) -> FilterWheel:
    return OptecIFW.open(
        named["port"],
        "filter wheel",
        clock,
        serial_number=named.get("serial"),
        log=_log(logs, "filter_wheel"),
    )


def _arm_opener(
    rig: Mapping[str, Any], source: str | Path, clock: Clock, operator: Operator, logs: Path | None
) -> Callable[[], Rotator]:
    named = rig["instruments"]["arm"]
    if "arm" not in rig:
        raise InputError(source, "arm", "is missing", "say its radius and where it hits nothing")
    low, high = rig["arm"]["limits_deg"]
    if named["driver"] == "manual":
        return lambda: ManualTable("arm", clock, operator, (low, high))
    for field in ("port", "steps_per_deg"):
        if field not in named:
            raise InputError(source, f"instruments.arm.{field}", "is missing", "add it")
    rates = (named["steps_per_deg"], named["speed_deg_s"], named["acceleration_deg_s2"])
    if named["driver"] == "iconasys-ftdi":
        pulses = PulseDrive(*rates, (low, high), home_deg=named["home_deg"])
        return lambda: IconasysTable.open(named["port"], "arm", clock, drive=pulses, operator=operator)
    drive = Drive(*rates, (low, high), home_deg=named["home_deg"], has_switch=named["has_switch"])
    return lambda: GrblTable.open(
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
        frame_format=FrameFormat.of_camera(rig["camera"]),
        corner_px=(column, row),
        model=named.get("model", ""),
        serial=named.get("serial", ""),
        black_level=named.get("black_level"),
    )


def _open_switch(rig: Mapping[str, Any], source: str | Path) -> LightSwitch | None:
    if rig["dark"] == "operator":
        return OperatorSwitch(Operator())
    if rig["dark"] == "lamp-relay":
        if "relay_port" not in rig:
            raise InputError(source, "relay_port", "is missing", "name the port on which the relay hangs")
        return RelaySwitch(rig["relay_port"])
    return None


def _blank_slot(rig: Mapping[str, Any], source: str | Path) -> int | None:
    if rig["dark"] != "blank-slot":
        return None
    if "blank_slot" not in rig["instruments"]["filter_wheel"]:
        raise InputError(
            source,
            "instruments.filter_wheel.blank_slot",
            "is missing",
            "name the slot that lets no light through, or set `dark` to lamp-relay or operator",
        )
    return int(rig["instruments"]["filter_wheel"]["blank_slot"])


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
