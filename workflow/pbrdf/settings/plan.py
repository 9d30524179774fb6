"""What is to be photographed of a sphere: lights, bands, states and exposures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.optics.elements import IDEAL
from pbrdf.optics.polarimeter import Polarimeter

Float = NDArray[np.float64]

State = tuple[float, float, float, float]
"""Generator polariser, generator retarder, analyser retarder, analyser polariser; degrees."""

FILL = 0.8
"""Of saturation, where the plan does not say: the rest is for states that were not metered, and for noise."""

RETARDANCES, DIATTENUATION = 8, 0.5
"""Of the mirrors that `brightest_states` knows: steps of 45°, and how unlike two axes reflect. Twelve of
the published 36 states are metered then; their brightest has at least 89 % of what any mirror shows."""

HALF_TURN = 180.0
"""Lights beyond it show θd again that others show: tables do not average the two sides yet."""


@dataclass(frozen=True)
class Light:
    """A position of the arm; `id` names its folder and stays the same whatever else is planned."""

    id: str
    angle_deg: float


@dataclass(frozen=True)
class Metering:
    """How the exposures of a light are chosen by what the camera sees under it.

    Attributes
    ----------
    shortest_s : float
        No exposure is shorter, seconds.
    fill : float
        Share of saturation to which the shortest exposure brings the brightest part of the picture.
    """

    shortest_s: float
    fill: float


@dataclass(frozen=True)
class CapturePlan:
    """Every frame of a material is one of these lights, bands, states and exposures.

    Attributes
    ----------
    lights : tuple of Light
        Ascending by angle.
    bands_nm : tuple of int
        Ascending.
    states_deg : tuple of State
        Settings of the four elements, degrees.
    exposures_s : tuple of float
        Ascending, seconds; where they are metered, the longest that a light may get.
    darks : int
        Dark frames per exposure and light.
    references : tuple of int
        How many states were taken before each repeat of one of them, ascending: what tells how the
        lamp drifts.
    reference_state : int
        Which state is repeated; 0 without repeats.
    metering : Metering or None
        How far `exposures_s` are shortened, all by one factor, for all bands and states of a light alike.
    """

    lights: tuple[Light, ...]
    bands_nm: tuple[int, ...]
    states_deg: tuple[State, ...]
    exposures_s: tuple[float, ...]
    darks: int
    references: tuple[int, ...] = ()
    reference_state: int = 0
    metering: Metering | None = None

    def plain(self) -> dict[str, Any]:
        """As dicts, lists and numbers: workflows keep no other values of their parameters."""
        return {
            "lights_deg": [light.angle_deg for light in self.lights],
            "bands_nm": list(self.bands_nm),
            "states_deg": [list(state) for state in self.states_deg],
            "exposures_s": list(self.exposures_s),
            "darks": self.darks,
            "references": list(self.references),
            "reference_state": self.reference_state,
            "metering": None if self.metering is None else asdict(self.metering),
        }

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any]) -> CapturePlan:
        """Undo `plain`."""
        return cls(
            tuple(Light(light_id(angle), angle) for angle in plain["lights_deg"]),
            tuple(plain["bands_nm"]),
            tuple((gp, gr, ar, ap) for gp, gr, ar, ap in plain["states_deg"]),
            tuple(plain["exposures_s"]),
            plain["darks"],
            tuple(plain["references"]),
            plain["reference_state"],
            None if plain["metering"] is None else Metering(**plain["metering"]),
        )

    def frames_per_light(self) -> int:
        """Frames of one light, repeats and darks included."""
        states = len(self.states_deg) + len(self.references)
        return (len(self.bands_nm) * states + self.darks) * len(self.exposures_s)


def light_id(angle_deg: float) -> str:
    """Name of the arm's angle, to a hundredth of a degree: 41 → ``041.00``."""
    # adding zero turns −0 into 0
    return f"{angle_deg + 0.0:06.2f}"


def capture_plan(plan: dict[str, Any], rig: dict[str, Any], source: str | Path) -> CapturePlan:
    """Plan of a run, held against what the rig can do.

    Parameters
    ----------
    plan : dict
        The config's `plan`, checked against its schema.
    rig : dict
        The rig's file, checked against its schema.
    source : str or Path
        The config's file, for messages.

    Raises
    ------
    InputError
        If a band has no filter, an angle lies outside the arm's limits, a list is not ascending, a
        metered ladder does not fit between its ends, or a state is to be repeated more often than there
        are states.
    """
    lights = _lights(plan["lights_deg"])
    angles = [light.angle_deg for light in lights]
    low, high = rig["arm"]["limits_deg"] if "arm" in rig else (0.0, 360.0)
    outside = [angle for angle in angles if not low <= angle <= high]
    if outside:
        raise InputError(
            source,
            "plan.lights_deg",
            f"{outside[0]:g}° is beyond the arm's limits",
            f"stay in {low:g}…{high:g}°",
        )
    if angles and angles[-1] > HALF_TURN:
        raise InputError(
            source,
            "plan.lights_deg",
            f"{angles[-1]:g}° is beyond {HALF_TURN:g}°",
            "light the sphere from one side",
        )
    missing = [band for band in plan["bands_nm"] if band not in rig["filters_nm"]]
    if missing:
        has = ", ".join(f"{nm}" for nm in rig["filters_nm"])
        raise InputError(
            source, "plan.bands_nm", f"no filter passes {missing[0]} nm", f"the wheel has {has} nm"
        )
    exposures_s, metering = _exposures(plan["exposures_ms"], source)
    for field, values in (
        ("lights_deg", [round(angle, 2) for angle in angles]),
        ("bands_nm", plan["bands_nm"]),
        ("exposures_ms", exposures_s),
    ):
        if any(b <= a for a, b in pairwise(values)):
            raise InputError(
                source, f"plan.{field}", "does not ascend strictly", "sort it and drop what is doubled"
            )
    states = _states(plan["states"])
    if plan["references"] > len(states):
        raise InputError(
            source,
            "plan.references",
            f"{plan['references']} repeats are more than the {len(states)} states between them",
            "repeat the state less often",
        )
    return CapturePlan(
        lights=lights,
        bands_nm=tuple(plan["bands_nm"]),
        states_deg=states,
        exposures_s=exposures_s,
        darks=plan["darks"],
        references=_references(plan["references"], len(states)),
        reference_state=bright_state(states) if plan["references"] else 0,
        metering=metering,
    )


