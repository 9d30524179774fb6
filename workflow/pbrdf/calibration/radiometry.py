"""What a raw value means: noise of the sensor and power of the lamp."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pbrdf.errors import InputError
from pbrdf.formats.documents import member, number, read_document

KIND = "radiometry/1"


@dataclass(frozen=True)
class Radiometry:
    """Noise and scale of raw values, in DN as stored.

    Attributes
    ----------
    dn_per_electron : float
        Slope of variance over signal, DN.
    read_noise_dn : float
        Standard deviation of a dark frame's pixel, DN.
    scale : dict of int to float
        By band (nm): DN/s of a state with a · M · g = 1/sr, under a cosine of 1, from a distance of 1 m.
    """

    dn_per_electron: float
    read_noise_dn: float
    scale: dict[int, float]

    @classmethod
    def read(cls, path: str | Path) -> Radiometry:
        """Read ``radiometry.json``; raises `InputError` if a value is missing or not positive."""
        content = read_document(path, KIND)
        scale = {int(name): number(path, content, f"scale.{name}") for name in member(path, content, "scale")}
        for name, value in scale.items():
            if value <= 0:
                raise InputError(path, f"scale.{name}", f"is {value:g}", "measure the lamp's power again")
        gain, read_noise = number(path, content, "dn_per_electron"), number(path, content, "read_noise_dn")
        if gain < 0 or read_noise <= 0:
            raise InputError(
                path, "read_noise_dn", f"is {read_noise:g}, gain {gain:g}", "measure the noise again"
            )
        return cls(gain, read_noise, scale)


def nominal_radiometry(rig: Mapping[str, Any]) -> dict[str, Any]:
    """Content of ``radiometry.json`` copied from a rig's file; read noise includes the converter's step."""
    camera = rig["camera"]
    step = float(1 << camera["shift"])
    dn_per_electron = step / camera["electrons_per_dn"]
    read_variance = (camera["read_noise_electrons"] * dn_per_electron) ** 2 + step**2 / 12.0
    return {
        "source": "nominal",
        "dn_per_electron": dn_per_electron,
        "read_noise_dn": read_variance**0.5,
        "scale": {nm: electrons * dn_per_electron for nm, electrons in rig["lamp_electrons_per_s"].items()},
    }
