"""How a camera is set when it is opened, against a stand-in for the library."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from genicam_stand_in import FORMAT, StandIn, opened, refused_open


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
