"""A fit in figures and words: how good it is, its parameters, its residuals."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from pbrdf.errors import InputError
from pbrdf.fitting import FitResult, FittedParameter
from pbrdf.fitting.nodes import select_nodes
from pbrdf.fitting.options import COST_UNITS, FitOptions, Thinning
from pbrdf.fitting.residuals import Residuals
from pbrdf.formats.table_data import TableData
from pbrdf.models import MODELS, Model
from pbrdf.models.interface import CostKind, Parameter
from pbrdf.optics.rusinkiewicz import directions
from pbrdf.report.figures import Float, number

_AT_BOUND = 1e-6
_LEAST_THETA_D = 1e-6


_VARIANTS = {"dhr": "hemispherical weight", "complex": "complex index"}
_COSTS = {
    CostKind.NORMS: "sum of Frobenius norms",
    CostKind.ROOTS: "sum of roots of elements",
    CostKind.SQUARES: "squares over variances",
}


def model_title(name: str) -> str:
    """Name of a model as people write it: ``baek2018_complex`` is Baek 2018, complex index."""
    paper, *variants = name.split("_")
    title = re.sub(r"([a-z])(\d)", r"\1 \2", paper).capitalize()
    return ", ".join([title, *(_VARIANTS.get(variant, variant) for variant in variants)])


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


def ranked(fits: Sequence[FitResult]) -> list[FitResult]:
    """Order fits of one table, the best first.

    The others follow by their cost over all elements. The best has the lowest, or one that is as low within
    the scatter of the nodes (`as_close`) and fewer parameters: a complex index that ends without extinction
    is not better than the real one that it has become.
    """
    order = sorted(fits, key=lambda fit: fit.residuals.cost_per_node)
    if not order:
        return []
    best = min((fit for fit in order if as_close(fit, order[0])), key=parameter_count)
    return [best, *(fit for fit in order if fit is not best)]


def as_close(fit: FitResult, other: FitResult) -> bool:
    """Whether two costs per node are the same within two standard errors of a mean over the nodes.

    Distances of nodes scatter by no more than about their own size, which the mean over N nodes brings down
    by √N.
    """
    costs = [each.residuals.cost_per_node for each in (fit, other)]
    nodes = min(sum(each.residuals.nodes) for each in (fit, other))
    return abs(costs[0] - costs[1]) <= 2.0 * min(costs) / math.sqrt(nodes)


def parameter_count(fit: FitResult) -> int:
    """Numbers that were fitted, over all bands."""
    return sum(1 if p.shared else len(p.values) for p in fit.parameters)


def tie_words(fits: Sequence[FitResult]) -> str:
    """Tell which of the ranked fits are as close as the first; empty if none is."""
    tied = [fit for fit in fits[1:] if as_close(fit, fits[0])]
    if not tied:
        return ""
    titles = " and ".join(model_title(fit.model) for fit in tied)
    words = f" {titles} {'comes' if len(tied) == 1 else 'come'} as close within the scatter of the nodes"
    more = all(parameter_count(fit) > parameter_count(fits[0]) for fit in tied)
    return f"{words}{', with more parameters' if more else ''}."


def model_at(fit: FitResult, band: int, theta_h: Float, theta_d: Float, phi_d: Float) -> Float:
    """Fitted model at angles that broadcast (radians), shape (..., 4, 4), 1/sr.

    At θd = 0, where light and camera coincide, the frames are the limit for the node's own φd.
    """
    to_light, to_camera = directions(theta_h, np.maximum(theta_d, _LEAST_THETA_D), phi_d)
    return model_of(fit).evaluate(to_light, to_camera, fit.band(band))


def median_error(fit: FitResult, table: TableData) -> float:
    """Median of |model − table| / table of M00, over the nodes of the fit in all bands, a pure number."""
    nodes = select_nodes(table, fit.options.downsample, blocks=fit.options.thinning is Thinning.BLOCKS)
    errors = []
    for band in range(len(table.wavelengths_nm)):
        measured = nodes.mueller[band, :, 0, 0].astype(np.float64)
        used = (nodes.weight[band] > 0) & (measured > 0)
        values = model_of(fit).evaluate(nodes.to_light[used], nodes.to_camera[used], fit.band(band))
        errors.append(np.abs(values[:, 0, 0] / measured[used] - 1.0))
    return float(np.median(np.concatenate(errors)))


def polarised_residual(fit: FitResult, band: int) -> float:
    """Largest root mean square of the elements other than M00, relative to that of M00, a pure number."""
    return max(v for i, row in enumerate(fit.residuals.relative[band]) for j, v in enumerate(row) if i or j)


def fit_view(fit: FitResult, first_band: int) -> dict[str, Any]:
    """Gather what the page's template shows of a fit; residuals of `first_band` come first."""
    order = [first_band, *(b for b in range(len(fit.wavelengths_nm)) if b != first_band)]
    limits = {p.name: p for p in model_of(fit).parameters}
    return {
        "title": model_title(fit.model),
        "parameters": [_parameter_row(p, limits[p.name]) for p in fit.parameters],
        "bounds_met": list(fit.bounds_met),
        "undetermined": list(fit.undetermined),
        "remarks": list(fit.remarks),
        "residuals": [_residual_view(fit.residuals, fit.wavelengths_nm[band], band) for band in order],
        "search": _search(fit),
    }


