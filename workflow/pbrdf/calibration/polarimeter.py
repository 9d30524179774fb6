"""Retardances and zeros of the generator's and the analyser's elements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pbrdf.errors import InputError
from pbrdf.formats.documents import member, number, read_document, unit_vector, wavelengths
from pbrdf.optics.arm import Vector
from pbrdf.optics.polarimeter import Polarimeter

KIND = "polarimeter/1"
ELEMENTS = ("generator_polariser", "generator_retarder", "analyser_retarder", "analyser_polariser")


@dataclass(frozen=True)
class PolarimeterCalibration:
    """Polarimeter by band (nm), and the x axis of the analyser's frame in the camera's frame."""

    bands: dict[int, Polarimeter]
    analyser_axis: Vector

    @classmethod
    def read(cls, path: str | Path) -> PolarimeterCalibration:
        """Read ``polarimeter.json``.

        Raises
        ------
        InputError
            If a value is missing or not finite, or the verdict on the measurement is that nothing
            can be made with it.
        """
        content = read_document(path, KIND)
        if content.get("usable", True) is not True:
            raise InputError(path, "verdict", f"is `{content.get('verdict')}`", "measure it again")
        gp, gr, ar, ap = (float(np.deg2rad(number(path, content, f"zeros_deg.{name}"))) for name in ELEMENTS)
        bands = {}
        for band_nm, name in wavelengths(path, content, "bands").items():
            generator, analyser = (
                float(np.deg2rad(number(path, content, f"bands.{name}.{module}_retardance_deg")))
                for module in ("generator", "analyser")
            )
            leak = _extinction(path, content, f"bands.{name}.extinction_ratio")
            bands[band_nm] = Polarimeter(generator, analyser, (gp, gr, ar, ap), leak)
        return cls(bands, unit_vector(path, content, "analyser_axis"))

    def at(self, band_nm: int, source: str | Path) -> Polarimeter:
        """Polarimeter of a band; raises `InputError` naming `source` if that band was not calibrated."""
        if band_nm not in self.bands:
            known = ", ".join(f"{nm}" for nm in self.bands)
            raise InputError(
                source, f"bands.{band_nm}", "is missing", f"calibrate that band too (there: {known} nm)"
            )
        return self.bands[band_nm]


def _extinction(path: str | Path, content: Mapping[str, Any], field: str) -> float:
    """Optional ratio below 1 at a dotted `field`, 0 if there is none; raises `InputError` otherwise."""
    *outer, last = field.split(".")
    if last not in member(path, content, ".".join(outer)):
        return 0.0
    ratio = number(path, content, field)
    if not 0.0 <= ratio < 1.0:
        raise InputError(path, field, f"is {ratio:g}", "give a number from 0 to below 1")
    return ratio
