"""What tells a surface's polarisation at a glance: DoLP along θd, and Brewster's angle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pbrdf.formats.table_data import Origin, TableData
from pbrdf.models import Model
from pbrdf.optics.rusinkiewicz import cosines, directions

Float = NDArray[np.float64]

_THETA_H = (0.0, 10.0, 40.0)
"""Degrees: mirror reflection, its flank, and what is left beside it."""
_PHI_D = 90.0
"""Degrees: here θi = θo, and every θd is above the horizon."""
_HIGHLIGHT = np.radians(10.0)
"""Largest θh whose M33 tells of reflection at the facets."""
_FINE = np.radians(np.arange(0.1, 89.95, 0.05))
_LEAST = 1e-6


@dataclass(frozen=True)
class DolpCurve:
    """Degree of linear polarisation of unpolarised light after reflection, along θd.

    Attributes
    ----------
    wavelength_nm : float
    theta_h_deg, phi_d_deg : float
        Where in the table.
    theta_d_deg : tuple of float
    measured : tuple of float or None
        √(M10² + M20²) / M00 of the table; None where nothing is known or M00 is not positive.
    standard_error : tuple of float or None
        From the table's variances, elements taken as independent; None without them.
    origin : tuple of str or None
        Where each value comes from, None where the table does not tell.
    models : dict of tuples of float
        By model.
    """

    wavelength_nm: float
    theta_h_deg: float
    phi_d_deg: float
    theta_d_deg: tuple[float, ...]
    measured: tuple[float | None, ...]
    standard_error: tuple[float | None, ...]
    origin: tuple[str | None, ...]
    models: dict[str, tuple[float, ...]]


@dataclass(frozen=True)
class BrewsterAngle:
    """Angle of incidence at the facets where M33 changes its sign.

    For a dielectric it is Brewster's angle, where one polarisation is not reflected and the phase of
    the other jumps; for a metal its principal angle of incidence, where the phases differ by 90°. Of
    all elements M33 is the one to which light that was depolarised inside adds nothing.

    Attributes
    ----------
    wavelength_nm : float
    measured_deg : float or None
        Of the table, linear between its θd; None if M33 does not change from negative to positive.
    standard_error_deg : float or None
        From the table's variances.
    models : dict of float or None
        By model.
    """

    wavelength_nm: float
    measured_deg: float | None
    standard_error_deg: float | None
    models: dict[str, float | None]


Fitted = Mapping[str, tuple[Model, Mapping[str, float]]]
"""A model and its parameters in one band, by name."""


def dolp_curves(data: TableData, band: int, fitted: Fitted) -> list[DolpCurve]:
    """DoLP of a table and of models along θd, at the table's nodes nearest to three θh."""
    azimuth = int(np.abs(np.degrees(data.phi_d) - _PHI_D).argmin())
    halves = dict.fromkeys(int(np.abs(np.degrees(data.theta_h) - angle).argmin()) for angle in _THETA_H)
    return [_dolp_curve(data, band, half, azimuth, fitted) for half in halves]


def brewster_angle(data: TableData, band: int, fitted: Fitted) -> BrewsterAngle:
    """Brewster's angle of a table and of models."""
    measured, error = _measured_brewster(data, band)
    return BrewsterAngle(
        float(data.wavelengths_nm[band]),
        measured,
        error,
        {name: _model_brewster(model, parameters) for name, (model, parameters) in fitted.items()},
    )


def _dolp_curve(data: TableData, band: int, half: int, azimuth: int, fitted: Fitted) -> DolpCurve:
    theta_h, phi_d = float(data.theta_h[half]), float(data.phi_d[azimuth])
    mueller = data.mueller[band, half, :, azimuth].astype(np.float64)
    visible = np.minimum(*cosines(theta_h, data.theta_d, phi_d)) > _LEAST
    mueller[~visible | (mueller[:, 0, 0] <= 0)] = np.nan
    error = np.full(len(mueller), np.nan)
    if data.variance is not None:
        error = _dolp_error(mueller, data.variance[band, half, :, azimuth].astype(np.float64))
    origins: tuple[str | None, ...] = (None,) * len(mueller)
    if data.origin is not None:
        origins = tuple(Origin(o).name.lower() for o in data.origin[band, half, :, azimuth])
    light, camera = directions(theta_h, np.maximum(data.theta_d, _LEAST), phi_d)
    models = {
        name: _plain(np.where(visible, dolp(model.evaluate(light, camera, parameters)), 0.0))
        for name, (model, parameters) in fitted.items()
    }
    return DolpCurve(
        float(data.wavelengths_nm[band]),
        float(np.degrees(theta_h)),
        float(np.degrees(phi_d)),
        _plain(np.degrees(data.theta_d)),
        _known(dolp(mueller)),
        _known(error),
        origins,
        models,
    )


