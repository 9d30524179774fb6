"""The fit as a user calls it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.fitting.objective import Objective, select_nodes
from pbrdf.fitting.result import FitResult, FittedParameter, Matrix
from pbrdf.fitting.solver import Solution, solve
from pbrdf.formats.table_data import TableData
from pbrdf.models import MODELS
from pbrdf.models.interface import Parameter
from pbrdf.models.table import Table

Float = NDArray[np.float64]


def fit(
    table: Table | TableData,
    model: str = "baek2018",
    *,
    downsample: int = 4,
    starts: int = 3,
    seed: int = 0,
    digest: str = "",
) -> FitResult:
    """Fit an analytic model to a table.

    The cost is the sum of the Frobenius norms of model − table over the nodes, all bands together
    (the supplement of Baek et al. 2020: sum of the square roots of the squared differences; a
    quarter of the nodes of each direction axis).

    Parameters
    ----------
    table : Table or TableData
        The table; nodes that are not measured are left out.
    model : str
        Key in `pbrdf.models.MODELS`.
    downsample : int
        Every how manieth node of each direction axis to look at.
    starts : int
        Searches to make; the best counts.
    seed : int
        Of the starts; the same seed gives the same result to the last bit.
    digest : str
        Of the table, to be kept with the result.

    Returns
    -------
    FitResult

    Raises
    ------
    InputError
        If the model is not known, `downsample`, `starts` or `seed` make no sense, or a band has no
        measured node or nothing but zeros.

    Examples
    --------
    >>> import pbrdf
    >>> result = pbrdf.fit(pbrdf.open_table("gold.zarr"))  # doctest: +SKIP
    >>> result.band(0)["alpha"]  # doctest: +SKIP
    0.08
    """
    if model not in MODELS:
        raise InputError("fit", "model", f"{model!r} is not known", f"give one of {', '.join(MODELS)}")
    if starts < 1:
        raise InputError("fit", "starts", f"is {starts}", "give a whole number of at least 1")
    if seed < 0:
        raise InputError("fit", "seed", f"is {seed}", "give a whole number of at least 0")
    data = table if isinstance(table, TableData) else table.data
    objective = Objective(MODELS[model], select_nodes(data, downsample))
    solution = solve(objective, starts, seed)
    residuals = [_residual(objective, solution.vector, band) for band in range(objective.bands)]
    cost = float(sum(np.linalg.norm(r, axis=(-2, -1)).sum() for r, _ in residuals))
    counts = tuple(len(r) for r, _ in residuals)
    return FitResult(
        model=model,
        source=data.source,
        digest=digest,
        wavelengths_nm=tuple(float(w) for w in data.wavelengths_nm),
        parameters=_fitted(objective, solution.vector),
        bounds_met=_bounds_met(objective, solution.vector, data.wavelengths_nm),
        undetermined=_undetermined(objective, solution, data.wavelengths_nm),
        cost=cost,
        cost_per_node=cost / sum(counts),
        residual_rms=tuple(_matrix(_rms(r)) for r, _ in residuals),
        residual_relative=tuple(_matrix(_rms(r) / _rms(m00)) for r, m00 in residuals),
        nodes=counts,
        downsample=downsample,
        starts=solution.costs,
        evaluations=objective.evaluations,
        seed=seed,
    )


def _residual(objective: Objective, vector: Float, band: int) -> tuple[Float, Float]:
    """Model − table (n, 4, 4) and the table's M00 (n,) over the nodes measured in one band."""
    nodes = objective.nodes
    used = nodes.weight[band] > 0
    table = nodes.mueller[band, used].astype(np.float64)
    values = objective.model.evaluate(
        nodes.to_light[used], nodes.to_camera[used], objective.band_parameters(vector, band)
    )
    return values - table, table[:, 0, 0]


def _rms(values: Float) -> Float:
    rms: Float = np.sqrt(np.mean(values**2, axis=0))
    return rms


def _matrix(values: Float) -> Matrix:
    return tuple(tuple(float(v) for v in row) for row in values)


def _values(objective: Objective, vector: Float, parameter: Parameter) -> tuple[float, ...]:
    bands = 1 if parameter.shared else objective.bands
    return tuple(objective.band_parameters(vector, band)[parameter.name] for band in range(bands))


def _fitted(objective: Objective, vector: Float) -> tuple[FittedParameter, ...]:
    return tuple(
        FittedParameter(p.name, p.meaning, p.unit, p.shared, _values(objective, vector, p))
        for p in objective.model.parameters
    )


def _label(parameter: Parameter, band: int, wavelengths: Float) -> str:
    return parameter.name if parameter.shared else f"{parameter.name} at {wavelengths[band]:g} nm"


def _bounds_met(objective: Objective, vector: Float, wavelengths: Float) -> tuple[str, ...]:
    sentences = []
    for parameter in objective.model.parameters:
        for band, value in enumerate(_values(objective, vector, parameter)):
            for side, bound in (("lower", parameter.lower), ("upper", parameter.upper)):
                if value == bound:
                    sentences.append(
                        f"{_label(parameter, band, wavelengths)} ended on its {side} bound {bound:g}"
                    )
    return tuple(sentences)


def _undetermined(objective: Objective, solution: Solution, wavelengths: Float) -> tuple[str, ...]:
    """Sentences on parameters that do not enter: the roughness where no band has a specular weight."""
    sentences = []
    for position, parameter in enumerate(objective.model.parameters):
        for band in range(1 if parameter.shared else objective.bands):
            if solution.gradient[objective.band_entries(band)[position]] == 0.0:
                label = _label(parameter, band, wavelengths)
                sentences.append(f"{label} is not determined: the other parameters leave it no effect")
    return tuple(sentences)
