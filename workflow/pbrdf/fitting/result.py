"""What a fit found, in memory and as a JSON document of schema ``pbrdf/fit/1``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pbrdf.errors import InputError
from pbrdf.formats.documents import member, number, read_document, write_document

Matrix = tuple[tuple[float, ...], ...]
_KIND = "fit/1"


@dataclass(frozen=True)
class FittedParameter:
    """Values of one parameter.

    Attributes
    ----------
    name, meaning, unit : str
        As the model tells; a unit of "1" is a pure number.
    shared : bool
        One value for all bands.
    values : tuple of float
        One value if shared, else one for each band.
    """

    name: str
    meaning: str
    unit: str
    shared: bool
    values: tuple[float, ...]


@dataclass(frozen=True)
class FitResult:
    """A model fitted to a table.

    Attributes
    ----------
    model : str
        Key in `pbrdf.models.MODELS`.
    source, digest : str
        The table: its file, and the digest of it that the caller gave ("" if none).
    wavelengths_nm : tuple of float
        Bands, nm.
    parameters : tuple of FittedParameter
        The shared ones first.
    bounds_met : tuple of str
        A sentence for each parameter that ended on one of its bounds.
    undetermined : tuple of str
        A sentence for each parameter that has no effect where the search ended.
    cost : float
        Sum over nodes and bands of the Frobenius norm of model − table, 1/sr.
    cost_per_node : float
        The same divided by the number of matrices in the sum, 1/sr.
    residual_rms : tuple of 4×4 tuples
        Root mean square over the nodes of each element of model − table, 1/sr, for each band.
    residual_relative : tuple of 4×4 tuples
        The same divided by the root mean square of the table's M00.
    nodes : tuple of int
        Nodes with a measured value, for each band.
    downsample : int
        Every how manieth node of each direction axis was looked at.
    starts : tuple of float
        Cost that each start came to, 1/sr, with the norm rounded by 1e-4 of the table's scale.
    evaluations : int
        Evaluations of the cost with its gradient over all starts.
    seed : int
        Of the starts.
    """

    model: str
    source: str
    digest: str
    wavelengths_nm: tuple[float, ...]
    parameters: tuple[FittedParameter, ...]
    bounds_met: tuple[str, ...]
    undetermined: tuple[str, ...]
    cost: float
    cost_per_node: float
    residual_rms: tuple[Matrix, ...]
    residual_relative: tuple[Matrix, ...]
    nodes: tuple[int, ...]
    downsample: int
    starts: tuple[float, ...]
    evaluations: int
    seed: int

    def band(self, index: int) -> dict[str, float]:
        """Parameters of one band by name, as `pbrdf.models.Model.evaluate` takes them."""
        return {p.name: p.values[0 if p.shared else index] for p in self.parameters}

    def write(self, path: str | Path) -> None:
        """Write the JSON document; the same result gives the same bytes."""
        write_document(
            path,
            _KIND,
            {
                "model": self.model,
                "table": {"source": self.source, "digest": self.digest},
                "wavelengths": {"unit": "nm", "values": list(self.wavelengths_nm)},
                "parameters": {p.name: _parameter_content(p) for p in self.parameters},
                "bounds_met": list(self.bounds_met),
                "undetermined": list(self.undetermined),
                "cost": {"unit": "1/sr", "total": self.cost, "per_node": self.cost_per_node},
                "residual": {
                    "of": "root mean square of model - table over the nodes, by band, row and column",
                    "absolute": {"unit": "1/sr", "values": self.residual_rms},
                    "relative": {"unit": "root mean square of M00", "values": self.residual_relative},
                },
                "nodes": list(self.nodes),
                "downsample": self.downsample,
                "starts": {"unit": "1/sr", "costs": list(self.starts)},
                "evaluations": self.evaluations,
                "seed": self.seed,
            },
        )


def read_fit(path: str | Path) -> FitResult:
    """Read a fit.

    Raises
    ------
    InputError
        If the document is of another schema, or a field is missing or of the wrong kind.
    """
    content = read_document(path, _KIND)
    wavelengths = _numbers(path, content, "wavelengths.values")
    bands = len(wavelengths)
    return FitResult(
        model=_text(path, content, "model"),
        source=_text(path, content, "table.source"),
        digest=_text(path, content, "table.digest"),
        wavelengths_nm=wavelengths,
        parameters=tuple(
            _parameter(path, content, name, bands) for name in _mapping(path, content, "parameters")
        ),
        bounds_met=tuple(str(sentence) for sentence in _list(path, content, "bounds_met")),
        undetermined=tuple(str(sentence) for sentence in _list(path, content, "undetermined")),
        cost=number(path, content, "cost.total"),
        cost_per_node=number(path, content, "cost.per_node"),
        residual_rms=_matrices(path, content, "residual.absolute.values", bands),
        residual_relative=_matrices(path, content, "residual.relative.values", bands),
        nodes=tuple(int(n) for n in _numbers(path, content, "nodes", bands)),
        downsample=int(number(path, content, "downsample")),
        starts=_numbers(path, content, "starts.costs"),
        evaluations=int(number(path, content, "evaluations")),
        seed=int(number(path, content, "seed")),
    )


def _parameter_content(parameter: FittedParameter) -> dict[str, Any]:
    content: dict[str, Any] = {
        "meaning": parameter.meaning,
        "unit": parameter.unit,
        "shared": parameter.shared,
    }
    return content | (
        {"value": parameter.values[0]} if parameter.shared else {"values": list(parameter.values)}
    )


def _parameter(path: str | Path, content: Mapping[str, Any], name: str, bands: int) -> FittedParameter:
    field = f"parameters.{name}"
    shared = member(path, content, f"{field}.shared")
    if not isinstance(shared, bool):
        raise InputError(path, f"{field}.shared", f"is {shared!r}", "give true or false")
    values = (
        (number(path, content, f"{field}.value"),)
        if shared
        else _numbers(path, content, f"{field}.values", bands)
    )
    return FittedParameter(
        name,
        _text(path, content, f"{field}.meaning"),
        _text(path, content, f"{field}.unit"),
        shared,
        values,
    )


def _matrices(path: str | Path, content: Mapping[str, Any], field: str, bands: int) -> tuple[Matrix, ...]:
    values = _list(path, content, field)
    shaped = len(values) == bands and all(
        isinstance(matrix, list)
        and len(matrix) == 4
        and all(isinstance(r, list) and len(r) == 4 for r in matrix)
        for matrix in values
    )
    if not shaped:
        raise InputError(path, field, "is not a 4×4 matrix for each band", "make the fit again")
    return tuple(tuple(_numbers(path, {"row": row}, "row", 4) for row in matrix) for matrix in values)


def _numbers(
    path: str | Path, content: Mapping[str, Any], field: str, length: int | None = None
) -> tuple[float, ...]:
    values = _list(path, content, field)
    if length is not None and len(values) != length:
        raise InputError(path, field, f"has {len(values)} entries", f"give {length}, one for each band")
    return tuple(number(path, {field.replace(".", " "): value}, field.replace(".", " ")) for value in values)


def _list(path: str | Path, content: Mapping[str, Any], field: str) -> list[Any]:
    value = member(path, content, field)
    if not isinstance(value, list):
        raise InputError(path, field, f"is {value!r}", "give a list")
    return value


def _mapping(path: str | Path, content: Mapping[str, Any], field: str) -> dict[str, Any]:
    value = member(path, content, field)
    if not isinstance(value, dict):
        raise InputError(path, field, f"is {value!r}", "give an object")
    return value


def _text(path: str | Path, content: Mapping[str, Any], field: str) -> str:
    value = member(path, content, field)
    if not isinstance(value, str):
        raise InputError(path, field, f"is {value!r}", "give a text")
    return value
