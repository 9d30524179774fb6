"""A rig's file to a rig that takes photographs: a real one is emulated at the far end of its ports."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pbrdf.capture import rigs
from pbrdf.capture.material import capture_material
from pbrdf.capture.rig_check import check_rig, focus
from pbrdf.capture.run import capture
from pbrdf.errors import InputError, InstrumentError
from pbrdf.formats.capture_store import FrameStore
from pbrdf.instruments import open_rig
from pbrdf.instruments.aravis_camera import AravisCamera
from pbrdf.instruments.emulators.camera import EmulatedCamera
from pbrdf.instruments.emulators.clock import VirtualClock
from pbrdf.instruments.emulators.faults import Faults
from pbrdf.instruments.emulators.grbl import EmulatedGrbl
from pbrdf.instruments.emulators.k10cr1 import K10CR1Emulator
from pbrdf.instruments.emulators.optec_ifw import EmulatedIFW
from pbrdf.instruments.emulators.scene import Scene, Stand
from pbrdf.instruments.emulators.server import PtyServer
from pbrdf.instruments.virtual_rig import VirtualRig
from pbrdf.instruments.virtual_sphere import VirtualSphere
from pbrdf.settings.checked import check
from pbrdf.settings.plan import CapturePlan, Light, Metering
from pbrdf.settings.rig import read_rig

SOURCE = Path(__file__).resolve().parents[2] / "config/rig/virtual.yaml"
PLAN = CapturePlan(
    (Light("041.00", 41.0),), (450, 550), ((0.0, 0.0, 0.0, 90.0), (0.0, 25.0, 5.0, 90.0)), (0.01,), 1
)


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    tasks: list[str] = []
    monkeypatch.setattr(
        "pbrdf.instruments.manual.Operator.ask", lambda _, who, task: tasks.append(task) or ""
    )
    return tasks


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Iterator[dict[str, Any]]:
    """A real rig's file whose ports lead to emulators."""
    virtual = read_rig(SOURCE)
    camera = {**virtual["camera"], "rows": 16, "columns": 16, "focal_px": 200, "principal_px": [7.5, 7.5]}
    virtual = {**virtual, "camera": camera}
    clock = VirtualClock()
    monkeypatch.setattr(open_rig, "WallClock", lambda: clock)
    generator = K10CR1Emulator(clock, Faults(), serial_number=55_000_001)
    analyser = K10CR1Emulator(clock, Faults(), serial_number=55_000_002)
    wheel = EmulatedIFW(clock, Faults(), wheel="A")
    arm = EmulatedGrbl(clock, Faults(), start_deg=5.0, switch_deg=5.0)
    renderer = VirtualRig(virtual, VirtualSphere(virtual, "gold", 25.0, SOURCE))
    stand = Stand(
        generator.angle_deg, analyser.angle_deg, arm.angle_deg, wheel.slot_in_beam, {1: 450, 2: 550}
    )
    scene = Scene(renderer, stand)
    scene.announce("frame", None)
    emulated = EmulatedCamera(scene, clock, Faults())
    opened = AravisCamera.open
    monkeypatch.setattr(AravisCamera, "open", partial(opened, connect=lambda *_: emulated))
    with ExitStack() as stack:
        urls = [stack.enter_context(PtyServer(device)).url for device in (generator, analyser, wheel, arm)]
        real = {
            "schema": "pbrdf/rig/1",
            "kind": "real",
            "filters_nm": [450, 550],
            "camera": {"rows": 16, "columns": 16, "adc_bits": 14, "shift": 2},
            "arm": {"radius_mm": 800, "limits_deg": [5, 180]},
            "dark": "blank-slot",
            "instruments": {
                "generator_retarder": {"driver": "k10cr1", "port": urls[0], "serial": "55000001"},
                "analyser_retarder": {"driver": "k10cr1", "port": urls[1], "serial": "55000002"},
                "filter_wheel": {
                    "driver": "optec-ifw",
                    "port": urls[2],
                    "slots": {"450": 1, "550": 2},
                    "blank_slot": 5,
                },
                "arm": {"driver": "grbl", "port": urls[3], "steps_per_deg": 400, "home_deg": 5},
                "camera": {"driver": "aravis", "address": "emulated"},
            },
        }
        yield check(real, "rig", "lab.yaml")


def no_renderer() -> Any:
    raise AssertionError("a real rig renders nothing")


def test_a_real_rig_takes_photographs_after_its_operator_was_asked(
    tmp_path: Path, bench: dict[str, Any], asked: list[str]
) -> None:
    with rigs.open_rig(bench, "lab.yaml", no_renderer, "Put the sphere in its place.") as ready:
        ready.require(PLAN)
        capture(PLAN, "gold", ready, tmp_path)
    assert asked == ["Put the sphere in its place."]
    store = FrameStore.open(tmp_path / "lights/041.00/frames.zarr")
    assert store.header.source == "real rig, Grasshopper3 GS3-U3-91S6M 0"
    journal = (tmp_path / "lights/041.00/journal.jsonl").read_text(encoding="utf-8")
    assert '"slot_read": 2' in journal
    assert '"arm_read_deg": 41.0' in journal


def test_dark_frames_may_be_left_to_the_operator(
    tmp_path: Path, bench: dict[str, Any], asked: list[str]
) -> None:
    with rigs.open_rig({**bench, "dark": "operator"}, "lab.yaml", no_renderer, "Begin.") as ready:
        capture(PLAN, "gold", ready, tmp_path)
    assert asked == ["Begin.", "Cover the lamp.", "Uncover the lamp."]


