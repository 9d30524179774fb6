"""A material in front of the rig that a config names."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pbrdf.capture.rigs import require_drivers
from pbrdf.capture.run import capture
from pbrdf.errors import InputError
from pbrdf.instruments.rendered import RenderedRig
from pbrdf.instruments.virtual_rig import VirtualRig
from pbrdf.instruments.virtual_sphere import VirtualSphere, ambient_sphere
from pbrdf.settings.checked import read_checked
from pbrdf.settings.materials import read_materials, select
from pbrdf.settings.plan import CapturePlan, capture_plan
from pbrdf.settings.rig import read_rig


def capture_material(
    plan: CapturePlan,
    rig: dict[str, Any],
    source: str | Path,
    material: str,
    radius_mm: float,
    folder: str | Path,
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
    require_drivers(rig, source)
    sphere = VirtualSphere(rig, material, radius_mm, source)
    capture(plan, material, RenderedRig(VirtualRig(rig, sphere)), folder)


def capture_ambient(
    plan: CapturePlan,
    rig: dict[str, Any],
    source: str | Path,
    material: str,
    radius_mm: float,
    folder: str | Path,
) -> None:
    """Photograph a material's sphere under ambient light, from which its outline is told.

    Parameters
    ----------
    plan : CapturePlan
        `pbrdf.settings.targets.ambient_plan`.
    rig, source, material, radius_mm
        As `capture_material` has them.
    folder : str or Path
        ``captures/<material>/ambient``.

    Raises
    ------
    InputError
        If the rig has no drivers yet, or the plan contradicts frames already taken.
    """
    require_drivers(rig, source)
    sphere = ambient_sphere(rig, material, radius_mm, source)
    capture(plan, material, RenderedRig(VirtualRig(rig, sphere)), folder)


def capture_from_config(config: str | Path, names: Sequence[str], captures: str | Path) -> list[Path]:
    """Photograph materials of a config's table, without the workflow.

    Parameters
    ----------
    config : str or Path
        The config's file; the paths in it are taken from the working folder.
    names : sequence of str
        Materials of its table whose source is the rig.
    captures : str or Path
        Folder of all captures.

    Returns
    -------
    list of Path
        The folder of each material's capture.

    Raises
    ------
    InputError
        If the config does not say how, or a name is not in the table.
    """
    settings = read_checked(config, "config")
    for field in ("rig", "plan"):
        if not settings.get(field):
            raise InputError(config, field, "is missing", "say what photographs what")
    rig = read_rig(settings["rig"])
    plan = capture_plan(settings["plan"], rig, config)
    chosen = select(
        read_materials(settings["materials"], settings["data"]), names, "pbrdf capture", "material"
    )
    folders = []
    for name, material in chosen.items():
        if material.source != "rig" or material.radius_mm is None:
            raise InputError(
                settings["materials"],
                f"{name}, source",
                f"is `{material.source}`",
                "name a sphere of the rig",
            )
        folders.append(Path(captures) / name)
        capture_material(plan, rig, settings["rig"], name, material.radius_mm, folders[-1])
    return folders
