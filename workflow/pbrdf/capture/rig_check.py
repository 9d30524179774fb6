"""A look at a rig before a day's work: every instrument found, moved a little, and one frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from serial.tools.list_ports import comports

from pbrdf.capture.rigs import open_rig
from pbrdf.errors import InputError, InstrumentError
from pbrdf.instruments.emulators.scene import Renderer
from pbrdf.instruments.instrument_rig import InstrumentRig
from pbrdf.instruments.interface import FrameFormat, Setting
from pbrdf.instruments.kinds import FilterWheel, Instrument, Rotator
from pbrdf.instruments.open_rig import openers
from pbrdf.settings.targets import AMBIENT

SMALL_MOVE_DEG = 1.0
BARS = 8


def check_rig(
    rig: Mapping[str, Any], source: str | Path, renderer: Callable[[], Renderer], exposure_s: float
) -> Iterator[str]:
    """Find every instrument, move each a little and take a frame; tells it line by line.

    Parameters
    ----------
    rig : mapping
        The rig's file, checked against its schema.
    source : str or Path
        That file, for messages.
    renderer : callable
        Makes what a virtual rig's camera sees.
    exposure_s : float
        Of the frame.

    Raises
    ------
    InputError
        If the file says too little, or, after all have been tried, if any instrument did not answer.
    InstrumentError
        If one does not move or expose as it should.
    """
    if rig["kind"] == "real":
        yield from _each_opened(openers(rig, source), source)
    with open_rig(rig, source, renderer, "Put a sphere in its place; lamp on.") as ready:
        yield from _moved(ready)
        yield from _frame_lines(ready, exposure_s)


def _each_opened(to_open: Mapping[str, Callable[[], Instrument]], source: str | Path) -> Iterator[str]:
    failed = []
    for name, opened in to_open.items():
        try:
            with opened() as instrument:
                yield f"{name}: {_identity(instrument)}"
        except InstrumentError as error:
            failed.append(name)
            yield f"{name}: {error}"
    if failed:
        ports = ", ".join(f"{port.device} ({port.description})" for port in comports()) or "none"
        problem = f"{', '.join(failed)} did not answer"
        raise InputError(source, "instruments", problem, f"correct cables or file; serial ports: {ports}")


def _identity(instrument: Instrument) -> str:
    identity = instrument.identity
    parts = {"model": identity.model, "serial": identity.serial, "firmware": identity.firmware}
    told = ", ".join(f"{name} {value}" for name, value in parts.items() if value)
    return f"{instrument.name}, {told or 'does not say what it is'}"


def _moved(rig: InstrumentRig) -> Iterator[str]:
    rig.home()
    on = rig.instruments
    for axis in (on.generator_retarder, on.analyser_retarder, on.arm):
        yield f"{_identity(axis)}; {_turned(axis)}"
    yield f"{_identity(on.wheel)}; {_stepped(on.wheel)}"


def _turned(axis: Rotator) -> str:
    begun = axis.position_deg()
    axis.move_to(begun + SMALL_MOVE_DEG).wait()
    return f"asked for {SMALL_MOVE_DEG:g}° more it turned by {axis.position_deg() - begun:.4f}°"


def _stepped(wheel: FilterWheel) -> str:
    wheel.select(2).wait()
    found = wheel.slot()
    wheel.select(1).wait()
    return f"{wheel.slots} slots, asked for slot 2 it shows slot {found}"


def _frame_lines(rig: InstrumentRig, exposure_s: float) -> Iterator[str]:
    camera = rig.instruments.camera
    low, high = camera.exposure_range_s
    yield f"{_identity(camera)}; exposures {1e3 * low:g} ms to {high:g} s"
    dark = rig.expose_dark("check/dark", exposure_s).frame
    yield f"dark frame of {1e3 * exposure_s:g} ms: {_told(dark, camera.frame_format)}"
    band_nm = min(rig.instruments.slots)
    setting = Setting(AMBIENT, band_nm, (0.0, 0.0, 0.0, 90.0), exposure_s, 0)
    frame = rig.expose("check/frame", setting).frame
    yield f"frame of {1e3 * exposure_s:g} ms at {band_nm} nm: {_told(frame, camera.frame_format)}"
    yield f"focus measure {focus(frame):.3g} (relative; turn the lens until it is greatest)"
    yield histogram(frame, camera.frame_format)


def _told(frame: NDArray[Any], form: FrameFormat) -> str:
    saturated = 100.0 * float(np.mean(frame >= form.saturation))
    return f"median {np.median(frame):g} DN, highest {frame.max():g} DN, {saturated:.2g} % saturated"


def focus(frame: NDArray[Any]) -> float:
    """Variance of the Laplacian over the squared mean: greatest where the picture is sharp."""
    picture = np.asarray(frame, np.float64)
    mean = float(picture.mean())
    return float(np.var(cv2.Laplacian(picture, cv2.CV_64F))) / mean**2 if mean > 0 else 0.0


def histogram(frame: NDArray[Any], form: FrameFormat) -> str:
    """Shares of the pixels in eighths of the range, in a line."""
    counts, _ = np.histogram(frame, BARS, (0.0, form.saturation))
    shares = " ".join(f"{100 * count / frame.size:.0f}" for count in counts)
    return f"exposure histogram, % of pixels in eighths of the range to {form.saturation:g} DN: {shares}"