def test_an_operator_covers_the_lamp_twice_however_many_lights_there_are(
    tmp_path: Path, bench: dict[str, Any], asked: list[str]
) -> None:
    lights = (*PLAN.lights, Light("080.00", 80.0), Light("120.00", 120.0))
    plan, rig = replace(PLAN, lights=lights, darks=2), {**bench, "dark": "operator"}
    capture_material(plan, rig, "lab.yaml", "gold", 25.0, tmp_path)
    assert asked[1:] == ["Cover the lamp.", "Uncover the lamp."] * 2
    assert FrameStore.open(tmp_path / "lights/120.00/frames.zarr").header.darks_at_ends


def test_an_interrupted_run_stops_what_moves_and_lets_go_of_the_ports(
    bench: dict[str, Any], asked: list[str]
) -> None:
    stopped = []
    with (
        pytest.raises(KeyboardInterrupt),
        rigs.open_rig(bench, "lab.yaml", no_renderer, "Begin.") as ready,
    ):
        ready.home()
        on = ready.instruments
        for axis in (on.arm, on.generator_retarder, on.analyser_retarder):
            axis.move_to(90.0)
            stop = axis.stop
            axis.stop = lambda name=axis.name, stop=stop: (stop(), stopped.append(name.split(" at ")[0]))
        raise KeyboardInterrupt
    assert stopped == ["arm", "analyser retarder", "generator retarder"]
    with rigs.open_rig(bench, "lab.yaml", no_renderer, "Begin.") as again:
        again.home()
        assert again.instruments.analyser_retarder.position_deg() < 90.0


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"instruments": None}, "instruments"),
        ({"arm": None}, "arm"),
        ({"dark": "lamp-relay"}, "relay_port"),
        ({"filters_nm": [450, 550, 650]}, "instruments.filter_wheel.slots"),
    ],
)
def test_a_file_that_says_too_little_is_refused_before_anything_is_opened(
    bench: dict[str, Any], change: dict[str, Any], field: str
) -> None:
    rig = {key: value for key, value in {**bench, **change}.items() if value is not None}
    with (
        pytest.raises(InputError) as refused,
        rigs.open_rig(rig, "lab.yaml", no_renderer, "Begin."),
    ):
        pytest.fail("it was opened")
    assert (refused.value.source, refused.value.field) == ("lab.yaml", field)


@pytest.mark.parametrize(
    ("device", "change", "told"),
    [
        ("generator_retarder", {"serial": "55000009"}, "55000009"),
        ("camera", {"serial": "15322432"}, "15322432"),
        ("filter_wheel", {"serial": "4711"}, "4711"),
    ],
)
def test_an_instrument_that_is_another_is_refused_before_anything_moves(
    bench: dict[str, Any], device: str, change: dict[str, str], told: str
) -> None:
    named = {**bench["instruments"], device: {**bench["instruments"][device], **change}}
    with (
        pytest.raises(InstrumentError, match=told),
        rigs.open_rig({**bench, "instruments": named}, "lab.yaml", no_renderer, "Begin."),
    ):
        pytest.fail("it was opened")


@pytest.mark.parametrize(
    ("slots", "exposures", "told"),
    [
        ({"450": 1, "550": 7}, (0.01,), "7 is beyond the wheel's 5"),
        ({"450": 1, "550": 2}, (0.01, 40.0), "40000 ms is not within"),
        ({"450": 1, "550": 2}, Metering(1e-6, 0.8), "0.001 ms is not within"),
    ],
)
def test_a_plan_beyond_the_instruments_is_refused(
    bench: dict[str, Any], asked: list[str], slots: dict[str, int], exposures: Any, told: str
) -> None:
    named = {**bench["instruments"], "filter_wheel": {**bench["instruments"]["filter_wheel"], "slots": slots}}
    change = {"metering" if isinstance(exposures, Metering) else "exposures_s": exposures}
    plan = replace(PLAN, **change)
    with (
        pytest.raises(InstrumentError, match=told),
        rigs.open_rig({**bench, "instruments": named}, "lab.yaml", no_renderer, "Begin.") as ready,
    ):
        ready.require(plan)


def test_a_check_tells_of_every_instrument_and_a_frame(bench: dict[str, Any], asked: list[str]) -> None:
    lines = "\n".join(check_rig(bench, "lab.yaml", no_renderer, 0.01))
    for told in ("K10CR1, serial 55000001", "Optec IFW", "turned by 1.0000°", "focus measure", "% saturated"):
        assert told in lines


def test_a_check_tries_all_instruments_before_it_fails(bench: dict[str, Any], asked: list[str]) -> None:
    missing = {"driver": "k10cr1", "port": "/dev/no-such-port"}
    named = {**bench["instruments"], "generator_retarder": missing}
    lines = []
    with pytest.raises(InputError, match=r"generator_retarder did not answer; .*serial ports:"):
        for line in check_rig({**bench, "instruments": named}, "lab.yaml", no_renderer, 0.01):
            lines.append(line)
    assert [line.split(":")[0] for line in lines] == list(bench["instruments"])


def test_a_sharp_picture_has_the_greater_focus_measure() -> None:
    board = np.kron(np.indices((8, 8)).sum(axis=0) % 2, np.ones((8, 8))) * 1000.0 + 100.0
    blurred = sum(np.roll(board, (a, b), (0, 1)) for a in range(-2, 3) for b in range(-2, 3)) / 25
    assert focus(board) > 5 * focus(blurred)
    assert focus(np.zeros((4, 4))) == 0.0
