"""Calibrations as files that hold a virtual rig's truth: for tests of what comes after them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pbrdf.calibration.documents import KINDS
from pbrdf.calibration.flat_field import write_flat
from pbrdf.calibration.polarimeter import ELEMENTS
from pbrdf.formats.documents import write_document
from pbrdf.instruments.virtual_geometry import UP, virtual_arm, virtual_flat, virtual_polarimeter
from pbrdf.optics.arm import Arm
from pbrdf.optics.polarimeter import Polarimeter

RADIUS_MM = 25.0


def camera_content(rig: Mapping[str, Any]) -> dict[str, Any]:
    camera = rig["camera"]
    return {
        "focal_px": [camera["focal_px"], camera["focal_px"]],
        "principal_px": camera["principal_px"],
        "rows": camera["rows"],
        "columns": camera["columns"],
    }


def lights_content(arm: Arm) -> dict[str, Any]:
    return {
        "centre_mm": list(arm.centre_mm),
        "axis": list(arm.axis),
        "start": list(arm.start),
        "radius_mm": arm.radius_mm,
        "generator_axis": list(arm.generator_axis),
    }


def polarimeter_content(polarimeters: Mapping[int, Polarimeter], axis: tuple[float, ...]) -> dict[str, Any]:
    """Of elements that share their zeros over the bands."""
    zeros = next(iter(polarimeters.values())).zeros
    return {
        "zeros_deg": {name: float(np.rad2deg(zero)) for name, zero in zip(ELEMENTS, zeros, strict=True)},
        "analyser_axis": list(axis),
        "bands": {
            str(nm): {
                "generator_retardance_deg": float(np.rad2deg(p.generator_retardance)),
                "analyser_retardance_deg": float(np.rad2deg(p.analyser_retardance)),
            }
            for nm, p in polarimeters.items()
        },
    }


def radiometry_content(rig: Mapping[str, Any]) -> dict[str, Any]:
    """Read noise includes the converter's step."""
    camera = rig["camera"]
    step = float(1 << camera["shift"])
    gain = step / camera["electrons_per_dn"]
    read_variance = (camera["read_noise_electrons"] * gain) ** 2 + step**2 / 12.0
    return {
        "dn_per_electron": gain,
        "read_noise_dn": read_variance**0.5,
        "scale": {nm: electrons * gain for nm, electrons in rig["lamp_electrons_per_s"].items()},
    }


def write_truth(kind: str, rig: Mapping[str, Any], path: Path) -> Path:
    """Write a calibration of one kind; of a sphere of `RADIUS_MM`."""
    content: dict[str, Any]
    if kind == "camera":
        content = camera_content(rig)
    elif kind == "lights":
        content = lights_content(virtual_arm(dict(rig)))
    elif kind == "polarimeter":
        bands = {nm: virtual_polarimeter(dict(rig), nm) for nm in rig["filters_nm"]}
        content = polarimeter_content(bands, UP)
    elif kind == "radiometry":
        content = radiometry_content(rig)
    elif kind == "flat":
        content = write_flat(path, dict.fromkeys(rig["filters_nm"], virtual_flat(dict(rig))))
    else:
        content = {"centre_mm": [0.0, 0.0, rig["distance_mm"]], "radius_mm": RADIUS_MM}
    write_document(path, KINDS[kind], {"source": "truth", **content})
    return path
