"""Targets of a calibration session in the rig that a config names.

They are captured as materials are, in ``captures/_sessions/<session>/<target>``.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from pbrdf.capture.rigs import require_drivers
from pbrdf.capture.run import capture
from pbrdf.errors import InputError
from pbrdf.instruments.virtual_beam import VirtualBeam
from pbrdf.instruments.virtual_rig import Subject, VirtualRig
from pbrdf.optics.elements import IDEAL
from pbrdf.settings.plan import CapturePlan


def _in_the_beam(element: str, rig: dict[str, Any], source: str | Path) -> Subject:
    return VirtualBeam(rig, element, source)


VIRTUAL_TARGETS: dict[str, Callable[[dict[str, Any], str | Path], Subject]] = {
    element: partial(_in_the_beam, element) for element in IDEAL
}
"""By name of the target: what a virtual rig, given with the name of its file, photographs for it."""


def capture_target(
    plan: CapturePlan, rig: dict[str, Any], source: str | Path, target: str, folder: str | Path
) -> None:
    """Photograph a target of a session.

    Parameters
    ----------
    plan : CapturePlan
        The target's plan (`pbrdf.settings.targets.target_plan`).
    rig : dict
        The rig's file, checked against its schema.
    source : str or Path
        That file, for messages.
    target : str
        One of `VIRTUAL_TARGETS`.
    folder : str or Path
        ``captures/_sessions/<session>/<target>``.

    Raises
    ------
    InputError
        If the rig has no drivers yet, its arm does not reach a light, it does not say how the target
        looks, or the plan contradicts frames already taken.
    """
    require_drivers(rig, source)
    low, high = rig["arm"]["limits_deg"] if "arm" in rig else (0.0, 360.0)
    for light in plan.lights:
        if not low <= light.angle_deg <= high:
            raise InputError(
                source,
                "arm.limits_deg",
                f"are {low:g}…{high:g}°, and {target} is to be photographed at {light.angle_deg:g}°",
                "widen them if the arm can stand there",
            )
    capture(plan, target, VirtualRig(rig, VIRTUAL_TARGETS[target](rig, source)), folder)
