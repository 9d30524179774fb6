"""What a config says of photographs, for work without the workflow."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pbrdf.capture.material import capture_material
from pbrdf.capture.preview import Preview, preview
from pbrdf.capture.rig_check import check_rig
from pbrdf.errors import InputError
from pbrdf.instruments.interface import FrameFormat
from pbrdf.instruments.virtual_plane import VirtualField
from pbrdf.instruments.virtual_rig import VirtualRig
from pbrdf.settings.checked import read_checked
from pbrdf.settings.materials import read_materials, select
from pbrdf.settings.plan import CapturePlan, capture_plan
from pbrdf.settings.rig import RigSettings, read_rig


@dataclass(frozen=True)
class Configured:
    """A config with its rig and its plan; `read` makes it."""

    settings: dict[str, Any]
    rig: RigSettings
    plan: CapturePlan

    @classmethod
    def read(cls, config: str | Path) -> Configured:
        """Read a config and the rig's file that it names; paths are taken from the working folder.

        Raises
        ------
        InputError
            If a file cannot be used, or the config names no rig or no plan.
        """
        settings = read_checked(config, "config")
        for field in ("rig", "plan"):
            if not settings.get(field):
                raise InputError(config, field, "is missing", "say what photographs what")
        rig = read_rig(settings["rig"])
        return cls(settings, rig, capture_plan(settings["plan"], rig, config))

    def previews(self, names: Sequence[str], captures: str | Path) -> dict[str, Preview]:
        """What the photographs of materials will cost, by name; for parameters and errors see `capture`."""
        form = FrameFormat.of_camera(self.rig["camera"])
        return {name: preview(self.plan, form, Path(captures) / name) for name in self._radii_mm(names)}

    def capture(self, names: Sequence[str], captures: str | Path) -> list[Path]:
        """Photograph materials.

        Parameters
        ----------
        names : sequence of str
            Materials of the config's table whose source is the rig.
        captures : str or Path
            Folder of all captures.

        Returns
        -------
        list of Path
            The folder of each material's capture.

        Raises
        ------
        InputError
            If a name is not in the table or not of a sphere of the rig, and as `capture_material`.
        """
        folders = []
        for name, radius_mm in self._radii_mm(names).items():
            folders.append(Path(captures) / name)
            capture_material(self.plan, self.rig, self.settings["rig"], name, radius_mm, folders[-1])
        return folders

    def check(self, exposure_s: float) -> Iterator[str]:
        """Check the rig, line by line (`pbrdf.capture.rig_check.check_rig`)."""
        rig = self.rig
        return check_rig(rig, self.settings["rig"], lambda: VirtualRig(rig, VirtualField(rig)), exposure_s)

    def _radii_mm(self, names: Sequence[str]) -> dict[str, float]:
        table = read_materials(self.settings["materials"], self.settings["data"])
        radii = {}
        for name, material in select(table, names, "pbrdf capture", "material").items():
            if material.source != "rig" or material.radius_mm is None:
                raise InputError(
                    self.settings["materials"],
                    f"{name}, source",
                    f"is `{material.source}`",
                    "name a sphere of the rig",
                )
            radii[name] = material.radius_mm
        return radii
