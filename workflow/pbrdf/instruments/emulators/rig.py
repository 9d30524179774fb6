"""A whole rig of emulated instruments, driven over their wires."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from typing import Any

from pbrdf.instruments.aravis_camera import AravisCamera
from pbrdf.instruments.emulators.camera import EmulatedCamera
from pbrdf.instruments.emulators.clock import VirtualClock
from pbrdf.instruments.emulators.faults import Faults
from pbrdf.instruments.emulators.grbl import EmulatedGrbl
from pbrdf.instruments.emulators.k10cr1 import K10CR1Emulator
from pbrdf.instruments.emulators.optec_ifw import EmulatedIFW
from pbrdf.instruments.emulators.scene import Renderer, Scene, Stand
from pbrdf.instruments.emulators.server import PtyServer
from pbrdf.instruments.grbl import Drive, GrblTable
from pbrdf.instruments.instrument_rig import InstrumentRig, Instruments
from pbrdf.instruments.k10cr1 import K10CR1
from pbrdf.instruments.optec_ifw import OptecIFW

WHEEL, SLOTS = "F", 8
"""The emulated wheel, whose last slot is blank."""

GENERATOR, ANALYSER = 55_000_001, 55_000_002
"""Serial numbers of the two stages."""

STEPS_PER_DEG = 400.0
TABLE_SPEED_DEG_S, TABLE_ACCELERATION_DEG_S2 = 10.0, 20.0

TURN_S = 2.4
"""Of the wheel, by four slots."""

POLL_S = 0.001
SILENCE_S = 0.5
"""Longest wait for an answer: emulators are quick, and nobody should be kept by one that a fault silences."""


@contextmanager
def emulated_rig(rig: Mapping[str, Any], renderer: Renderer) -> Iterator[InstrumentRig]:
    """Emulate the instruments of a virtual rig, open them by their drivers, and end both.

    Parameters
    ----------
    rig : mapping
        The rig's file, checked against its schema: its filters, its arm and its ``faults``.
    renderer : Renderer
        What the camera sees.

    Raises
    ------
    InstrumentError
        If a fault keeps an instrument from being opened.
    """
    clock = VirtualClock()
    devices = ("generator_retarder", "analyser_retarder", "filter_wheel", "arm", "camera")
    faults = {name: Faults() for name in devices}
    for fault in rig.get("faults", []):
        faults[fault["device"]].arm(**{key: value for key, value in fault.items() if key != "device"})
    low, high = rig["arm"]["limits_deg"]
    seed = rig["seed"]
    generator = K10CR1Emulator(clock, faults["generator_retarder"], serial_number=GENERATOR, seed=seed)
    analyser = K10CR1Emulator(clock, faults["analyser_retarder"], serial_number=ANALYSER, seed=seed + 1)
    wheel = EmulatedIFW(clock, faults["filter_wheel"], wheel=WHEEL)
    arm = EmulatedGrbl(clock, faults["arm"], start_deg=low, switch_deg=low, seed=seed)
    slots = {band_nm: number for number, band_nm in enumerate(rig["filters_nm"], start=1)}
    scene = Scene(
        renderer,
        Stand(
            generator.angle_deg,
            analyser.angle_deg,
            arm.angle_deg,
            wheel.slot_in_beam,
            {slot: band_nm for band_nm, slot in slots.items()},
        ),
    )
    camera = EmulatedCamera(scene, clock, faults["camera"])
    drive = Drive(
        STEPS_PER_DEG, TABLE_SPEED_DEG_S, TABLE_ACCELERATION_DEG_S2, (low, high), home_deg=low, homing_s=10.0
    )
    with ExitStack() as stack:
        urls = [stack.enter_context(PtyServer(device)).url for device in (generator, analyser, wheel, arm)]
        generator_driver, analyser_driver = (
            stack.enter_context(
                K10CR1.open(url, name, clock, serial_number=str(number), reply_timeout_s=SILENCE_S)
            )
            for url, name, number in (
                (urls[0], "generator retarder", GENERATOR),
                (urls[1], "analyser retarder", ANALYSER),
            )
        )
        wheel_driver = stack.enter_context(
            OptecIFW.open(
                urls[2],
                "filter wheel",
                clock,
                wheel=WHEEL,
                turn_s=TURN_S,
                reply_timeout_s=SILENCE_S,
                poll_timeout_s=POLL_S,
            )
        )
        arm_driver = stack.enter_context(
            GrblTable.open(
                urls[3], "arm", clock, drive=drive, reply_timeout_s=SILENCE_S, poll_timeout_s=POLL_S
            )
        )
        camera_driver = stack.enter_context(
            AravisCamera.open(
                "emulated",
                "camera",
                frame_format=renderer.frame_format,
                connect=lambda address, instrument: camera,
            )
        )
        instruments = Instruments(
            generator_driver, analyser_driver, arm_driver, wheel_driver, camera_driver, slots, SLOTS, None
        )
        yield stack.enter_context(InstrumentRig(instruments, renderer.identity, scene.announce))