def _residual_view(residuals: Residuals, wavelength: float, band: int) -> dict[str, Any]:
    pairs = zip(residuals.rms[band], residuals.relative[band], strict=True)
    return {
        "wavelength": wavelength,
        "nodes": residuals.nodes[band],
        "rows": [
            list(zip(absolute, (100 * r for r in relative), strict=True)) for absolute, relative in pairs
        ],
    }


def model_of(fit: FitResult) -> Model:
    """Model that was fitted."""
    return MODELS[fit.model]


def _parameter_row(fitted: FittedParameter, limits: Parameter) -> dict[str, Any]:
    upper = "and above" if np.isinf(limits.upper) else f"to {number(limits.upper)}"
    return {
        "name": fitted.name,
        "meaning": fitted.meaning,
        "unit": "no unit" if fitted.unit == "1" else fitted.unit,
        "shared": fitted.shared,
        "cells": [
            {"value": value, "error": error, "at_bound": _at_bound(value, limits)}
            for value, error in zip(fitted.values, fitted.standard_errors, strict=True)
        ],
        "bounds": f"{number(limits.lower)} {upper}",
    }


def _at_bound(value: float, limits: Parameter) -> bool:
    finite = [bound for bound in (limits.lower, limits.upper) if np.isfinite(bound)]
    return any(abs(value - bound) <= _AT_BOUND * (abs(bound) or 1.0) for bound in finite)


def _search(fit: FitResult) -> list[dict[str, Any]]:
    found, options = fit.residuals, fit.options
    unit = COST_UNITS[options.cost].removeprefix("1") and COST_UNITS[options.cost]
    nodes = ", ".join(f"{n} at {w:g} nm" for n, w in zip(found.nodes, fit.wavelengths_nm, strict=True))
    rows: list[dict[str, Any]] = [
        {"name": f"cost, {_COSTS[options.cost]}", "value": found.cost, "unit": unit},
        {"name": "cost per node", "value": found.cost_per_node, "unit": unit},
    ]
    if fit.held_out is not None:
        slabs = ", ".join(f"{angle:g}°" for angle in fit.held_out.theta_d_deg)
        name = f"cost per node at θd {slabs}, fitted without them"
        rows.append({"name": name, "value": fit.held_out.residuals.cost_per_node, "unit": unit})
    starts = ", ".join(number(cost, 6) for cost in fit.starts)
    return [
        *rows,
        {"name": "nodes used", "value": nodes},
        {"name": "down-sampling", "value": _thinning(options)},
        {"name": "weights", "value": "solid angle" if options.solid_angle else "every node alike"},
        {"name": f"cost of each start{', ' if unit else ''}{unit}", "value": starts},
        {"name": "evaluations", "value": fit.evaluations, "unit": ""},
        {"name": "seed", "value": options.seed, "unit": ""},
    ]


def _thinning(options: FitOptions) -> str:
    if options.thinning is Thinning.BLOCKS:
        return f"means of blocks of {options.downsample} nodes of each direction axis"
    return f"every {_ordinal(options.downsample)}node of each direction axis"


def _ordinal(n: int) -> str:
    """Return "4th " for 4, with its space, and nothing for 1."""
    ending = "th" if 10 <= n % 100 <= 20 else {1: "st", 2: "nd", 3: "rd"}.get(n % 10, "th")
    return "" if n == 1 else f"{n}{ending} "
