"""Exposures of a light, chosen by what the camera sees under it."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count, product
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from pbrdf.instruments.interface import Rig, Setting
from pbrdf.settings.plan import CapturePlan, Light, Metering, brightest_states

STEP = 4.0
"""From one exposure to the next on the way to one that tells: from saturation it ends above `LEAST`."""

LEAST = 1.0 / 8.0
"""Share of saturation from which on the dark level is no matter."""

MEDIAN_PX = 3
"""Side of the square within which most pixels must be bright for it to count: hot ones are alone."""


def metered_ladder(
    plan: CapturePlan, metering: Metering, dn_per_s: float, saturation: float
) -> tuple[float, ...]:
    """Exposures of a light, ascending, s.

    Parameters
    ----------
    plan : CapturePlan
        Its `exposures_s` are shortened by one factor, for the first to bring the brightest part to
        `metering.fill` of saturation.
    metering : Metering
        The plan's.
    dn_per_s : float
        Of `brightest_part`.
    saturation : float
        DN.
    """
    longest_s = plan.exposures_s[0]
    wanted_s = metering.fill * saturation / dn_per_s if dn_per_s > 0 else longest_s
    # three digits are told apart from noise, and read well
    first_s = min(max(float(f"{wanted_s:.3g}"), metering.shortest_s), longest_s)
    return tuple(round(first_s * exposure_s / longest_s, 9) for exposure_s in plan.exposures_s)


def brightest_part(
    plan: CapturePlan, metering: Metering, light: Light, rig: Rig, before_frame: Callable[[], None]
) -> float:
    """How bright the brightest part of the picture is in any band and state of a light, DN/s.

    Of the states those are looked at that show some known element brightest. An area that is saturated at
    the shortest exposure counts as just saturated, a pixel that is brighter than its neighbours as these.

    Parameters
    ----------
    plan : CapturePlan
    metering : Metering
        The plan's.
    light : Light
    rig : Rig
    before_frame : callable
        Called before each frame; what it raises ends the metering.
    """
    saturation, number = rig.frame_format.saturation, count()
    exposure_s, brightest = metering.shortest_s, 0.0

    def level(band_nm: int, state: int) -> float:
        before_frame()
        frame_id = f"{light.id}/meter/{next(number)}"
        setting = Setting(light, band_nm, plan.states_deg[state], exposure_s, 0)
        return bright_level(rig.expose(frame_id, setting).frame)

    for band_nm, state in product(plan.bands_nm, brightest_states(plan.states_deg)):
        seen = level(band_nm, state)
        while seen >= saturation and exposure_s > metering.shortest_s:
            exposure_s = max(exposure_s / STEP, metering.shortest_s)
            seen = level(band_nm, state)
        # what stays dark where others were bright is not the brightest
        while max(seen, brightest * exposure_s) < LEAST * saturation and exposure_s < plan.exposures_s[0]:
            exposure_s = min(STEP * exposure_s, plan.exposures_s[0])
            seen = level(band_nm, state)
        brightest = max(brightest, seen / exposure_s)
    return brightest


def bright_level(frame: NDArray[Any]) -> float:
    """Value of the brightest area of a frame, DN."""
    return float(np.max(cv2.medianBlur(np.ascontiguousarray(frame), MEDIAN_PX)))
