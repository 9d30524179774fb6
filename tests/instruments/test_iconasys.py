from __future__ import annotations

import inspect
import sys
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pbrdf.errors import InstrumentError
from pbrdf.instruments.emulators.clock import VirtualClock
from pbrdf.instruments.iconasys import (
    DIRECTION,
    ENABLE,
    OUTPUTS,
    SAMPLE_HZ,
    STEP,
    IconasysTable,
    PulseDrive,
    step_times,
)
from pbrdf.instruments.manual import Operator
from pbrdf.instruments.movement import travel_time

URL = "ftdi://ftdi:232/1"
DRIVE = PulseDrive(100.0, 10.0, 5.0, (0.0, 180.0), run_up_deg=1.0, home_deg=5.0)


class _Chip:
    """pyftdi's GpioAsyncController, as far as it is used: the samples that its lines took."""

    made: list[_Chip]
    fails: Exception | None = None

    def __init__(self) -> None:
        self.samples = bytearray()
        self.opened: dict[str, Any] = {}
        self.closed = 0
        self.writes_left = sys.maxsize
        self.made.append(self)

    def configure(self, url: str, direction: int = 0, **kwargs: Any) -> None:
        if self.fails is not None:
            raise self.fails
        self.opened = {"url": url, "direction": direction, **kwargs}
        self.samples.append(kwargs["initial"])

    def write(self, out: bytes | bytearray | int) -> None:
        if self.writes_left == 0:
            raise OSError("device is gone")
        self.writes_left -= 1
        self.samples += bytes(out)

    def close(self, freeze: bool = False) -> None:
        self.closed += 1

    def steps(self) -> int:
        """Rising edges of the step line, counted by the direction line, while the motor is on."""
        lines = np.frombuffer(bytes(self.samples), np.uint8)
        rises = (lines[1:] & ~lines[:-1] & STEP) > 0
        assert np.all(lines[1:][rises] & ENABLE)
        return int(np.where(lines[1:][rises] & DIRECTION, 1, -1).sum())


class _UsbToolsError(Exception):
    """What pyftdi raises for a URL without a chip; no OSError."""


class _Person(Operator):
    asked = 0

    def ask(self, instrument: str, task: str) -> str:
        self.asked += 1
        return ""


Open = Callable[..., IconasysTable]


@pytest.fixture
def chip(monkeypatch: pytest.MonkeyPatch) -> type[_Chip]:
    class Fresh(_Chip):
        """A kind of its own for every test, since the kind lists what was made."""

    Fresh.made = []
    modules = {name: ModuleType(name) for name in ("pyftdi", "pyftdi.gpio", "pyftdi.usbtools")}
    vars(modules["pyftdi.gpio"])["GpioAsyncController"] = Fresh
    vars(modules["pyftdi.usbtools"])["UsbToolsError"] = _UsbToolsError
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    return Fresh


def _open(clock: VirtualClock | None = None, drive: PulseDrive = DRIVE) -> IconasysTable:
    return IconasysTable.open(URL, "table", clock or VirtualClock(), drive=drive, operator=_Person())


def test_the_chip_is_opened_with_three_outputs_and_the_motor_held(chip: type[_Chip]) -> None:
    with _open() as table:
        assert chip.made[0].opened == {
            "url": URL,
            "direction": OUTPUTS,
            "frequency": SAMPLE_HZ,
            "initial": ENABLE,
        }
        assert table.name == f"table at {URL}"
        assert table.identity.model == "Iconasys turntable, open loop"
    assert chip.made[0].closed == 1


def test_pulses_add_up_to_the_angle(chip: type[_Chip]) -> None:
    table = _open()
    table.home().wait()
    for angle in (90.0, 45.0, 45.5, 120.25):
        table.move_to(angle).wait()
        assert table.position_deg() == pytest.approx(angle, abs=0.5 / 100.0)
        assert chip.made[0].steps() == round((angle - 5.0) * 100.0)


def test_the_last_pulses_go_upwards(chip: type[_Chip]) -> None:
    table = _open()
    table.home().wait()
    table.move_to(90.0).wait()
    before = len(chip.made[0].samples)
    table.move_to(30.0).wait()
    lines = np.frombuffer(bytes(chip.made[0].samples[before:]), np.uint8)
    rises = np.flatnonzero((lines[1:] & ~lines[:-1] & STEP) > 0) + 1
    assert np.all(lines[rises[-100:]] & DIRECTION)
    assert not np.any(lines[rises[:-100]] & DIRECTION)
    assert len(rises) == 6100 + 100


