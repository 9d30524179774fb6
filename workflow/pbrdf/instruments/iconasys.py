"""An Iconasys Platinum turntable: a stepper driver on three lines of an FTDI chip in bit-bang mode.

It has neither a switch nor an encoder nor a protocol: the host makes every pulse, and the angle is a count
of pulses. Source: Iconasys, "Turntable SDK Usage For Testing Stepper Motors" (DB0 enables the motor, DB1 is
its direction, DB2 its steps); levels and the steps of a turn are not told there. Not tried on a table: the
tests hold it against pyftdi's interface alone. Needs the package pyftdi.
"""

from __future__ import annotations

import importlib
import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from pbrdf.errors import InstrumentError
from pbrdf.instruments.clock import Clock
from pbrdf.instruments.kinds import Identity, Rotator
from pbrdf.instruments.manual import Operator
from pbrdf.instruments.movement import Movement, travel_time

ENABLE, DIRECTION, STEP = 0x01, 0x02, 0x04
OUTPUTS = ENABLE | DIRECTION | STEP

SAMPLE_HZ = 20000
"""Samples that the chip puts on its lines in a second."""

PULSE_SAMPLES = 2
"""Samples for which a step lasts: 0.1 ms."""

PIECE = 5000
"""Samples that are handed over at once: a stop is heeded after so many."""


@dataclass(frozen=True)
class PulseDrive:
    """How the table is driven.

    Attributes
    ----------
    steps_per_deg : float
        Pulses for a degree of the table, from its advanced settings.
    speed_deg_s, acceleration_deg_s2 : float
    limits_deg : tuple of float
        Least and greatest angle of the arm that hits nothing.
    run_up_deg : float
        How far below its target the arm turns back where it comes from above.
    home_deg : float
        Where the operator puts the arm to begin with.
    """

    steps_per_deg: float
    speed_deg_s: float
    acceleration_deg_s2: float
    limits_deg: tuple[float, float]
    run_up_deg: float = 1.0
    home_deg: float = 0.0


