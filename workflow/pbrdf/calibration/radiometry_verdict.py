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
    findings = [*_noise(sensor), *_range(sensor), *_tile(scales)]
    told = (
        f"{sensor.transfer.dn_per_electron:.4g} DN an electron, read noise {sensor.read_noise_dn:.3g} DN, "
        f"linear to {100 * sensor.linearity.largest_deviation:.2g} %"
    )
    if sensor.darks_at_ends:
        told += ", dark frames from start and end of the run only"
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


def _tile(scales: Mapping[int, LampScale]) -> list[Finding]:
    """What is to be said of the tile's photographs, once for all bands that it concerns."""
    uneven = {nm: abs(scale.unevenness) for nm, scale in scales.items()}
    sure = {nm: uneven[nm] - _SURE * scale.unevenness_error for nm, scale in scales.items()}
    error = {nm: scale.standard_error / scale.scale for nm, scale in scales.items()}
    lamp = {nm: scale.lamp_range for nm, scale in scales.items()}
    return [
        *_graded(
            sure, uneven, _UNEVEN, "a part of the tile is", " off: check its tilt, lights and flat field"
        ),
        *_graded(
            error, error, ((_ERROR, POOR),), "the lamp's power is uncertain by", ": expose the tile longer"
        ),
        *_graded(lamp, lamp, ((_LAMP, FAIR),), "the lamp changed by", " meanwhile: let it warm up"),
    ]


def _graded(
    judged_by: Mapping[int, float],
    told: Mapping[int, float],
    thresholds: tuple[tuple[float, str], ...],
    what: str,
    remedy: str,
) -> list[Finding]:
    """A finding for each level that a value reaches in some bands, told with the largest of them."""
    bands: dict[str, list[int]] = {}
    for nm, value in judged_by.items():
        for finding in graded(value, *thresholds, words=what):
            bands.setdefault(finding.level, []).append(nm)
    findings = []
    for level, concerned in bands.items():
        largest = max(told[nm] for nm in concerned)
        up_to = "up to " if len(concerned) > 1 else ""
        words = f"at {_listed(concerned)} nm {what} {up_to}{100 * largest:.2g} %{remedy}"
        findings.append(Finding(level, words))
    return findings


def _listed(bands: list[int]) -> str:
    *first, last = (f"{nm}" for nm in bands)
    return f"{', '.join(first)} and {last}" if first else last
