"""A material in front of the rig."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pbrdf.capture.rigs import covered_by_hand, open_rig
from pbrdf.capture.run import capture
from pbrdf.capture.tasks import sphere_task
from pbrdf.instruments.virtual_rig import VirtualRig
from pbrdf.instruments.virtual_sphere import VirtualSphere, ambient_sphere
from pbrdf.settings.plan import CapturePlan


def capture_material(
    plan: CapturePlan,
    rig: dict[str, Any],
    source: str | Path,
    material: str,
    radius_mm: float,
    folder: str | Path,
    *,
    ambient: bool = False,
) -> None:
    """Carry out a plan on a rig that holds a material's sphere.

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
    ambient : bool
        Whether the room's light is on and the lamp off: from such a photograph the outline is told.

    Raises
    ------
    InputError
        If the rig's file does not say how it is driven, the plan is beyond its instruments, or contradicts
        frames already taken.
    InstrumentError
        If an instrument does not do what it should.
    """
    sphere = ambient_sphere if ambient else VirtualSphere
    with open_rig(
        rig,
        source,
        lambda: VirtualRig(rig, sphere(rig, material, radius_mm, source)),
        sphere_task(material, ambient=ambient),
    ) as ready:
        ready.require(plan)
        capture(plan, material, ready, folder, darks_at_ends=covered_by_hand(rig))
