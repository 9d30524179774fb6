"""What a plan will cost, told before it is carried out."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from pbrdf.instruments.interface import FrameFormat
from pbrdf.instruments.movement import travel_time
from pbrdf.settings.plan import CapturePlan, State, brightest_states
from pbrdf.settings.room import COMPRESSED, told

STAGE_DEG_S, STAGE_DEG_S2 = 10.0, 10.0
"""Of the rotary stages that carry the retarders."""

ARM_DEG_S, ARM_DEG_S2 = 10.0, 20.0
WHEEL_S = 3.0
FRAME_S = 0.25
"""Besides its exposure: to read it out, check and store it."""


@dataclass(frozen=True)
class Preview:
    """Cost of a plan on instruments like the paper's.

    Attributes
    ----------
    frames : int
    hours : float
        With nothing in the way: no frame is there yet, and no operator is asked. Of metered exposures, the
        longest that there may be.
    gigabytes : float
        Compressed.
    free_gigabytes : float
        On the disk that they are to go to.
    metered : bool
        Whether exposures are metered.
    """

    frames: int
    hours: float
    gigabytes: float
    free_gigabytes: float
    metered: bool

    def __str__(self) -> str:
        """In a line, with units."""
        room = "" if self.gigabytes <= self.free_gigabytes else ": too little"
        hours = f"{'at most' if self.metered else 'about'} {self.hours:.2g} h"
        exposures = ", exposures metered" if self.metered else ""
        return (
            f"{self.frames} frames, {hours} on instruments like the paper's, "
            f"{told(1e9 * self.gigabytes)} of {told(1e9 * self.free_gigabytes)} free{room}{exposures}"
        )


def preview(plan: CapturePlan, form: FrameFormat, folder: str | Path) -> Preview:
    """Tell what a plan will cost.

    Parameters
    ----------
    plan : CapturePlan
    form : FrameFormat
        Of the camera.
    folder : str or Path
        Where the frames will go; it need not exist yet.
    """
    frames = len(plan.lights) * plan.frames_per_light()
    words = form.rows * form.columns * (1 if form.dtype == "uint8" else 2)
    place = Path(folder).absolute()
    existing = next(path for path in (place, *place.parents) if path.exists())
    return Preview(
        frames,
        sum(_light_seconds(plan)) / 3600.0,
        COMPRESSED * frames * words / 1e9,
        shutil.disk_usage(existing).free / 1e9,
        plan.metering is not None,
    )


def _light_seconds(plan: CapturePlan) -> Iterator[float]:
    """Seconds of each light."""
    exposures = sum(FRAME_S + exposure_s for exposure_s in plan.exposures_s)
    order = list(plan.states_deg)
    for before in reversed(plan.references):
        order.insert(before, plan.states_deg[plan.reference_state])
    band = WHEEL_S + _turning(order) + len(order) * exposures
    if plan.metering is not None:
        metered = [plan.states_deg[state] for state in brightest_states(plan.states_deg)]
        band += WHEEL_S + _turning(metered) + len(metered) * (FRAME_S + plan.exposures_s[0])
    angles = [light.angle_deg for light in plan.lights]
    for step in (0.0, *(b - a for a, b in pairwise(angles))):
        yield travel_time(step, ARM_DEG_S, ARM_DEG_S2) + len(plan.bands_nm) * band + plan.darks * exposures


def _turning(states_deg: Sequence[State]) -> float:
    """Seconds in which both retarders go from state to state."""
    return sum(
        max(travel_time(_shorter(b[part] - a[part]), STAGE_DEG_S, STAGE_DEG_S2) for part in (1, 2))
        for a, b in pairwise(states_deg)
    )


def _shorter(degrees: float) -> float:
    """The shorter way round."""
    return (degrees + 180.0) % 360.0 - 180.0
