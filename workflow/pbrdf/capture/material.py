"""A material in front of the rig that a config names."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from pbrdf.capture.preview import Preview, preview
from pbrdf.capture.rig_check import check_rig
from pbrdf.capture.rigs import open_rig
from pbrdf.capture.run import capture
from pbrdf.capture.tasks import sphere_task
from pbrdf.errors import InputError
from pbrdf.instruments.open_rig import frame_format
from pbrdf.instruments.virtual_plane import VirtualField
from pbrdf.instruments.virtual_rig import VirtualRig
from pbrdf.instruments.virtual_sphere import VirtualSphere, ambient_sphere
from pbrdf.settings.checked import read_checked
from pbrdf.settings.materials import read_materials, select
from pbrdf.settings.plan import CapturePlan, capture_plan
from pbrdf.settings.rig import RigSettings, read_rig


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
        capture(plan, material, ready, folder)


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
    settings, rig, plan = _planned(config)
    folders = []
    for name, radius_mm in _spheres(settings, names).items():
        folders.append(Path(captures) / name)
        capture_material(plan, rig, settings["rig"], name, radius_mm, folders[-1])
    return folders


def previews(config: str | Path, names: Sequence[str], captures: str | Path) -> dict[str, Preview]:
    """What the photographs of materials will cost, by name; for parameters and errors see above."""
    settings, rig, plan = _planned(config)
    return {
        name: preview(plan, frame_format(rig), Path(captures) / name) for name in _spheres(settings, names)
    }


def check_from_config(config: str | Path, exposure_s: float) -> Iterator[str]:
    """Check the rig of a config, line by line (`pbrdf.capture.rig_check.check_rig`)."""
    settings, rig, _ = _planned(config)
    yield from check_rig(rig, settings["rig"], lambda: VirtualRig(rig, VirtualField(rig)), exposure_s)


def _planned(config: str | Path) -> tuple[dict[str, Any], RigSettings, CapturePlan]:
    settings = read_checked(config, "config")
    for field in ("rig", "plan"):
        if not settings.get(field):
            raise InputError(config, field, "is missing", "say what photographs what")
    rig = read_rig(settings["rig"])
    return settings, rig, capture_plan(settings["plan"], rig, config)


def _spheres(settings: dict[str, Any], names: Sequence[str]) -> dict[str, float]:
    """Radius of each material's sphere, mm."""
    table = read_materials(settings["materials"], settings["data"])
    radii = {}
    for name, material in select(table, names, "pbrdf capture", "material").items():
        if material.source != "rig" or material.radius_mm is None:
            raise InputError(
                settings["materials"],
                f"{name}, source",
                f"is `{material.source}`",
                "name a sphere of the rig",
            )
        radii[name] = material.radius_mm
    return radii
