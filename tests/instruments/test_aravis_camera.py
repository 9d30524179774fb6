"""The camera's driver against a stand-in for the library, which fails as cameras do."""

from __future__ import annotations

import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from genicam_stand_in import FORMAT, PIXELS, StandIn, opened

from pbrdf.errors import InstrumentError
from pbrdf.instruments import aravis_port
from pbrdf.instruments.aravis_camera import AravisCamera
from pbrdf.instruments.genicam import Delivery
from pbrdf.instruments.interface import FrameFormat


def refused_frame(port: StandIn, camera: AravisCamera, exposure_s: float = 0.01) -> InstrumentError:
    """The refusal; after it nothing of the library is left, and the camera can be opened again."""
    with pytest.raises(InstrumentError) as refused:
        camera.expose(exposure_s)
    assert "\n" not in str(refused.value)
    assert port.closed
    with pytest.raises(InstrumentError, match="is closed; open it again"):
        camera.expose(exposure_s)
    assert opened(StandIn()).expose(0.02).number == 8
    return refused.value


def test_a_frame_is_what_the_trigger_made() -> None:
    port = StandIn(DeviceTemperature=41.5)
    camera = opened(port)
    taken = camera.expose(0.02)
    assert np.array_equal(taken.frame, np.frombuffer(PIXELS, "<u2").reshape(6, 8))
    assert taken.frame.dtype == np.uint16
    assert (taken.exposure_s, taken.temperature_c, taken.number) == (0.02, 41.5, 8)
    assert camera.frame_format == FORMAT
    assert camera.exposure_range_s == (10e-6, 31.9)
    assert camera.name == "camera at here"


def test_a_camera_without_thermometer_tells_no_temperature() -> None:
    assert opened(StandIn()).expose(0.01).temperature_c is None


def test_the_temperature_is_that_of_each_frame() -> None:
    port = StandIn(DeviceTemperature=41.5)
    camera = opened(port)
    camera.expose(0.01)
    port.settings["DeviceTemperature"] = 43.0
    assert camera.expose(0.01).temperature_c == 43.0


def test_eight_bit_frames_are_read() -> None:
    port = StandIn()
    port.triggered = [[port.delivery(8, pixel_format=0x01080001, pixels=bytes(range(48)))]]
    frame = opened(port, frame_format=FrameFormat(6, 8, "uint8", 8, 0, 255.0)).expose(0.01).frame
    assert (frame.dtype, frame[5, 7]) == (np.uint8, 47)


def test_an_exposure_is_set_when_it_changes() -> None:
    port = StandIn()
    camera = opened(port)
    port.written.clear()
    for exposure_s in (0.01, 0.01, 0.5):
        camera.expose(exposure_s)
    assert port.written == [("ExposureTime", 1e4), ("ExposureTime", 5e5)]


@pytest.mark.parametrize("exposure_s", [9e-6, 32.0, float("nan")])
def test_an_exposure_out_of_range_is_refused_and_the_camera_goes_on(exposure_s: float) -> None:
    port = StandIn()
    camera = opened(port)
    with pytest.raises(InstrumentError, match=r"stay within 1e-05…31\.9 s"):
        camera.expose(exposure_s)
    assert not port.closed
    assert camera.expose(31.9).number == 8


def test_an_exposure_that_reads_back_otherwise_is_refused() -> None:
    port = StandIn()
    camera = opened(port)
    port.reads_as["ExposureTime"] = 10_090.0
    assert camera.expose(0.01).exposure_s == pytest.approx(0.01009)
    port.reads_as["ExposureTime"] = 10_110.0
    error = refused_frame(port, camera)
    assert (error.field, error.problem) == ("ExposureTime", "reads 0.01011 s where 0.01 s were asked for")


def test_the_exposure_that_a_frame_carries_is_believed() -> None:
    port = StandIn(ChunkModeActive=False, ChunkSelector="Gain", ChunkEnable=False)
    camera = opened(port)
    assert port.started
    port.triggered = [[port.delivery(8, exposure_us=10_040.0)], [port.delivery(9, exposure_us=5_000.0)]]
    assert camera.expose(0.01).exposure_s == pytest.approx(0.01004)
    error = refused_frame(port, camera)
    assert (error.field, error.problem) == ("ChunkExposureTime", "reads 0.005 s where 0.01 s were asked for")


def test_frames_of_a_camera_whose_chunks_tell_no_exposure_are_taken_without() -> None:
    port = StandIn(ChunkModeActive=False)
    taken = opened(port).expose(0.01)
    assert (port.started, taken.exposure_s) == (False, 0.01)


def test_the_wait_for_a_frame_follows_from_its_exposure() -> None:
    port = StandIn()
    port.triggered = [[]]
    camera = opened(port, reply_timeout_s=2.0)
    error = refused_frame(port, camera, 3.0)
    assert error.problem == "has not come within 5 s"
    assert port.waited_s == pytest.approx(5.0)