def dolp(mueller: Float) -> Float:
    """Degree of linear polarisation of unpolarised light after reflection, (..., 4, 4) to (...).

    Zero where nothing is reflected.
    """
    first = mueller[..., 0, 0]
    linear = np.hypot(mueller[..., 1, 0], mueller[..., 2, 0])
    found: Float = np.divide(linear, first, out=np.zeros_like(linear), where=first != 0)
    return found


def _dolp_error(mueller: Float, variance: Float) -> Float:
    first, q, u = (mueller[..., row, 0] for row in range(3))
    linear = np.hypot(q, u)
    squared = np.maximum(linear**2, np.finfo(np.float64).tiny)
    of_linear = (q**2 * variance[..., 1, 0] + u**2 * variance[..., 2, 0]) / squared
    error: Float = np.sqrt(of_linear + (linear / first) ** 2 * variance[..., 0, 0]) / first
    return error


def _model_brewster(model: Model, parameters: Mapping[str, float]) -> float | None:
    light, camera = directions(0.0, _FINE, np.pi / 2)
    m33 = model.evaluate(light, camera, parameters)[:, 3, 3]
    crossing = _sign_change(_FINE, m33, np.ones_like(m33))
    return None if crossing is None else float(np.degrees(crossing[0]))


def _measured_brewster(data: TableData, band: int) -> tuple[float | None, float | None]:
    near = data.theta_h <= _HIGHLIGHT
    m33 = data.mueller[band, near, ..., 3, 3].astype(np.float64)
    known = np.isfinite(m33) & (data.theta_d > 0)[:, None]
    if data.origin is not None:
        known &= data.origin[band, near] == Origin.MEASURED
    cos_i, cos_o = cosines(data.theta_h[near][:, None, None], data.theta_d[:, None], data.phi_d)
    known &= np.minimum(cos_i, cos_o) > _LEAST
    count = known.sum(axis=(0, 2))
    seen = count > 0
    mean = np.where(known, m33, 0.0).sum(axis=(0, 2))[seen] / count[seen]
    of_mean = np.full_like(mean, np.nan)
    if data.variance is not None:
        variance = data.variance[band, near, ..., 3, 3].astype(np.float64)
        of_mean = np.where(known, variance, 0.0).sum(axis=(0, 2))[seen] / count[seen] ** 2
    told = np.isfinite(of_mean) & (of_mean > 0)
    crossing = _sign_change(data.theta_d[seen], mean, np.where(told, 1 / np.where(told, of_mean, 1.0), 1.0))
    if crossing is None:
        return None, None
    angle, below, fraction = crossing
    pair = slice(below, below + 2)
    slope = np.diff(mean[pair]).item() / np.diff(data.theta_d[seen][pair]).item()
    at_crossing = np.array([1 - fraction, fraction]) ** 2 @ of_mean[pair]
    error = float(np.degrees(np.sqrt(at_crossing) / slope)) if told[pair].all() else None
    return float(np.degrees(angle)), error


def _sign_change(theta_d: Float, values: Float, weights: Float) -> tuple[float, int, float] | None:
    """Where values turn from negative to positive: angle, node below it, and the fraction beyond that.

    Of several changes the one counts that leaves most below it negative and most above it positive.
    """
    changes = np.flatnonzero((values[:-1] < 0) & (values[1:] >= 0))
    if not len(changes):
        return None
    running = np.cumsum(values * weights)
    below = int(changes[np.argmin(running[changes])])
    fraction = float(values[below] / (values[below] - values[below + 1]))
    angle = theta_d[below] + fraction * (theta_d[below + 1] - theta_d[below])
    return float(angle), below, fraction


def _plain(values: Float) -> tuple[float, ...]:
    return tuple(float(v) for v in values)


def _known(values: Float) -> tuple[float | None, ...]:
    return tuple(float(v) if np.isfinite(v) else None for v in values)
