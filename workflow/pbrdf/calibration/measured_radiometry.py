"""What ``radiometry.json`` tells of a sensor and a lamp that were measured."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pbrdf.calibration.lamp_scale import LampScale, combined
from pbrdf.calibration.radiometry_verdict import judge
from pbrdf.calibration.sensor import Sensor


def measured_radiometry(
    sensor: Sensor, tiles: Mapping[str, Mapping[int, LampScale]], reflectance: float
) -> dict[str, Any]:
    """Content of ``radiometry.json``; digests of the inputs are the caller's to add.

    Parameters
    ----------
    sensor : Sensor
        Noise and range, from the flat field's photographs.
    tiles : mapping
        Lamp's power by light and band (nm), from those of the tile.
    reflectance : float
        Of the tile.
    """
    bands = next(iter(tiles.values()))
    scales = {nm: combined([by_band[nm] for by_band in tiles.values()]) for nm in bands}
    content = {
        "source": "measured",
        **judge(sensor, scales),
        **sensor.content(),
        "reflectance": reflectance,
        "scale_unit": "DN/s of 1/sr under a cosine of 1 from a distance of 1 m",
    }
    for name, field in (
        ("scale", "scale"),
        ("scale_standard_error", "standard_error"),
        ("unevenness", "unevenness"),
        ("unevenness_standard_error", "unevenness_error"),
        ("lamp_range", "lamp_range"),
        ("pixels", "pixels"),
    ):
        content[name] = {str(nm): getattr(scale, field) for nm, scale in scales.items()}
    content["scale_by_light"] = {
        light: {str(nm): scale.scale for nm, scale in by_band.items()} for light, by_band in tiles.items()
    }
    return content
