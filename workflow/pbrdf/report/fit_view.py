"""A fit in figures and words: how good it is, its parameters, its residuals."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from pbrdf.errors import InputError
from pbrdf.fitting import FitResult, FittedParameter
from pbrdf.fitting.objective import select_nodes
from pbrdf.formats.table_data import TableData
from pbrdf.models import MODELS, Model
from pbrdf.models.interface import Parameter
from pbrdf.optics.rusinkiewicz import directions
from pbrdf.report.figures import Float, number

_AT_BOUND = 1e-6
_LEAST_THETA_D = 1e-6


def model_title(name: str) -> str:
    """Name of a model as people write it: ``baek2018`` is Baek 2018."""
    return re.sub(r"([a-z])(\d)", r"\1 \2", name).capitalize()


def check_fit(fit: FitResult, table: TableData) -> None:
    """Refuse a fit of another table, or of a model that is not known (`InputError`)."""
    if fit.model not in MODELS:
        raise InputError("report", "fit.model", f"{fit.model!r} is not known", f"known: {', '.join(MODELS)}")
    if fit.wavelengths_nm != tuple(float(w) for w in table.wavelengths_nm):
        raise InputError(
            "report",
            "fit.wavelengths_nm",
            f"are {fit.wavelengths_nm} where {table.source} has {tuple(table.wavelengths_nm.tolist())}",
            "give the fit of this table",
        )


def model_at(fit: FitResult, band: int, theta_h: Float, theta_d: Float, phi_d: Float) -> Float:
    """Fitted model at angles that broadcast (radians), shape (..., 4, 4), 1/sr.

    At θd = 0, where light and camera coincide, the frames are the limit for the node's own φd.
    """
    to_light, to_camera = directions(theta_h, np.maximum(theta_d, _LEAST_THETA_D), phi_d)
    return _model(fit).evaluate(to_light, to_camera, fit.band(band))


def median_error(fit: FitResult, table: TableData) -> float:
    """Median of |model − table| / table of M00, over the nodes of the fit in all bands, a pure number."""
    nodes = select_nodes(table, fit.downsample)
    errors = []
    for band in range(len(table.wavelengths_nm)):
        measured = nodes.mueller[band, :, 0, 0].astype(np.float64)
        used = (nodes.weight[band] > 0) & (measured > 0)
        values = _model(fit).evaluate(nodes.to_light[used], nodes.to_camera[used], fit.band(band))
        errors.append(np.abs(values[:, 0, 0] / measured[used] - 1.0))
    return float(np.median(np.concatenate(errors)))


def polarised_residual(fit: FitResult, band: int) -> float:
    """Largest root mean square of the elements other than M00, relative to that of M00, a pure number."""
    return max(v for i, row in enumerate(fit.residual_relative[band]) for j, v in enumerate(row) if i or j)


def fit_view(fit: FitResult, first_band: int) -> dict[str, Any]:
    """Gather what the page's template shows of a fit; residuals of `first_band` come first."""
    order = [first_band, *(b for b in range(len(fit.wavelengths_nm)) if b != first_band)]
    limits = {p.name: p for p in _model(fit).parameters}
    return {
        "title": model_title(fit.model),
        "parameters": [_parameter_row(p, limits[p.name]) for p in fit.parameters],
        "bounds_met": list(fit.bounds_met),
        "residuals": [
            {
                "wavelength": fit.wavelengths_nm[band],
                "nodes": fit.nodes[band],
                "rows": [
                    list(zip(absolute, (100 * r for r in relative), strict=True))
                    for absolute, relative in zip(
                        fit.residual_rms[band], fit.residual_relative[band], strict=True
                    )
                ],
            }
            for band in order
        ],
        "search": _search(fit),
    }


def _model(fit: FitResult) -> Model:
    return MODELS[fit.model]


def _parameter_row(fitted: FittedParameter, limits: Parameter) -> dict[str, Any]:
    upper = "and above" if np.isinf(limits.upper) else f"to {number(limits.upper)}"
    return {
        "name": fitted.name,
        "meaning": fitted.meaning,
        "unit": "no unit" if fitted.unit == "1" else fitted.unit,
        "shared": fitted.shared,
        "cells": [{"value": v, "at_bound": _at_bound(v, limits)} for v in fitted.values],
        "bounds": f"{number(limits.lower)} {upper}",
    }


def _at_bound(value: float, limits: Parameter) -> bool:
    finite = [bound for bound in (limits.lower, limits.upper) if np.isfinite(bound)]
    return any(abs(value - bound) <= _AT_BOUND * (abs(bound) or 1.0) for bound in finite)


def _search(fit: FitResult) -> list[dict[str, Any]]:
    nodes = ", ".join(f"{n} at {w:g} nm" for n, w in zip(fit.nodes, fit.wavelengths_nm, strict=True))
    starts = ", ".join(number(cost, 6) for cost in fit.starts)
    return [
        {"name": "cost, sum of Frobenius norms", "value": fit.cost, "unit": "1/sr"},
        {"name": "cost per node", "value": fit.cost_per_node, "unit": "1/sr"},
        {"name": "nodes used", "value": nodes},
        {"name": "down-sampling", "value": f"every {_ordinal(fit.downsample)}node of each direction axis"},
        {"name": "cost of each start, 1/sr", "value": starts},
        {"name": "evaluations", "value": fit.evaluations, "unit": ""},
        {"name": "seed", "value": fit.seed, "unit": ""},
    ]


def _ordinal(n: int) -> str:
    """Return "4th " for 4, with its space, and nothing for 1."""
    ending = "th" if 10 <= n % 100 <= 20 else {1: "st", 2: "nd", 3: "rd"}.get(n % 10, "th")
    return "" if n == 1 else f"{n}{ending} "
