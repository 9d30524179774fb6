"""A rig's file, checked."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from pbrdf.errors import InputError
from pbrdf.settings.checked import read_checked

WORD_BITS = 16

FILE_KEYS = ("table", "filename")
"""Keys of a sphere whose values are paths: of a table, and of what Mitsuba's plugins read."""


class RigSettings(dict[str, Any]):
    """Content of a rig's file, shown by its digest: workflows print what changed of their parameters."""

    def with_sphere(self, material: str, source: str | Path) -> RigSettings:
        """The rig with the sphere of one material alone; raises `InputError` if it has none of that name."""
        spheres = self.get("spheres", {})
        if self["kind"] == "virtual" and material not in spheres:
            known = ", ".join(spheres) or "none"
            raise InputError(
                source, "spheres", f"there is none called `{material}`", f"add it (there: {known})"
            )
        return RigSettings({**self, "spheres": {name: spheres[name] for name in spheres if name == material}})

    def with_files_at(self, place: Callable[[str], str | Path]) -> RigSettings:
        """The rig with each path that its spheres name where `place` says it is."""

        def placed(part: Any) -> Any:
            if not isinstance(part, dict):
                return part
            return {
                key: str(place(value)) if key in FILE_KEYS and isinstance(value, str) else placed(value)
                for key, value in part.items()
            }

        return RigSettings({**self, "spheres": placed(self["spheres"])} if "spheres" in self else self)

    def with_no_sphere(self) -> RigSettings:
        """The rig that photographs the targets of a session."""
        return RigSettings({**self, "spheres": {}})

    def without_spheres(self) -> RigSettings:
        """The rig by itself: what calibrations depend on."""
        return RigSettings(
            {name: value for name, value in self.items() if name not in ("spheres", "seed", "samples")}
        )

    def __repr__(self) -> str:
        """Short form: equal content gives equal text."""
        text = json.dumps(self, sort_keys=True)
        return f"RigSettings({self['kind']}, {hashlib.sha256(text.encode()).hexdigest()[:16]})"


def read_rig(path: str | Path) -> RigSettings:
    """Read a rig's file.

    Parameters
    ----------
    path : str or Path

    Raises
    ------
    InputError
        If it is not as its schema says, its camera's words do not fit into 16 bits, or it is virtual
        and does not say how it behaves in a band of its filters.
    """
    rig = RigSettings(read_checked(path, "rig"))
    camera = rig["camera"]
    if camera["adc_bits"] + camera["shift"] > WORD_BITS:
        raise InputError(
            path,
            "camera.shift",
            f"{camera['adc_bits']} bits shifted by {camera['shift']} need more than {WORD_BITS}",
            "correct `adc_bits` or `shift`",
        )
    if rig["kind"] == "virtual":
        _require_bands(rig, path)
    return rig


def _require_bands(rig: RigSettings, source: str | Path) -> None:
    elements = rig["polarimeter"]
    tables = {
        "polarimeter.generator_retardance_waves": elements["generator_retardance_waves"],
        "polarimeter.analyser_retardance_waves": elements["analyser_retardance_waves"],
        "lamp_electrons_per_s": rig["lamp_electrons_per_s"],
        **dict(_spheres_by_band(rig["spheres"])),
    }
    for field, table in tables.items():
        for band_nm in rig["filters_nm"]:
            if str(band_nm) not in table:
                raise InputError(source, field, f"says nothing of {band_nm} nm", "add that band")


def _spheres_by_band(spheres: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """What spheres tell band by band, by its place in the file."""
    for name, sphere in spheres.items():
        if "model" in sphere:
            yield f"spheres.{name}.bands", sphere["bands"]
        elif "mitsuba" in sphere and is_by_band(sphere["mitsuba"]):
            yield f"spheres.{name}.mitsuba", sphere["mitsuba"]


def is_by_band(mitsuba: Mapping[str, Any]) -> bool:
    """Whether a sphere's `mitsuba` holds a BSDF for each band, not one for all."""
    return "type" not in mitsuba


def sphere_files(part: Any) -> list[str]:
    """Paths of the files that a sphere of a rig's file, or a part of it, names: table and `filename`."""
    if not isinstance(part, dict):
        return []
    named = [value for key, value in part.items() if key in FILE_KEYS and isinstance(value, str)]
    return named + [path for value in part.values() for path in sphere_files(value)]
