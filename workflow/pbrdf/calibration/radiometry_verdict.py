"""Whether a measured radiometry can be used, and what to look at if not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pbrdf.calibration.lamp_scale import LampScale
from pbrdf.calibration.linearity import TOLERANCE
from pbrdf.calibration.sensor import Sensor
from pbrdf.calibration.verdicts import FAIR, POOR, UNUSABLE, Finding, graded, judged

_SURE = 5.0
"""Standard errors by which a slope must exceed zero, and an unevenness its threshold."""

_LINE = ((0.05, POOR), (0.3, UNUSABLE))
"""Relative deviation of a variance from the line: weights and variances of all results carry it."""

_RANGE_KNOWN, _RANGE_LEAST = 0.5, 0.1
"""Share of saturation up to which linearity should be known, and must hold."""

_CLIPPED = 0.01
"""Share of dark values at zero from which on dark level and read noise are wrong."""

_UNEVEN = ((0.005, FAIR), (0.02, POOR), (0.1, UNUSABLE))
"""Relative deviation of a part of the tile from its mean."""

_LAMP = 0.01
"""Relative change of the lamp while the tile was photographed: it may be as much between captures."""

_ERROR = 0.01
"""Relative standard error of a scale."""


def judge(sensor: Sensor, scales: Mapping[int, LampScale]) -> dict[str, Any]:
    """Entries ``verdict`` and ``usable`` of ``radiometry.json``."""
    findings = [*_noise(sensor), *_range(sensor)]
    for band_nm, scale in scales.items():
        findings += _tile(band_nm, scale)
    told = (
        f"{sensor.transfer.dn_per_electron:.4g} DN an electron, read noise {sensor.read_noise_dn:.3g} DN, "
        f"linear to {100 * sensor.linearity.largest_deviation:.2g} %"
    )
    return judged(told, findings)


def _noise(sensor: Sensor) -> list[Finding]:
    transfer, findings = sensor.transfer, []
    if not transfer.dn_per_electron > _SURE * transfer.dn_per_electron_error:
        words = "the noise does not grow with the signal: give frames as the camera reads them"
        findings.append(Finding(UNUSABLE, words))
    worst = max(range(len(transfer.points)), key=lambda index: abs(transfer.residuals[index]))
    deviation, point = abs(transfer.residuals[worst]), transfer.points[worst]
    if transfer.beyond_noise:
        where = "of dark frames" if point.band_nm is None else f"at {point.band_nm} nm"
        words = (
            f"the variance {where}, {1000 * point.exposure_s:g} ms, is {100 * deviation:.2g} % off its line: "
            "keep the light the same, and give frames as the camera reads them"
        )
        findings += graded(deviation, *_LINE, words=words)
    clipped = sensor.dark_clipped_share
    words = f"{100 * clipped:.2g} % of the dark values are zero: raise the camera's black level"
    return findings + graded(clipped, (_CLIPPED, POOR), words=words)


def _range(sensor: Sensor) -> list[Finding]:
    straight, top = sensor.linearity, sensor.saturation_dn
    if straight.limit_dn is not None:
        words = (
            f"from {straight.limit_dn:.0f} DN on, {100 * straight.limit_dn / top:.0f} % of saturation, "
            f"the signal is off by more than {100 * TOLERANCE:g} %"
        )
        if straight.limit_dn < _RANGE_LEAST * top:
            return [Finding(UNUSABLE, f"{words}: check dark frames and exposure times")]
        return [Finding(FAIR, f"{words}: brighter values are not used")]
    if straight.tested_to_dn < _RANGE_KNOWN * top:
        share = 100 * straight.tested_to_dn / top
        words = f"linearity is known up to {share:.0f} % of saturation: expose the flat field longer"
        return [Finding(FAIR, words)]
    return []


def _tile(band_nm: int, scale: LampScale) -> list[Finding]:
    uneven, error = abs(scale.unevenness), scale.standard_error / scale.scale
    return [
        *graded(
            uneven - _SURE * scale.unevenness_error,
            *_UNEVEN,
            words=f"at {band_nm} nm a part of the tile is {100 * uneven:.2g} % off: "
            "check its tilt, the lights and the flat field",
        ),
        *graded(
            error,
            (_ERROR, POOR),
            words=f"at {band_nm} nm the lamp's power is known to {100 * error:.2g} %: expose the tile longer",
        ),
        *graded(
            scale.lamp_range,
            (_LAMP, FAIR),
            words=f"at {band_nm} nm the lamp changed by {100 * scale.lamp_range:.2g} % meanwhile: "
            "let it warm up",
        ),
    ]
