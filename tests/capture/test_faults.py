"""Instruments that fail within a run: it ends as if nothing had been, or the next one goes on from there."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from capture_content import capture_content

from pbrdf.capture.run import capture
from pbrdf.errors import InstrumentError
from pbrdf.instruments.emulators.rig import emulated_rig
from pbrdf.instruments.virtual_rig import VirtualRig
from pbrdf.instruments.virtual_sphere import VirtualSphere
from pbrdf.settings.plan import CapturePlan, Light
from pbrdf.settings.rig import read_rig

SOURCE = Path(__file__).resolve().parents[2] / "config/rig/virtual.yaml"
STATES = tuple((0.0, 25.0 * n, 5.0 * n, 90.0) for n in range(3))
PLAN = CapturePlan(
    (Light("008.00", 8.0), Light("041.00", 41.0)), (450, 550), STATES, (0.01,), 1, (1,), reference_state=1
)

HARMLESS: list[dict[str, Any]] = [
    {"device": "generator_retarder", "fault": fault, "after": after}
    for fault, after in (
        ("home-silent", 0),
        ("home-ignored", 0),
        ("completed-dropped", 3),
        ("completed-short", 3),
        ("completed-moving", 3),
        ("garbage", 0),
        ("split", 9),
        ("merged", 9),
        ("interleaved", 9),
        ("long-update", 4),
    )
]
HARMLESS += [
    {"device": "filter_wheel", "fault": "silent-start"},
    {"device": "filter_wheel", "fault": "late-star", "value": 2.0},
    {"device": "filter_wheel", "fault": "slow-home", "value": 3.0},
    {"device": "filter_wheel", "fault": "cr-lf", "count": -1},
    {"device": "arm", "fault": "garbage", "value": "3f 21 80"},
]

ENDING: list[dict[str, Any]] = [
    {"device": "analyser_retarder", "fault": fault, "after": after, "count": -1}
    for fault, after in (
        ("stall", 4),
        ("homed-lost", 4),
        ("silent", 30),
        ("wrong-model", 0),
        ("wrong-serial", 0),
    )
]
ENDING += [
    {"device": "filter_wheel", "fault": fault, "after": after, "value": value}
    for fault, after in (("goto-error", 2), ("home-error", 0))
    for value in range(1, 9)
]
ENDING += [
    {"device": "filter_wheel", "fault": "wrong-slot", "after": 2},
    {"device": "filter_wheel", "fault": "power-off", "after": 2},
    {"device": "filter_wheel", "fault": "reset", "after": 12},
    {"device": "filter_wheel", "fault": "dead", "after": 12},
    {"device": "arm", "fault": "alarm", "after": 1, "value": 1},
    {"device": "arm", "fault": "reset", "after": 1},
    {"device": "arm", "fault": "homing-alarm", "value": 9},
    {"device": "arm", "fault": "error", "after": 8, "value": 3},
    {"device": "arm", "fault": "dead", "after": 8},
    {"device": "camera", "fault": "timeout", "after": 7},
    {"device": "camera", "fault": "short-frame", "after": 7},
    {"device": "camera", "fault": "incomplete", "after": 7},
    {"device": "camera", "fault": "stale-frame", "after": 7},
    {"device": "camera", "fault": "wrong-size", "after": 7},
    {"device": "camera", "fault": "wrong-exposure", "value": 1.5},
    {"device": "camera", "fault": "control-lost", "after": 17},
]


def photograph(folder: Path, faults: list[dict[str, Any]]) -> None:
    settings = read_rig(SOURCE)
    camera = {**settings["camera"], "rows": 16, "columns": 16, "focal_px": 200, "principal_px": [7.5, 7.5]}
    rig = {**settings, "camera": camera, "faults": faults}
    renderer = VirtualRig(rig, VirtualSphere(rig, "gold", 25.0, SOURCE))
    with emulated_rig(rig, renderer) as ready:
        capture(PLAN, "gold", ready, folder)


def named(fault: dict[str, Any]) -> str:
    return " ".join(str(value) for key, value in fault.items() if key in ("device", "fault", "value"))


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    folder = tmp_path_factory.mktemp("undisturbed")
    photograph(folder, [])
    return capture_content(folder)


@pytest.mark.parametrize("fault", HARMLESS, ids=named)
def test_what_a_driver_puts_up_with_leaves_no_trace(
    tmp_path: Path, undisturbed: dict[str, Any], fault: dict[str, Any]
) -> None:
    photograph(tmp_path, [fault])
    assert capture_content(tmp_path) == undisturbed


@pytest.mark.parametrize("fault", ENDING, ids=named)
def test_what_ends_a_run_is_said_in_a_line_and_the_next_run_goes_on(
    tmp_path: Path, undisturbed: dict[str, Any], fault: dict[str, Any]
) -> None:
    with pytest.raises(InstrumentError) as refused:
        photograph(tmp_path, [fault])
    assert "\n" not in str(refused.value)
    assert refused.value.source.startswith(fault["device"].replace("_", " "))
    kept = {path: path.read_bytes() for path in tmp_path.rglob("c.*.0.0")}
    photograph(tmp_path, [])
    assert capture_content(tmp_path) == undisturbed
    assert all(path.read_bytes() == before for path, before in kept.items())