@pytest.mark.parametrize("status", ["timeout", "missing-packets", "size-mismatch", "aborted"])
def test_a_frame_that_did_not_arrive_whole_is_refused(status: str) -> None:
    port = StandIn()
    port.triggered = [[Delivery(status, 8)]]
    error = refused_frame(port, opened(port))
    assert (error.field, error.problem) == ("frame", f"8 did not arrive whole ({status})")


@pytest.mark.parametrize(
    ("other", "problem"),
    [
        ({"pixels": PIXELS[:-2]}, "8 is short: 94 of 96 bytes"),
        ({"rows": 5}, "8 has 5 × 8 pixels"),
        ({"columns": 16}, "8 has 6 × 16 pixels"),
        ({"pixel_format": 0x01100005}, "8 has the pixel format 0x01100005"),
        ({"pixels": b"\1" + PIXELS[1:]}, "8 has bits set below the left shift of 2"),
    ],
)
def test_a_frame_of_another_form_is_refused(other: dict[str, Any], problem: str) -> None:
    port = StandIn()
    port.triggered = [[port.delivery(8, **other)]]
    assert refused_frame(port, opened(port)).problem == problem


def test_frames_of_before_the_trigger_are_dropped() -> None:
    port = StandIn()
    camera = opened(port)
    stale = [port.delivery(number, pixels=bytes(96)) for number in (6, 7)]
    port.waiting = stale.copy()
    assert camera.expose(0.01).frame.any()
    port.triggered = [[*stale, port.delivery(9)]]
    taken = camera.expose(0.01)
    assert (taken.number, bool(taken.frame.any())) == (9, True)


@pytest.mark.parametrize("endless", [False, True])
def test_stale_frames_alone_are_refused(endless: bool) -> None:
    port = StandIn()
    camera = opened(port, reply_timeout_s=1.0)
    camera.expose(0.01)
    port.triggered = [[port.delivery(8)] * (100 if endless else 2)]
    assert "stale" in refused_frame(port, camera).problem


@pytest.mark.parametrize(
    ("last", "number"), [(65534, 65535), (65535, 1), (65535, 0), (70000, 70001), (65535, 65536)]
)
def test_numbers_of_frames_may_begin_again(last: int, number: int) -> None:
    port = StandIn()
    camera = opened(port)
    port.triggered = [[port.delivery(last)], [port.delivery(number)]]
    assert [camera.expose(0.01).number for _ in range(2)] == [last, number]


def test_a_camera_that_is_lost_is_noticed_before_the_exposure_has_passed() -> None:
    port = StandIn()
    port.triggered = [[]]
    camera = opened(port)
    port.lost_after_takes = 4
    error = refused_frame(port, camera, 30.0)
    assert (error.field, error.problem) == ("control", "was lost")
    assert error.remedy.startswith("see its cable and power")
    assert port.waited_s < 0.5


@pytest.mark.parametrize("call", ["TriggerSoftware", "ExposureTime"])
def test_a_call_that_fails_is_told_in_the_library_s_words(call: str) -> None:
    port = StandIn()
    camera = opened(port)
    port.refuses[call] = "GigEVision write_register timeout"
    error = refused_frame(port, camera)
    assert (error.field, error.problem) == ("control", "fails (GigEVision write_register timeout)")


def test_an_interruption_lets_go_of_the_camera(monkeypatch: pytest.MonkeyPatch) -> None:
    port = StandIn()
    camera = opened(port)

    def interrupted(_timeout_s: float) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(port, "take", interrupted)
    with pytest.raises(KeyboardInterrupt):
        camera.expose(0.01)
    assert port.closed


def test_a_context_closes_it_and_closing_twice_does_no_harm() -> None:
    port = StandIn()
    with opened(port) as camera:
        camera.expose(0.01)
    camera.close()
    assert port.closed == 1


def test_without_pygobject_the_packages_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "gi", None)
    with pytest.raises(InstrumentError, match=r"apt-get install python3-gi gir1\.2-aravis-0\.8") as refused:
        AravisCamera.open("Fake_1", "camera", frame_format=FORMAT)
    assert (refused.value.source, refused.value.field) == ("camera at Fake_1", "PyGObject")
    with pytest.raises(InstrumentError, match="PyGObject"):
        aravis_port.addresses()


def test_without_aravis_its_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def require_version(namespace: str, version: str) -> None:
        raise ValueError(f"Namespace {namespace} not available")

    monkeypatch.setitem(sys.modules, "gi", SimpleNamespace(require_version=require_version))
    with pytest.raises(InstrumentError, match=r"apt-get install gir1\.2-aravis-0\.8") as refused:
        AravisCamera.open("Fake_1", "camera", frame_format=FORMAT)
    assert refused.value.problem == "is missing (Namespace Aravis not available)"