def test_a_movement_lasts_as_long_as_its_samples(chip: type[_Chip]) -> None:
    clock = VirtualClock()
    table = _open(clock)
    table.home().wait()
    table.move_to(50.0).wait()
    before = len(chip.made[0].samples)
    begun = clock.now()
    table.move_to(90.0).wait()
    assert clock.now() - begun == pytest.approx(travel_time(40.0, 10.0, 5.0), abs=1e-9)
    samples = len(chip.made[0].samples) - before
    assert samples / SAMPLE_HZ == pytest.approx(clock.now() - begun, abs=1e-3)


@given(st.integers(1, 3000), st.floats(50.0, 2000.0), st.floats(100.0, 5000.0))
def test_steps_follow_the_ramp(count: int, speed: float, acceleration: float) -> None:
    times = step_times(count, speed, acceleration)
    total = travel_time(count, speed, acceleration)
    assert times.shape == (count,)
    assert times[0] > 0.0
    assert times[-1] < total
    np.testing.assert_allclose(times + times[::-1], total, rtol=1e-9)
    if count > 1:
        assert np.diff(times).min() >= (1.0 - 1e-9) / speed


def test_an_angle_beyond_the_limits_makes_no_pulse(chip: type[_Chip]) -> None:
    table = _open()
    table.home().wait()
    before = bytes(chip.made[0].samples)
    for angle in (-1.0, 0.5, 180.1):
        with pytest.raises(InstrumentError, match=r"angle: .* within 0° to 180°; choose"):
            table.move_to(angle)
    assert bytes(chip.made[0].samples) == before


def test_the_motor_is_free_while_the_operator_puts_the_arm_at_its_zero(chip: type[_Chip]) -> None:
    table = _open()
    with pytest.raises(InstrumentError, match="its zero is not known; home it first"):
        table.move_to(90.0)
    table.home().wait()
    assert bytes(chip.made[0].samples) == bytes([ENABLE, 0, ENABLE])
    assert table.position_deg() == 5.0


def test_a_chip_that_fails_in_mid_move_leaves_the_angle_unknown(chip: type[_Chip]) -> None:
    table = _open()
    table.home().wait()
    chip.made[0].writes_left = 3
    with pytest.raises(
        InstrumentError, match=r"pulses: could not be sent \(device is gone\); see to its cable"
    ):
        table.move_to(90.0)
    with pytest.raises(InstrumentError, match="home it first"):
        table.position_deg()


def test_an_interrupted_movement_leaves_the_angle_unknown(
    chip: type[_Chip], monkeypatch: pytest.MonkeyPatch
) -> None:
    table = _open()
    table.home().wait()

    def interrupt(out: bytes) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(chip.made[0], "write", interrupt)
    with pytest.raises(KeyboardInterrupt):
        table.move_to(90.0)
    with pytest.raises(InstrumentError, match="home it first"):
        table.position_deg()


@pytest.mark.parametrize(
    "failure", [OSError("no device"), ValueError("no backend"), _UsbToolsError("bad URL")]
)
def test_a_chip_that_is_not_there_is_named(chip: type[_Chip], failure: Exception) -> None:
    chip.fails = failure
    with pytest.raises(InstrumentError, match=rf"table at {URL}: port: cannot be opened \({failure}\); see"):
        _open()


def test_without_pyftdi_there_is_a_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyftdi.gpio", None)
    with pytest.raises(InstrumentError, match=r"pyftdi: is not installed; install it: pip install pyftdi"):
        _open()


def test_a_table_too_fast_for_the_samples_is_refused(chip: type[_Chip]) -> None:
    with pytest.raises(InstrumentError, match="speed: is too high for the pulses"):
        _open(drive=PulseDrive(1000.0, 10.0, 5.0, (0.0, 180.0)))


def test_the_fake_has_the_interface_of_pyftdi() -> None:
    gpio = pytest.importorskip("pyftdi.gpio", reason="pyftdi is not installed: pip install pyftdi")
    for method in ("configure", "write", "close"):
        real = inspect.signature(getattr(gpio.GpioAsyncController, method)).parameters
        fake = inspect.signature(getattr(_Chip, method)).parameters
        assert list(real)[: len(fake)] == list(fake)
