"""What a raw value means: noise of the sensor and power of the lamp."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pbrdf.errors import InputError
from pbrdf.formats.documents import number, positive, read_document, wavelengths

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
        gain = number(path, content, "dn_per_electron")
        if gain < 0:
            raise InputError(path, "dn_per_electron", f"is {gain:g}", "measure the noise again")
        bands = wavelengths(path, content, "scale")
        scale = {band_nm: positive(path, content, f"scale.{name}") for band_nm, name in bands.items()}
        return cls(gain, positive(path, content, "read_noise_dn"), scale)


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
