"""Models beside the table they were fitted to, as data: document ``pbrdf/comparison/1`` and a CSV."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pbrdf.errors import InputError
from pbrdf.fitting.comparison_rows import csv_rows, csv_text
from pbrdf.fitting.options import COST_UNITS
from pbrdf.fitting.polarisation import BrewsterAngle, DolpCurve, brewster_angle, dolp_curves
from pbrdf.fitting.reflectance import Reflectance, model_reflectance, table_reflectance
from pbrdf.fitting.residuals import Residuals
from pbrdf.fitting.result import FitResult, read_fit
from pbrdf.formats.documents import read_document, write_document, write_text
from pbrdf.formats.table_data import TableData
from pbrdf.formats.table_zarr import read_table
from pbrdf.models import MODELS
from pbrdf.models.table import Table

KIND = "comparison/1"
THETA_I_DEG = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0)
_CONSERVED = 1e-3
"""Accuracy of the quadrature: what is reflected beyond this much more than came in breaks energy."""


@dataclass(frozen=True)
class Albedo:
    """Directional-hemispherical reflectance at one angle of incidence.

    Attributes
    ----------
    wavelength_nm, theta_i_deg : float
    measured : Reflectance
        Of the table, over what it knows.
    models : dict of float
        By model.
    """

    wavelength_nm: float
    theta_i_deg: float
    measured: Reflectance
    models: dict[str, float]


@dataclass(frozen=True)
class Comparison:
    """Models beside a table.

    Attributes
    ----------
    material : str
    fits : tuple of FitResult
        Of this table, one a model.
    dolp : tuple of DolpCurve
    brewster : tuple of BrewsterAngle
    albedo : tuple of Albedo
    words : tuple of str
        What the figures say.
    """

    material: str
    fits: tuple[FitResult, ...]
    dolp: tuple[DolpCurve, ...]
    brewster: tuple[BrewsterAngle, ...]
    albedo: tuple[Albedo, ...]
    words: tuple[str, ...]

    def content(self) -> dict[str, Any]:
        """Plain content of the document."""
        return {
            "material": self.material,
            "table": {"source": self.fits[0].source, "digest": self.fits[0].digest},
            "wavelengths": {"unit": "nm", "values": list(self.fits[0].wavelengths_nm)},
            "words": list(self.words),
            "models": [_model_content(fit) for fit in self.fits],
            "dolp": [asdict(curve) for curve in self.dolp],
            "brewster": [asdict(angle) for angle in self.brewster],
            "albedo": [asdict(albedo) for albedo in self.albedo],
        }

    def write(self, path: str | Path, rows: str | Path) -> None:
        """Write the document to `path` and the same values as CSV to `rows`."""
        write_document(path, KIND, self.content())
        write_text(rows, csv_text(csv_rows(self.content())))


def compare(material: str, data: TableData, fits: Sequence[FitResult]) -> Comparison:
    """Compare fitted models with their table and with each other.

    Parameters
    ----------
    material : str
        Its name, for the document.
    data : TableData
        The table.
    fits : sequence of FitResult
        Of this table, each of another model.

    Raises
    ------
    InputError
        If there are no fits, or one is of other bands.
    """
    _check(data, fits)
    dolp: list[DolpCurve] = []
    brewster, albedo = [], []
    table = Table(data)
    for band, wavelength in enumerate(data.wavelengths_nm):
        fitted = {fit.model: (MODELS[fit.model], fit.band(band)) for fit in fits}
        dolp += dolp_curves(data, band, fitted)
        brewster.append(brewster_angle(data, band, fitted))
        for degrees in THETA_I_DEG:
            theta_i = float(np.radians(degrees))
            models = {n: model_reflectance(m, p, theta_i).value for n, (m, p) in fitted.items()}
            measured = table_reflectance(table, float(wavelength), theta_i)
            albedo.append(Albedo(float(wavelength), degrees, measured, models))
    words = [*_closest(fits), *(sentence for fit in fits for sentence in _energy(fit.model, albedo))]
    return Comparison(material, tuple(fits), tuple(dolp), tuple(brewster), tuple(albedo), tuple(words))


def compare_material(
    material: str, table: str | Path, fits: Sequence[str | Path], path: str | Path, rows: str | Path
) -> None:
    """Compare the fits of a material, from files to files (`compare`, `Comparison.write`)."""
    compare(material, read_table(table), [read_fit(fit) for fit in fits]).write(path, rows)


def gather(comparisons: Sequence[str | Path], path: str | Path, rows: str | Path) -> None:
    """Put the comparisons of several materials into one document and one CSV.

    Curves stay with their materials; what remains are figures that can stand side by side.

    Raises
    ------
    InputError
        If a comparison cannot be read.
    """
    contents = [read_document(comparison, KIND) for comparison in comparisons]
    kept = ("material", "wavelengths", "words", "models", "brewster", "albedo")
    materials = [{name: content[name] for name in kept} for content in contents]
    write_document(path, "comparisons/1", {"materials": materials})
    write_text(rows, csv_text(row for content in materials for row in csv_rows(content)))


def _model_content(fit: FitResult) -> dict[str, Any]:
    unit = COST_UNITS[fit.options.cost]
    held = None
    if fit.held_out is not None:
        held = {"theta_d_deg": list(fit.held_out.theta_d_deg), **_error_content(fit.held_out.residuals, unit)}
    return {
        "model": fit.model,
        "parameters": fit.parameter_content(),
        "bounds_met": list(fit.bounds_met),
        "undetermined": list(fit.undetermined),
        "remarks": list(fit.remarks),
        "fitted": _error_content(fit.residuals, unit),
        "held_out": held,
    }


def _error_content(found: Residuals, unit: str) -> dict[str, Any]:
    return {
        "cost": {"unit": unit, "total": found.cost, "per_node": found.cost_per_node},
        "relative": {"unit": "root mean square of M00", "values": found.relative},
    }


def _check(data: TableData, fits: Sequence[FitResult]) -> None:
    if not fits:
        raise InputError("compare", "fits", "are none", "give the fit of at least one model")
    for fit in fits:
        if fit.wavelengths_nm != tuple(float(w) for w in data.wavelengths_nm):
            raise InputError("compare", f"fit of {fit.model}", "is of other bands", "fit this table")


def _closest(fits: Sequence[FitResult]) -> list[str]:
    """Which model comes closest: where it has not looked, if that is known of all."""
    if len(fits) < 2 or len({fit.options.cost for fit in fits}) > 1:
        return []
    outside = [fit.held_out.residuals for fit in fits if fit.held_out is not None]
    judged = outside if len(outside) == len(fits) else [fit.residuals for fit in fits]
    where = "slabs of θd that were held out" if judged is outside else "the nodes that were fitted"
    order = np.argsort([found.cost_per_node for found in judged], kind="stable")
    costs = ", ".join(f"{fits[i].model} {judged[i].cost_per_node:.3g}" for i in order)
    unit = COST_UNITS[fits[0].options.cost]
    return [f"On {where} the cost per node is, in {unit}: {costs}"]


def _energy(model: str, albedo: Sequence[Albedo]) -> list[str]:
    """Whether a model reflects more than comes in."""
    most = max(albedo, key=lambda each: each.models[model])
    value, where = most.models[model], f"at θi = {most.theta_i_deg:g}° and {most.wavelength_nm:g} nm"
    if value > 1 + _CONSERVED:
        return [f"{model} does not conserve energy: it reflects {value:.4g} times what comes in {where}"]
    return [f"{model} conserves energy at the angles looked at: it reflects at most {value:.3g}, {where}"]
