"""What a raw value means: noise and range of the sensor, and power of the lamp."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from pbrdf.errors import InputError
from pbrdf.formats.documents import number, positive, read_document, wavelengths

KIND = "radiometry/1"


@dataclass(frozen=True)
class Radiometry:
    """Noise, range and scale of raw values, in DN as stored.

    Attributes
    ----------
    dn_per_electron : float
        Slope of variance over signal, DN.
    read_noise_dn : float
        Standard deviation of a dark frame's pixel, DN.
    scale : dict of int to float
        By band (nm): DN/s of a state with a · M · g = 1/sr, under a cosine of 1, from a distance of 1 m.
    saturation_dn : float
        Value from which on the camera is not linear; infinite if it is so wherever it was tested.
    """

    dn_per_electron: float
    read_noise_dn: float
    scale: dict[int, float]
    saturation_dn: float = math.inf

    @classmethod
    def read(cls, path: str | Path) -> Radiometry:
        """Read ``radiometry.json``.

        Raises
        ------
        InputError
            If a value is missing or not positive, or the verdict on the measurement is that nothing can
            be made with it.
        """
        content = read_document(path, KIND)
        if content.get("usable", True) is not True:
            raise InputError(path, "verdict", f"is `{content.get('verdict')}`", "measure it again")
        gain = number(path, content, "dn_per_electron")
        if gain < 0:
            raise InputError(path, "dn_per_electron", f"is {gain:g}", "measure the noise again")
        bands = wavelengths(path, content, "scale")
        scale = {band_nm: positive(path, content, f"scale.{name}") for band_nm, name in bands.items()}
        saturation = positive(path, content, "saturation_dn") if "saturation_dn" in content else math.inf
        return cls(gain, positive(path, content, "read_noise_dn"), scale, saturation)
