"""The fit as a user calls it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.fitting.nodes import hold_out, select_nodes
from pbrdf.fitting.objective import Objective
from pbrdf.fitting.options import FitOptions, Thinning
from pbrdf.fitting.residuals import residuals
from pbrdf.fitting.result import FitResult, FittedParameter, HeldOut
from pbrdf.fitting.solver import LAST_EPSILON, solve, solve_from
from pbrdf.fitting.uncertainty import Uncertainty, estimate
from pbrdf.fitting.words import Labels, bounds_met, remarks, undetermined
from pbrdf.formats.table_data import TableData
from pbrdf.models import MODELS
from pbrdf.models.interface import CostKind
from pbrdf.models.table import Table

Float = NDArray[np.float64]


def fit(
    table: Table | TableData,
    model: str = "baek2018",
    *,
    downsample: int = 4,
    thinning: str = Thinning.NODES,
    cost: str = CostKind.NORMS,
    solid_angle: bool = False,
    held_out: bool = False,
    starts: int = 3,
    seed: int = 0,
    digest: str = "",
) -> FitResult:
    """Fit an analytic model to a table, all bands together.

    By default the cost is the sum of the Frobenius norms of model − table over every fourth node of
    each direction axis, as in the supplement of Baek et al. 2020.

    Parameters
    ----------
    table : Table or TableData
        The table; nodes that are not measured are left out.
    model : str
        Key in `pbrdf.models.MODELS`.
    downsample, thinning, cost, solid_angle, held_out, starts, seed
        See `pbrdf.fitting.FitOptions`.
    digest : str
        Of the table, to be kept with the result.

    Returns
    -------
    FitResult

    Raises
    ------
    InputError
        If the model is not known, an option makes no sense, a band has no measured node or none with a
        positive M00, or the cost needs variances that the table lacks.

    Examples
    --------
    >>> import pbrdf
    >>> result = pbrdf.fit(pbrdf.open_table("gold.zarr"))  # doctest: +SKIP
    >>> result.band(0)["alpha"]  # doctest: +SKIP
    0.08
    """
    data = table if isinstance(table, TableData) else table.data
    options = {"downsample": downsample, "thinning": thinning, "cost": cost, "solid_angle": solid_angle}
    options |= {"held_out": held_out, "starts": starts, "seed": seed}
    return fit_table(data, model, FitOptions.of(options), digest)


def fit_table(data: TableData, model: str, options: FitOptions, digest: str = "") -> FitResult:
    """Fit with options that are checked already; otherwise as `fit`."""
    if model not in MODELS:
        raise InputError("fit", "model", f"{model!r} is not known", f"give one of {', '.join(MODELS)}")
    nodes = select_nodes(
        data,
        options.downsample,
        blocks=options.thinning is Thinning.BLOCKS,
        solid_angle=options.solid_angle,
        with_variance=options.cost is CostKind.SQUARES,
    )
    objective = Objective(MODELS[model], nodes, options.cost)
    solution = solve(objective, options.starts, options.seed)
    vector = solution.vector
    found = residuals(objective, vector)
    uncertainty = estimate(objective, vector, LAST_EPSILON)
    labels = Labels(objective, data.wavelengths_nm)
    notes = remarks(objective, vector, found, uncertainty, data.wavelengths_nm)
    held = None
    if options.held_out:
        held = _error_outside(data, objective, vector)
        if held is None:
            notes = (*notes, "No slab of θd could be held out: the table has too few")
    return FitResult(
        model=model,
        source=data.source,
        digest=digest,
        wavelengths_nm=tuple(float(w) for w in data.wavelengths_nm),
        parameters=_fitted(objective, vector, uncertainty),
        bounds_met=bounds_met(objective, vector, labels),
        undetermined=undetermined(vector, uncertainty, labels),
        remarks=notes,
        residuals=found,
        held_out=held,
        options=options,
        starts=solution.costs,
        evaluations=objective.evaluations,
    )


def _error_outside(data: TableData, objective: Objective, vector: Float) -> HeldOut | None:
    """Error on slabs of θd that a second fit, from where the first ended, has not seen.

    None if no slab can be spared.
    """
    parts = hold_out(objective.nodes)
    if parts is None:
        return None
    kept, held = (Objective(objective.model, part, objective.kind) for part in parts)
    seen = solve_from(kept, [vector])
    slabs = np.unique(held.nodes.indices[:, 1])
    return HeldOut(
        tuple(float(angle) for angle in np.degrees(data.theta_d[slabs])),
        residuals(held, seen.vector),
    )


def _fitted(objective: Objective, vector: Float, uncertainty: Uncertainty) -> tuple[FittedParameter, ...]:
    errors = uncertainty.standard_errors
    fitted = []
    for position, parameter in enumerate(objective.model.parameters):
        bands = range(1 if parameter.shared else objective.bands)
        entries = [objective.band_entries(band)[position] for band in bands]
        fitted.append(
            FittedParameter(
                parameter.name,
                parameter.meaning,
                parameter.unit,
                parameter.shared,
                tuple(float(vector[entry]) for entry in entries),
                tuple(float(errors[e]) if np.isfinite(errors[e]) else None for e in entries),
            )
        )
    return tuple(fitted)
