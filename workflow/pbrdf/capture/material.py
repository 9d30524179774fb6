"""A material in front of the rig that a config names."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pbrdf.capture.run import capture
from pbrdf.errors import InputError
from pbrdf.instruments.virtual_rig import VirtualRig
from pbrdf.settings.plan import CapturePlan


def capture_material(
    plan: CapturePlan, rig: dict[str, Any], source: str | Path, material: str, radius_mm: float, folder: str | Path
) -> None:
    """Carry out a plan on a rig.

    Parameters
    ----------
    plan : CapturePlan
    rig : dict
        The rig's file, checked against its schema.
    source : str or Path
        That file, for messages.
    material : str
        Name of the material on the turntable.
    radius_mm : float
        Radius of its sphere.
    folder : str or Path
        ``captures/<material>``.

    Raises
    ------
    InputError
        If the rig has no drivers yet, or the plan contradicts frames already taken.
    """
    if rig["kind"] != "virtual":
        raise InputError(
            source, "kind", "drivers for a real rig do not exist yet", "write the frames with pbrdf.write_capture"
        )
    capture(plan, material, VirtualRig(rig, material, radius_mm, source), folder)