def bright_state(states_deg: Sequence[State]) -> int:
    """Number of the state that no known element makes dark: of air, mirror and polarisers.

    The dimmest of them is the brightest that the states offer, over its M00 and for ideal quarter-wave
    retarders; the first such state if there are several.
    """
    mirror = np.diag([1.0, 1.0, -1.0, -1.0])
    return int(np.argmax(np.min(_light(states_deg, (mirror, *IDEAL.values())), axis=0)))


def brightest_states(states_deg: Sequence[State]) -> tuple[int, ...]:
    """Numbers of the states each of which shows some known element brightest, ascending.

    Those are air, polarisers, what depolarises, and mirrors of all retardances that reflect one axis more
    than the other, as dielectrics and metals do; ideal quarter-wave retarders. The brightest of these states
    is nearly the brightest of all.
    """
    depolariser = np.diag([1.0, 0.0, 0.0, 0.0])
    mirrors = [
        _mirror(sign * DIATTENUATION, 2 * np.pi * turn / RETARDANCES)
        for turn in range(RETARDANCES)
        for sign in (-1.0, 1.0)
    ]
    brightest = np.argmax(_light(states_deg, (depolariser, *IDEAL.values(), *mirrors)), axis=1)
    return tuple(sorted({int(state) for state in brightest}))


def _light(states_deg: Sequence[State], elements: Sequence[Float]) -> Float:
    """What ideal states pass of elements over their M00, (elements, states)."""
    weights = Polarimeter(np.pi / 2, np.pi / 2).measurement_matrix(np.deg2rad(states_deg))
    # states that are equal by symmetry differ in their last bits
    return np.array([np.round(weights @ (element / element[0, 0]).ravel(), 9) for element in elements])


def _mirror(diattenuation: float, retardance: float) -> Float:
    """Mueller matrix of a mirror that reflects one axis more than the other and retards it, radians."""
    both = (1.0 - diattenuation**2) ** 0.5
    c, s, d = both * np.cos(retardance), both * np.sin(retardance), diattenuation
    return np.array([[1.0, d, 0, 0], [d, 1.0, 0, 0], [0, 0, c, s], [0, 0, -s, c]])


def _exposures(
    spec: Sequence[float] | Mapping[str, Any], source: str | Path
) -> tuple[tuple[float, ...], Metering | None]:
    """Exposures, s, and how they are metered if they are."""
    if not isinstance(spec, Mapping):
        return tuple(ms / 1000.0 for ms in spec), None
    count, ratio = spec["count"], float(spec["ratio"])
    first = spec["longest"] / ratio ** (count - 1)
    if first < spec["shortest"]:
        raise InputError(
            source,
            "plan.exposures_ms",
            f"{count} exposures, each {ratio:g} times the one before, do not fit between "
            f"{spec['shortest']:g} and {spec['longest']:g} ms",
            "plan fewer of them, a smaller ratio or a wider range",
        )
    longest_s = spec["longest"] / 1000.0
    ladder = tuple(longest_s / ratio**step for step in reversed(range(count)))
    return ladder, Metering(spec["shortest"] / 1000.0, spec.get("fill", FILL))


def _lights(spec: list[float] | dict[str, Any]) -> tuple[Light, ...]:
    if isinstance(spec, dict):
        spec = [float(angle) for angle in np.linspace(spec["first"], spec["last"], spec["count"])]
    return tuple(Light(light_id(angle), round(float(angle), 2)) for angle in spec)


def _states(spec: list[list[float]] | dict[str, Any]) -> tuple[State, ...]:
    """A list as it is, or crossed polarisers with the generator's retarder turning `ratio` times as fast."""
    if isinstance(spec, dict):
        step, ratio = float(spec["step_deg"]), float(spec["ratio"])
        return tuple((0.0, (n * step * ratio) % 360.0, n * step, 90.0) for n in range(spec["count"]))
    return tuple((float(gp), float(gr), float(ar), float(ap)) for gp, gr, ar, ap in spec)


def _references(count: int, states: int) -> tuple[int, ...]:
    """States before each of `count` repeats, evenly spread: the first before all, the last after all.

    A single repeat follows the last state. Between them the lamp's power is known by interpolation alone.
    """
    if count == 1:
        return (states,)
    return tuple(repeat * states // (count - 1) for repeat in range(count))