class IconasysTable(Rotator):
    """A table; `open` makes one. Its angles mean something after `home` alone.

    Parameters
    ----------
    chip : object
        pyftdi's ``GpioAsyncController``, configured.
    name : str
        What it is, and its port.
    clock : Clock
    drive : PulseDrive
    operator : Operator
        Who puts the arm where it begins.
    """

    def __init__(self, chip: Any, name: str, clock: Clock, drive: PulseDrive, operator: Operator) -> None:
        self.name, self.identity = name, Identity("Iconasys turntable, open loop", "", "")
        self._chip, self._clock = chip, clock
        self._drive, self._operator = drive, operator
        self._steps: int | None = None
        self._rising = False

    @classmethod
    def open(cls, url: str, name: str, clock: Clock, *, drive: PulseDrive, operator: Operator) -> Self:
        """Open the chip, with the motor held and no step made.

        Parameters
        ----------
        url : str
            As pyftdi names chips: ``ftdi://ftdi:232/1``.
        name : str
        clock : Clock
        drive : PulseDrive
        operator : Operator

        Raises
        ------
        InstrumentError
            If pyftdi is not installed, or the chip is not there, or the table is too fast for the samples.
        """
        full = f"{name} at {url}"
        if drive.speed_deg_s * drive.steps_per_deg * 2 * PULSE_SAMPLES > SAMPLE_HZ:
            raise InstrumentError(full, "speed", "is too high for the pulses", "lower it in the rig file")
        try:
            gpio = importlib.import_module("pyftdi.gpio")
            usb = importlib.import_module("pyftdi.usbtools")
        except ModuleNotFoundError:
            raise InstrumentError(
                full, "pyftdi", "is not installed", "install it: pip install pyftdi"
            ) from None
        chip = gpio.GpioAsyncController()
        try:
            chip.configure(url, direction=OUTPUTS, frequency=SAMPLE_HZ, initial=ENABLE)
        except (OSError, ValueError, usb.UsbToolsError) as error:
            raise InstrumentError(
                full,
                "port",
                f"cannot be opened ({error})",
                "see that it is plugged in, that no other program has it, and that its udev rule is set",
            ) from None
        return cls(chip, full, clock, drive, operator)

    def home(self) -> Movement:
        """Free the motor, ask the operator to put the arm where it begins, and hold it there."""
        self._steps = None
        self._rising = False
        self._chip.write(bytes([0]))
        self._operator.ask(self.name, f"Turn the arm to {self._drive.home_deg:g}°, from lower angles.")
        self._chip.write(bytes([ENABLE]))
        self._steps = 0
        return self._movement("search for zero", 0.0)

    def move_to(self, angle_deg: float) -> Movement:
        """Turn, in the end from lower angles; returns when all pulses are handed over.

        Raises
        ------
        InstrumentError
            If the arm may not go there or could not come from below, or its place is not known; if the chip
            fails, after which its place is not known.
        """
        begun, seconds = self._clock.now(), 0.0
        for target in self._targets(angle_deg):
            steps = target - self._counted()
            self._send(steps)
            seconds += self._seconds(steps)
        self._rising = True
        return self._movement(f"move to {angle_deg:.3f}°", max(0.0, begun + seconds - self._clock.now()))

    def position_deg(self) -> float:
        """Where the pulses should have brought it: nothing is read back."""
        return self._drive.home_deg + self._counted() / self._drive.steps_per_deg

    def stop(self) -> None:
        """Nothing to do: pulses that have been handed over cannot be called back."""

    def close(self) -> None:
        """Let go of the chip; may be called twice."""
        self._chip.close()

    def _targets(self, angle_deg: float) -> list[int]:
        """Counts at which it stops on the way."""
        drive = self._drive
        low, high = drive.limits_deg
        below = angle_deg - drive.run_up_deg
        here = self._counted()
        target = self._count(angle_deg)
        direct = self._rising and target >= here
        if not (low if direct else low + drive.run_up_deg) <= angle_deg <= high:
            raise InstrumentError(
                self.name,
                "angle",
                f"{angle_deg:g}° cannot be reached from below within {low:g}° to {high:g}°",
                "choose one where it hits nothing",
            )
        return [target] if direct else [self._count(below), target]

    def _count(self, angle_deg: float) -> int:
        return round((angle_deg - self._drive.home_deg) * self._drive.steps_per_deg)

    def _counted(self) -> int:
        if self._steps is None:
            raise InstrumentError(self.name, "angle", "its zero is not known", "home it first")
        return self._steps

    def _seconds(self, steps: int) -> float:
        way = steps / self._drive.steps_per_deg
        return travel_time(way, self._drive.speed_deg_s, self._drive.acceleration_deg_s2)

    def _send(self, steps: int) -> None:
        """Make so many steps, downward if negative; an interruption leaves the place unknown."""
        before, self._steps = self._counted(), None
        try:
            for piece in self._pieces(steps):
                self._chip.write(piece)
        except OSError as error:
            raise InstrumentError(
                self.name, "pulses", f"could not be sent ({error})", "see to its cable, then home it"
            ) from None
        self._steps = before + steps

    def _pieces(self, steps: int) -> Iterator[bytes]:
        level = ENABLE | (DIRECTION if steps > 0 else 0)
        times = step_times(
            abs(steps),
            self._drive.speed_deg_s * self._drive.steps_per_deg,
            self._drive.acceleration_deg_s2 * self._drive.steps_per_deg,
        )
        first = np.rint(times * SAMPLE_HZ).astype(np.int64)
        end = round(self._seconds(steps) * SAMPLE_HZ) + PULSE_SAMPLES
        for begin in itertools.count(0, PIECE):
            if begin >= end:
                return
            samples = np.full(min(PIECE, end - begin), level, np.uint8)
            for late in range(PULSE_SAMPLES):
                at = first + late - begin
                samples[at[(at >= 0) & (at < samples.size)]] |= STEP
            yield samples.tobytes()

    def _movement(self, what: str, expected_s: float) -> Movement:
        return Movement(self._clock, self.name, what, expected_s, lambda: True, self.stop)


def step_times(count: int, speed: float, acceleration: float) -> NDArray[np.float64]:
    """When each step of a travel is made, so that speed rises and falls evenly.

    Parameters
    ----------
    count : int
        Steps.
    speed, acceleration : float
        At most so many steps/s and steps/s².

    Returns
    -------
    ndarray, shape (count,)
        Seconds from the start, each step at the middle of its way.
    """
    way = np.arange(count) + 0.5
    ramp = min(speed * speed / (2.0 * acceleration), 0.5 * count)
    top = np.sqrt(2.0 * acceleration * ramp)
    times: NDArray[np.float64] = np.sqrt(2.0 * way / acceleration)
    even = way > ramp
    times[even] = top / acceleration + (way[even] - ramp) / top
    falling = way > count - ramp
    left = count - way[falling]
    times[falling] = travel_time(count, speed, acceleration) - np.sqrt(2.0 * left / acceleration)
    return times
