"""The camera's driver against a stand-in for the library, which fails as cameras do."""

from __future__ import annotations

import sys
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pbrdf.errors import InstrumentError
from pbrdf.instruments import aravis_port
from pbrdf.instruments.aravis_camera import AravisCamera
from pbrdf.instruments.genicam import SUCCESS, Delivery, GenicamError
from pbrdf.instruments.interface import FrameFormat
from pbrdf.instruments.kinds import Identity

FORMAT = FrameFormat(6, 8, "uint16", 14, 2, 65532.0)
PIXELS = (np.arange(48, dtype="<u2") * 1000 & 0xFFFC).tobytes()
SETTINGS = {
    "ExposureAuto": "Continuous",
    "GainAuto": "Continuous",
    "BlackLevelAuto": "Continuous",
    "SharpnessAuto": "Continuous",
    "AcquisitionFrameRateEnabled": True,
    "GammaEnabled": True,
    "Gamma": 1.25,
    "SharpnessEnabled": True,
    "pgrDefectPixelCorrectionEnable": True,
    "Gain": 12.5,
    "BlackLevel": 1.5,
    "ExposureTime": 5000.0,
    "PixelFormat": "Mono8",
    "OffsetX": 40,
    "OffsetY": 20,
    "Width": 3376,
    "Height": 2704,
    "TriggerMode": "Off",
    "TriggerSource": "Line0",
    "AcquisitionMode": "SingleFrame",
    "TriggerSoftware": None,
    "AcquisitionStop": None,
}
SENSOR = {"OffsetX": ("Width", 3376), "OffsetY": ("Height", 2704)}


class StandIn:
    """A camera and its library; `deliveries` replaces what triggers make, `refuses` what it takes."""

    def __init__(self, **settings: Any) -> None:
        self.settings = SETTINGS | settings
        self.identity = Identity("GS3-U3-91S6M", "14450123", "2.28.3")
        self.lost = False
        self.closed = 0
        self.started: bool | None = None
        self.written: list[tuple[str, Any]] = []
        self.refuses: dict[str, str] = {}
        self.reads_as: dict[str, Any] = {}
        self.waiting: list[Delivery] = []
        self.triggered: list[list[Delivery | None]] | None = None
        self.number = 7
        self.lost_after_takes: int | None = None
        self.waited_s = 0.0

    def has(self, feature: str) -> bool:
        return feature in self.settings

    def entries(self, feature: str) -> tuple[str, ...]:
        return {"TriggerSelector": ("AcquisitionStart", "FrameStart"), "ChunkSelector": ("ExposureTime",)}[
            feature
        ]

    def bounds(self, feature: str) -> tuple[float, float]:
        assert feature == "ExposureTime"
        return 10.0, 31.9e6

    def read(self, feature: str, kind: type) -> Any:
        value = self.reads_as.get(feature, self.settings[feature])
        if feature in self.refuses and self.refuses[feature].startswith("read"):
            raise GenicamError(self.refuses[feature])
        assert type(value) is kind, feature
        return value

    def write(self, feature: str, value: Any) -> None:
        assert not self.closed
        if feature in self.refuses:
            raise GenicamError(self.refuses[feature])
        if feature in SENSOR:
            size, largest = SENSOR[feature]
            assert value + self.settings.get(size, 0) <= largest
        self.settings[feature] = value
        self.written.append((feature, value))

    def execute(self, command: str) -> None:
        if command in self.refuses:
            raise GenicamError(self.refuses[command])
        if command == "TriggerSoftware":
            self.number += 1
            self.waiting += self._made()

    def _made(self) -> list[Delivery]:
        if self.triggered is not None:
            return self.triggered.pop(0)
        return [self.delivery(self.number)]

    def delivery(self, number: int, **other: Any) -> Delivery:
        whole = Delivery(SUCCESS, number, 6, 8, 0x01100007, PIXELS)
        return replace(whole, **other)

    def start(self, exposure_chunk: bool) -> None:
        self.started = exposure_chunk

    def take(self, timeout_s: float) -> Delivery | None:
        if self.waiting:
            return self.waiting.pop(0)
        self.waited_s += timeout_s
        if self.lost_after_takes is not None:
            self.lost_after_takes -= 1
            self.lost = self.lost_after_takes <= 0
        return None

    def close(self) -> None:
        self.closed += 1


def opened(port: StandIn, **settings: Any) -> AravisCamera:
    return AravisCamera.open(
        "here", "camera", connect=lambda *_: port, **({"frame_format": FORMAT} | settings)
    )


def refused_open(port: StandIn, **settings: Any) -> InstrumentError:
    with pytest.raises(InstrumentError) as refused:
        opened(port, **settings)
    assert "\n" not in str(refused.value)
    assert refused.value.source == "camera at here"
    assert port.closed
    return refused.value


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


