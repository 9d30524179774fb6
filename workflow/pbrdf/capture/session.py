"""Targets of a calibration session in the rig that a config names.

They are captured as materials are, in ``captures/_sessions/<session>/<target>``.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pbrdf.capture.rigs import covered_by_hand, open_rig
from pbrdf.capture.run import capture
from pbrdf.capture.tasks import task
from pbrdf.errors import InputError
from pbrdf.instruments.virtual_beam import VirtualBeam
from pbrdf.instruments.virtual_board import VirtualBoard
from pbrdf.instruments.virtual_chrome import VirtualChrome, chrome_ambient
from pbrdf.instruments.virtual_plane import VirtualField, VirtualTile
from pbrdf.instruments.virtual_rig import Subject, VirtualRig
from pbrdf.optics.elements import IDEAL
from pbrdf.settings.plan import CapturePlan
from pbrdf.settings.targets import AMBIENT, board_view


def virtual_target(
    target: str, rig: dict[str, Any], session: Mapping[str, Any], source: str | Path
) -> Subject:
    """What a virtual rig photographs for a target; for the parameters see `capture_target`."""
    if target in IDEAL:
        return VirtualBeam(rig, target, source)
    if target == "chrome":
        return VirtualChrome(rig, session["chrome"]["radius_mm"], source)
    if target == "chrome_ambient":
        return chrome_ambient(rig, session["chrome"]["radius_mm"], source)
    if target == "flat":
        return VirtualField(rig)
    if target == "spectralon":
        return VirtualTile(rig, session["spectralon"]["reflectance"])
    return VirtualBoard(rig, session["board"], board_view(target))


def capture_target(
    plan: CapturePlan,
    rig: dict[str, Any],
    source: str | Path,
    target: str,
    session: Mapping[str, Any],
    folder: str | Path,
) -> None:
    """Photograph a target of a session.

    Parameters
    ----------
    plan : CapturePlan
        The target's plan (`pbrdf.settings.targets.session_plans`).
    rig : dict
        The rig's file, checked against its schema.
    source : str or Path
        That file, for messages.
    target : str
        Name of one of those plans.
    session : mapping
        Of the config's `session`, checked against its schema, at least the target's own section.
    folder : str or Path
        ``captures/_sessions/<session>/<target>``.

    Raises
    ------
    InputError
        If the rig has no drivers yet, its arm does not reach a light, it does not say how the target
        looks, or the plan contradicts frames already taken.
    """
    low, high = rig["arm"]["limits_deg"] if "arm" in rig else (0.0, 360.0)
    for light in plan.lights:
        if light != AMBIENT and not low <= light.angle_deg <= high:
            raise InputError(
                source,
                "arm.limits_deg",
                f"are {low:g}…{high:g}°, and {target} is to be photographed at {light.angle_deg:g}°",
                "widen them if the arm can stand there",
            )
    with open_rig(
        rig, source, lambda: VirtualRig(rig, virtual_target(target, rig, session, source)), task(target)
    ) as ready:
        ready.require(plan)
        capture(plan, target, ready, folder, darks_at_ends=covered_by_hand(rig))
