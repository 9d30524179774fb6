"""The emulated rotary stage is taken for a real one by QMI, pylablib and thorlabs-apt-protocol."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from pbrdf.instruments.apt_messages import (
    CHANNEL,
    Homing,
    Id,
    Message,
    Velocity,
    encode_number,
    microsteps,
)
from pbrdf.instruments.emulators.clock import ScaledClock, VirtualClock
from pbrdf.instruments.emulators.faults import Faults
from pbrdf.instruments.emulators.k10cr1 import K10CR1Emulator
from pbrdf.instruments.emulators.server import PtyServer, SocketServer

Session = Callable[..., dict[str, Any]]
ON_CHANNEL = {"chan_ident": CHANNEL}
ORDERS: list[tuple[str, dict[str, int], Message]] = [
    ("hw_req_info", {}, Message(Id.HW_REQ_INFO)),
    ("hw_start_updatemsgs", {}, Message(Id.HW_START_UPDATES)),
    ("hw_stop_updatemsgs", {}, Message(Id.HW_STOP_UPDATES)),
    ("hw_no_flash_programming", {}, Message(Id.HW_NO_FLASH_PROGRAMMING)),
    ("mod_identify", ON_CHANNEL, Message(Id.IDENTIFY, CHANNEL)),
    ("mod_set_chanenablestate", ON_CHANNEL | {"enable_state": 1}, Message(Id.CHANNEL_SET, CHANNEL, 1)),
    ("mod_req_chanenablestate", ON_CHANNEL, Message(Id.CHANNEL_REQ, CHANNEL)),
    ("mot_move_home", ON_CHANNEL, Message(Id.MOVE_HOME, CHANNEL)),
    ("mot_move_stop", ON_CHANNEL | {"stop_mode": 2}, Message(Id.MOVE_STOP, CHANNEL, 2)),
    ("mot_req_poscounter", ON_CHANNEL, Message(Id.POSITION_REQ, CHANNEL)),
    ("mot_req_statusupdate", ON_CHANNEL, Message(Id.STATUS_REQ, CHANNEL)),
    ("mot_req_velparams", ON_CHANNEL, Message(Id.VELOCITY_REQ, CHANNEL)),
    ("mot_req_homeparams", ON_CHANNEL, Message(Id.HOMING_REQ, CHANNEL)),
    ("mot_req_genmoveparams", ON_CHANNEL, Message(Id.BACKLASH_REQ, CHANNEL)),
    (
        "mot_move_absolute",
        ON_CHANNEL | {"position": -12_288_000},
        Message(Id.MOVE_ABSOLUTE, payload=encode_number(microsteps(-90.0))),
    ),
    (
        "mot_move_relative",
        ON_CHANNEL | {"distance": 409_600},
        Message(Id.MOVE_RELATIVE, payload=encode_number(microsteps(3.0))),
    ),
    (
        "mot_set_poscounter",
        ON_CHANNEL | {"position": 7},
        Message(Id.POSITION_SET, payload=encode_number(7)),
    ),
    (
        "mot_set_genmoveparams",
        ON_CHANNEL | {"backlash_distance": 136_533},
        Message(Id.BACKLASH_SET, payload=encode_number(microsteps(1.0))),
    ),
    (
        "mot_set_velparams",
        ON_CHANNEL | {"min_velocity": 0, "acceleration": 15_020, "max_velocity": 73_300_775},
        Message(Id.VELOCITY_SET, payload=Velocity.of(10.0, 10.0).encode()),
    ),
    (
        "mot_set_homeparams",
        ON_CHANNEL
        | {"home_dir": 2, "limit_switch": 1, "home_velocity": 73_300_775, "offset_distance": 546_133},
        Message(Id.HOMING_SET, payload=Homing.of(10.0, 4.0).encode()),
    ),
]


def answers() -> bytes:
    """All that the stage says on the way through a short life."""
    clock, faults = VirtualClock(), Faults([{"fault": "completed-short"}, {"fault": "long-update"}])
    stage = K10CR1Emulator(clock, faults, error_usteps=0.0)

    def say(number: Id, param1: int = CHANNEL, payload: bytes = b"") -> bytes:
        return stage.receive(Message(number, param1, payload=payload).encode())

    def after(seconds: float) -> bytes:
        clock.sleep(seconds)
        return stage.due()

    order = encode_number(microsteps(90.0))
    return b"".join(
        (
            say(Id.HW_REQ_INFO, 0),
            say(Id.CHANNEL_REQ),
            say(Id.MOVE_HOME) + after(60.0),
            say(Id.MOVE_ABSOLUTE, payload=order) + after(60.0),
            say(Id.MOVE_ABSOLUTE, payload=encode_number(0)) + after(60.0),
            say(Id.STATUS_REQ) + say(Id.STATUS_REQ) + say(Id.STATUS_BITS_REQ) + say(Id.POSITION_REQ),
            say(Id.VELOCITY_REQ) + say(Id.HOMING_REQ) + say(Id.BACKLASH_REQ),
            say(Id.JOG_REQ) + say(Id.LIMITS_REQ),
            say(Id.MOVE_ABSOLUTE, payload=order) + after(5.0) + say(Id.STATUS_REQ) + say(Id.MOVE_STOP),
        )
    )


@pytest.fixture(scope="module")
def decoded(session: Session) -> dict[str, Any]:
    rubbish = bytes.fromhex("81 04 0e 00 ff 50 01")
    task = {
        "orders": [[name, fields] for name, fields, _ in ORDERS],
        "answers": (rubbish + answers()).hex(),
    }
    return session("session_bytes.py", said=task)


def test_orders_are_the_bytes_of_thorlabs_apt_protocol(decoded: dict[str, Any]) -> None:
    assert decoded["orders"] == [message.encode().hex() for _, _, message in ORDERS]


def test_thorlabs_apt_protocol_understands_every_answer(decoded: dict[str, Any]) -> None:
    assert [answer["msg"] for answer in decoded["answers"]] == [
        "hw_get_info",
        "mod_get_chanenablestate",
        "mot_move_homed",
        "mot_move_completed",
        "mot_move_completed",
        "mot_get_statusupdate",
        "mot_get_statusupdate",
        "mot_get_statusbits",
        "mot_get_poscounter",
        "mot_get_velparams",
        "mot_get_homeparams",
        "mot_get_genmoveparams",
        "mot_get_jogparams",
        "mot_get_limswitchparams",
        "mot_get_statusupdate",
        "mot_move_stopped",
    ]


def test_thorlabs_apt_protocol_reads_the_numbers_that_were_meant(decoded: dict[str, Any]) -> None:
    found = {answer["msg"]: answer for answer in decoded["answers"]}

    def fields(message: str, **expected: object) -> None:
        assert {name: found[message][name] for name in expected} == expected

    fields("hw_get_info", serial_number=55_000_488, model_number="K10CR1\0\0", type=16, nchs=1)
    assert found["hw_get_info"]["firmware_version"] == [2, 0, 3]
    fields("mod_get_chanenablestate", enabled=True)
    fields("mot_get_statusbits", homed=True, moving_forward=False, channel_enabled=True, error=False)
    fields("mot_get_statusupdate", moving_forward=True, moving_reverse=True, homed=True)
    assert found["mot_get_statusupdate"]["position"] == pytest.approx(microsteps(45.0), abs=2)
    fields("mot_get_poscounter", position=0)
    fields("mot_get_velparams", min_velocity=0, acceleration=15_020, max_velocity=73_300_775)
    fields("mot_get_homeparams", home_dir=2, limit_switch=1, offset_distance=546_133)
    fields("mot_get_genmoveparams", backlash_distance=136_533)
    fields("mot_move_stopped", position=found["mot_get_statusupdate"]["position"])


@pytest.fixture
def stage() -> K10CR1Emulator:
    return K10CR1Emulator(ScaledClock(50.0), Faults(), power_up_deg=300.0, seed=1)


def test_qmi_drives_the_stage_over_a_pseudo_terminal(session: Session, stage: K10CR1Emulator) -> None:
    with PtyServer(stage) as server:
        said = session("session_qmi.py", server.url)
    assert said["identity"] == ["K10CR1", 55_000_488]
    assert said["enabled"] == [False, True]
    assert said["homed"] == [False, True] and said["homing_seen"]
    assert said["homing"] == ["REVERSE", "REVERSE", pytest.approx(5.0), pytest.approx(4.0)]
    assert said["rates"] == pytest.approx([8.0, 15.0, 1.5], rel=1e-5)
    assert said["places"] == pytest.approx([90.0, -10.0, 400.0], abs=1e-3)
    assert said["moving"] and 0.0 < said["stopped"] < 400.0
    assert stage.angle_deg() == pytest.approx(said["stopped"] % 360.0)


def test_pylablib_drives_the_stage_over_a_socket(session: Session, stage: K10CR1Emulator) -> None:
    with SocketServer(stage) as server:
        said = session("session_pylablib.py", server.url)
    assert said["identity"] == ["K10CR1", 55_000_488, "2.0.3", 1]
    assert said["scale"] == [pytest.approx(409_600 / 3), "deg"]
    assert len(said["settings"]) == 5
    assert said["homed"] == [False, True]
    assert said["homing"] == ["reverse", "reverse", pytest.approx(10.0, rel=2e-4), pytest.approx(4.0)]
    assert said["rates"] == pytest.approx([0.0, 15.0, 8.0], rel=1e-3)
    assert said["backlash"] == pytest.approx([1.5], rel=1e-5)
    assert said["places"] == pytest.approx([90.0, -10.0, 400.0], abs=1e-3)
    assert said["status"] == ["moving_bk", "moving_fw", "homed", "enabled"]
    assert 0.0 < said["stopped"] < 400.0 and said["reference"] == pytest.approx(123.0, abs=1e-5)
    assert stage.angle_deg() == pytest.approx(said["stopped"] % 360.0)