def test_all_that_is_not_linear_is_off() -> None:
    port = StandIn()
    opened(port, black_level=2.0)
    found = port.settings
    autos = ("ExposureAuto", "GainAuto", "BlackLevelAuto", "SharpnessAuto")
    assert [found[feature] for feature in autos] == ["Off"] * 4
    switches = (
        "AcquisitionFrameRateEnabled",
        "GammaEnabled",
        "SharpnessEnabled",
        "pgrDefectPixelCorrectionEnable",
    )
    assert [found[feature] for feature in switches] == [False] * 4
    assert (found["Gain"], found["Gamma"], found["BlackLevel"]) == (0.0, 1.0, 2.0)


def test_gain_is_zero_in_raw_steps_where_there_are_no_decibels() -> None:
    port = StandIn(GainRaw=5)
    del port.settings["Gain"]
    opened(port)
    assert port.settings["GainRaw"] == 0
    both = StandIn(GainRaw=33)
    opened(both)
    assert (both.settings["Gain"], both.settings["GainRaw"]) == (0.0, 33)


def test_the_black_level_stays_where_none_is_given() -> None:
    port = StandIn()
    opened(port)
    assert port.settings["BlackLevel"] == 1.5


@pytest.mark.parametrize(("dtype", "word"), [("uint8", "Mono8"), ("uint16", "Mono16")])
def test_the_word_follows_from_the_frames(dtype: str, word: str) -> None:
    port = StandIn(PixelFormat="Mono12p")
    opened(port, frame_format=replace(FORMAT, dtype=dtype))
    assert port.settings["PixelFormat"] == word


def test_frames_of_no_word_are_refused() -> None:
    error = refused_open(StandIn(), frame_format=replace(FORMAT, dtype="float32"))
    assert (error.field, error.problem) == ("type of frames", "is float32")


def test_the_region_never_leaves_the_sensor_on_its_way() -> None:
    port = StandIn()
    opened(port, corner_px=(3368, 2698))
    region = [port.settings[feature] for feature in ("OffsetX", "OffsetY", "Width", "Height")]
    assert region == [3368, 2698, 8, 6]


def test_frames_come_by_command_alone() -> None:
    port = StandIn(TriggerSelector="AcquisitionStart", TriggerMode="On")
    opened(port)
    assert port.settings["TriggerSelector"] == "FrameStart"
    assert (port.settings["TriggerMode"], port.settings["TriggerSource"]) == ("On", "Software")
    assert port.written.index(("TriggerMode", "Off")) < port.written.index(("TriggerSource", "Software"))


def test_what_stands_right_is_not_written() -> None:
    port = StandIn()
    opened(port)
    port.written.clear()
    opened(port)
    assert not port.written


@pytest.mark.parametrize(
    "feature",
    ["PixelFormat", "Width", "Height", "TriggerMode", "TriggerSource", "TriggerSoftware", "AcquisitionMode"],
)
def test_a_camera_that_lacks_what_is_needed_is_refused_by_name(feature: str) -> None:
    port = StandIn()
    del port.settings[feature]
    error = refused_open(port)
    assert (error.field, error.problem) == (feature, "is a feature it lacks")


def test_a_camera_without_exposures_is_refused() -> None:
    port = StandIn()
    del port.settings["ExposureTime"]
    assert refused_open(port).field == "ExposureTime or ExposureTimeAbs"


def test_a_camera_without_corners_may_be_used_whole() -> None:
    port = StandIn()
    del port.settings["OffsetX"], port.settings["OffsetY"]
    opened(port)
    assert refused_open(port, corner_px=(8, 0)).field == "OffsetX"


def test_a_black_level_that_the_camera_lacks_is_refused() -> None:
    port = StandIn()
    del port.settings["BlackLevel"]
    assert refused_open(port, black_level=1.0).field == "BlackLevel"


@pytest.mark.parametrize(
    ("feature", "found", "wanted"),
    [
        ("Gain", 0.5, "0.0"),
        ("PixelFormat", "Mono12p", "'Mono16'"),
        ("Width", 16, "8"),
        ("GammaEnabled", True, "F"),
    ],
)
def test_a_setting_that_reads_back_as_another_is_refused(feature: str, found: Any, wanted: str) -> None:
    port = StandIn()
    port.reads_as[feature] = found
    error = refused_open(port)
    assert error.field == feature
    assert error.problem.startswith(f"reads {found!r} after it was set to {wanted}")


def test_a_setting_that_the_camera_refuses_is_named() -> None:
    port = StandIn()
    port.refuses["Width"] = "[Width] value 8 out of range"
    error = refused_open(port)
    assert (error.field, error.problem) == ("Width", "cannot be set to 8 ([Width] value 8 out of range)")


@pytest.mark.parametrize(("field", "found"), [("model", "GS3-U3-91S6M"), ("serial", "14450123")])
def test_another_camera_is_refused_before_anything_is_set(field: str, found: str) -> None:
    port = StandIn()
    error = refused_open(port, **{field: "other"})
    assert (error.field, error.problem) == (field, f"is {found!r}, not 'other'")
    assert not port.written
    opened(StandIn(), **{field: found})


def test_a_camera_left_acquiring_is_stopped_first_and_one_that_stands_still_may_refuse() -> None:
    port = StandIn()
    port.refuses["AcquisitionStop"] = "not acquiring"
    assert opened(port).identity.firmware == "2.28.3"


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
