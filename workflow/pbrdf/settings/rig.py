"""A rig's file, checked."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from pbrdf.errors import InputError
from pbrdf.settings.checked import read_checked

WORD_BITS = 16


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
        **{f"spheres.{name}.bands": sphere["bands"] for name, sphere in rig["spheres"].items()},
    }
    for field, table in tables.items():
        for band_nm in rig["filters_nm"]:
            if str(band_nm) not in table:
                raise InputError(source, field, f"says nothing of {band_nm} nm", "add that band")
