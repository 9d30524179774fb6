"""Settings of a GenICam camera: every one read back, and all those that make its frames linear."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass

from pbrdf.errors import InstrumentError
from pbrdf.instruments.genicam import GenicamError, GenicamPort
from pbrdf.instruments.interface import FrameFormat

PIXEL_FORMATS = {"uint8": ("Mono8", 0x01080001), "uint16": ("Mono16", 0x01100007)}
"""Name and code by type of frame, of the GenICam pixel format naming convention."""


@dataclass(frozen=True)
class Wanted:
    """How a feature is to stand, under the first of its names that the camera knows."""

    features: tuple[str, ...]
    value: str | bool | int | float
    required: bool = False
    tolerance: float = 0.0


LINEAR = (
    *(
        Wanted((feature,), "Off")
        for feature in (
            "ExposureAuto",
            "pgrExposureCompensationAuto",
            "GainAuto",
            "BlackLevelAuto",
            "GammaAuto",
            "SharpnessAuto",
            "BalanceWhiteAuto",
            "AcquisitionFrameRateAuto",
            "TestPattern",
            "TestImageSelector",
        )
    ),
    Wanted(("ExposureMode",), "Timed"),
    Wanted(("AcquisitionFrameRateEnable", "AcquisitionFrameRateEnabled"), False),
    Wanted(("GammaEnable", "GammaEnabled"), False),
    Wanted(("Gamma",), 1.0, tolerance=1e-3),
    Wanted(("SharpnessEnable", "SharpnessEnabled", "SharpeningEnable"), False),
    Wanted(("LUTEnable", "LookupTableEnable"), False),
    Wanted(("pgrDefectPixelCorrectionEnable", "DefectCorrectStaticEnable"), False),
    Wanted(("OnBoardColorProcessEnabled",), False),
    Wanted(("BinningHorizontal",), 1),
    Wanted(("BinningVertical",), 1),
    Wanted(("DecimationHorizontal",), 1),
    Wanted(("DecimationVertical",), 1),
    Wanted(("ReverseX",), False),
    Wanted(("ReverseY",), False),
    Wanted(("AcquisitionMode",), "Continuous", required=True),
)
"""What keeps a value proportional to the light on its pixel; a camera may lack most of it."""

GAIN = Wanted(("Gain", "GainAbs"), 0.0, tolerance=0.01)


def configure(
    port: GenicamPort,
    instrument: str,
    form: FrameFormat,
    corner_px: tuple[int, int],
    black_level: float | None,
) -> None:
    """Make frames linear, of the format and region wanted, and triggered by software; read all back.

    Parameters
    ----------
    port : GenicamPort
    instrument : str
        Its name and address, for messages.
    form : FrameFormat
    corner_px : (int, int)
        Sensor column and row of the first pixel.
    black_level : float or None
        In the camera's unit; None for the one it has.

    Raises
    ------
    InstrumentError
        If the camera lacks what is needed, or does not take a setting; the feature is named.
    """
    if form.dtype not in PIXEL_FORMATS:
        problem, remedy = f"is {form.dtype}", f"use one of {', '.join(PIXEL_FORMATS)}"
        raise InstrumentError(instrument, "type of frames", problem, remedy)
    _stop_acquiring(port)
    for wanted in LINEAR:
        settle(port, instrument, wanted)
    # Decibels where the camera knows them; its raw steps are no decibels but begin at none.
    settle(port, instrument, GAIN if first_known(port, GAIN.features) else Wanted(("GainRaw",), 0))
    if black_level is not None:
        settle(port, instrument, Wanted(("BlackLevel",), float(black_level), required=True, tolerance=0.05))
    pixel_format, _ = PIXEL_FORMATS[form.dtype]
    settle(port, instrument, Wanted(("PixelFormat",), pixel_format, required=True))
    for wanted in _region(form, corner_px):
        settle(port, instrument, wanted)
    _trigger_by_software(port, instrument)


def _stop_acquiring(port: GenicamPort) -> None:
    """End what a run that was killed left going: a camera that acquires takes no settings."""
    if port.has("AcquisitionStop"):
        # One that stands still may refuse to stop.
        with contextlib.suppress(GenicamError):
            port.execute("AcquisitionStop")


def _region(form: FrameFormat, corner_px: tuple[int, int]) -> list[Wanted]:
    """Size and corner, in an order in which the region never leaves the sensor."""
    left, top = corner_px
    return [
        Wanted(("OffsetX",), 0),
        Wanted(("OffsetY",), 0),
        Wanted(("Width",), form.columns, required=True),
        Wanted(("Height",), form.rows, required=True),
        Wanted(("OffsetX",), left, required=left > 0),
        Wanted(("OffsetY",), top, required=top > 0),
    ]


def _trigger_by_software(port: GenicamPort, instrument: str) -> None:
    """One frame a command, and no other trigger, which would withhold it."""
    for selector in port.entries("TriggerSelector") if port.has("TriggerSelector") else ():
        settle(port, instrument, Wanted(("TriggerSelector",), selector))
        settle(port, instrument, Wanted(("TriggerMode",), "Off"))
    for wanted in (
        Wanted(("TriggerSelector",), "FrameStart"),
        Wanted(("TriggerSource",), "Software", required=True),
        Wanted(("TriggerMode",), "On", required=True),
    ):
        settle(port, instrument, wanted)
    if not port.has("TriggerSoftware"):
        raise lacking(instrument, ("TriggerSoftware",))


def mark_exposures(port: GenicamPort, instrument: str) -> bool:
    """Let every frame carry its exposure, where the camera can."""
    if not port.has("ChunkModeActive"):
        return False
    settle(port, instrument, Wanted(("ChunkModeActive",), True))
    if not port.has("ChunkSelector") or "ExposureTime" not in port.entries("ChunkSelector"):
        return False
    settle(port, instrument, Wanted(("ChunkSelector",), "ExposureTime"))
    settle(port, instrument, Wanted(("ChunkEnable",), True, required=True))
    return True


def settle(port: GenicamPort, instrument: str, wanted: Wanted) -> None:
    """Set a feature unless it stands so already, and read it back.

    Raises
    ------
    InstrumentError
        If the camera lacks it though it is required, refuses it or takes another value.
    """
    feature = first_known(port, wanted.features)
    if feature is None:
        if wanted.required:
            raise lacking(instrument, wanted.features)
        return
    try:
        if _stands(port, feature, wanted):
            return
        port.write(feature, wanted.value)
        if _stands(port, feature, wanted):
            return
        problem = f"reads {port.read(feature, type(wanted.value))!r} after it was set to {wanted.value!r}"
    except GenicamError as error:
        problem = f"cannot be set to {wanted.value!r} ({error})"
    raise InstrumentError(
        instrument, feature, problem, "correct the rig file, or set the camera back to its factory defaults"
    )


def first_known(port: GenicamPort, features: tuple[str, ...]) -> str | None:
    """The first of these features that the camera has."""
    return next((feature for feature in features if port.has(feature)), None)


def lacking(instrument: str, features: tuple[str, ...]) -> InstrumentError:
    """The refusal of a camera that lacks a feature under all its names."""
    return InstrumentError(
        instrument, " or ".join(features), "is a feature it lacks", "use a camera that has it"
    )


def _stands(port: GenicamPort, feature: str, wanted: Wanted) -> bool:
    found = port.read(feature, type(wanted.value))
    if isinstance(found, float) and isinstance(wanted.value, float):
        return abs(found - wanted.value) <= wanted.tolerance
    return found == wanted.value
