"""What a fit found, in memory and as a JSON document of schema ``pbrdf/fit/1``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pbrdf.errors import InputError
from pbrdf.fitting.options import COST_UNITS, FitOptions
from pbrdf.fitting.residuals import Matrix, Residuals
from pbrdf.formats.documents import member, number, read_document, write_document

_KIND = "fit/1"
_OF = "root mean square of model - table over the nodes, by band, row and column"


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
    standard_errors : tuple of float or None
        Of each value, in the same unit; None where there is none to tell: on a bound, without effect,
        not determined.
    """

    name: str
    meaning: str
    unit: str
    shared: bool
    values: tuple[float, ...]
    standard_errors: tuple[float | None, ...]


@dataclass(frozen=True)
class HeldOut:
    """Error where a fit has not looked: of a second fit, made without some slabs of θd.

    Attributes
    ----------
    theta_d_deg : tuple of float
        The slabs, degrees; of blocks, the first θd of each.
    residuals : Residuals
        There.
    """

    theta_d_deg: tuple[float, ...]
    residuals: Residuals


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
        A sentence for each parameter that the table does not, or hardly, determine.
    remarks : tuple of str
        What else a reader should know, such as what the model cannot follow.
    residuals : Residuals
        At the nodes that were fitted.
    held_out : HeldOut or None
        Error at nodes that were not fitted; None if that was not asked for or not possible.
    options : FitOptions
    starts : tuple of float
        Cost that each start came to, with the kink rounded by 1e-4 of the table's scale.
    evaluations : int
        Evaluations of the cost with its gradient over all starts of the fit to all nodes.
    """

    model: str
    source: str
    digest: str
    wavelengths_nm: tuple[float, ...]
    parameters: tuple[FittedParameter, ...]
    bounds_met: tuple[str, ...]
    undetermined: tuple[str, ...]
    remarks: tuple[str, ...]
    residuals: Residuals
    held_out: HeldOut | None
    options: FitOptions
    starts: tuple[float, ...]
    evaluations: int

    def band(self, index: int) -> dict[str, float]:
        """Parameters of one band by name, as `pbrdf.models.Model.evaluate` takes them."""
        return {p.name: p.values[0 if p.shared else index] for p in self.parameters}

    def parameter_content(self) -> dict[str, Any]:
        """Parameters by name, as the document holds them."""
        return {p.name: _parameter_content(p) for p in self.parameters}

    def write(self, path: str | Path) -> None:
        """Write the JSON document; the same result gives the same bytes."""
        unit = COST_UNITS[self.options.cost]
        held = None
        if self.held_out is not None:
            slabs = {"unit": "deg", "values": list(self.held_out.theta_d_deg)}
            held = {"theta_d": slabs, **_residuals_content(self.held_out.residuals, unit)}
        write_document(
            path,
            _KIND,
            {
                "model": self.model,
                "table": {"source": self.source, "digest": self.digest},
                "wavelengths": {"unit": "nm", "values": list(self.wavelengths_nm)},
                "parameters": self.parameter_content(),
                "bounds_met": list(self.bounds_met),
                "undetermined": list(self.undetermined),
                "remarks": list(self.remarks),
                **_residuals_content(self.residuals, unit),
                "held_out": held,
                "options": self.options.plain(),
                "starts": {"unit": unit, "costs": list(self.starts)},
                "evaluations": self.evaluations,
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
        bounds_met=_texts(path, content, "bounds_met"),
        undetermined=_texts(path, content, "undetermined"),
        remarks=_texts(path, content, "remarks"),
        residuals=_residuals(path, content, "", bands),
        held_out=_held_out(path, content, bands),
        options=_options(path, content),
        starts=_numbers(path, content, "starts.costs"),
        evaluations=int(number(path, content, "evaluations")),
    )


def _residuals_content(found: Residuals, unit: str) -> dict[str, Any]:
    return {
        "cost": {"unit": unit, "total": found.cost, "per_node": found.cost_per_node},
        "residual": {
            "of": _OF,
            "absolute": {"unit": "1/sr", "values": found.rms},
            "relative": {"unit": "root mean square of M00", "values": found.relative},
        },
        "nodes": list(found.nodes),
    }


def _residuals(path: str | Path, content: Mapping[str, Any], before: str, bands: int) -> Residuals:
    return Residuals(
        nodes=tuple(int(n) for n in _numbers(path, content, f"{before}nodes", bands)),
        cost=number(path, content, f"{before}cost.total"),
        rms=_matrices(path, content, f"{before}residual.absolute.values", bands),
        relative=_matrices(path, content, f"{before}residual.relative.values", bands),
    )


def _held_out(path: str | Path, content: Mapping[str, Any], bands: int) -> HeldOut | None:
    if member(path, content, "held_out") is None:
        return None
    slabs = _numbers(path, content, "held_out.theta_d.values")
    return HeldOut(slabs, _residuals(path, content, "held_out.", bands))


def _options(path: str | Path, content: Mapping[str, Any]) -> FitOptions:
    plain = _mapping(path, content, "options")
    defaults = FitOptions().plain()
    for name, default in defaults.items():
        value = member(path, content, f"options.{name}")
        if type(value) is not type(default):
            raise InputError(path, f"options.{name}", f"is {value!r}", "make the fit again")
    return FitOptions.of({name: plain[name] for name in defaults})


def _parameter_content(parameter: FittedParameter) -> dict[str, Any]:
    content: dict[str, Any] = {
        "meaning": parameter.meaning,
        "unit": parameter.unit,
        "shared": parameter.shared,
    }
    if parameter.shared:
        return content | {"value": parameter.values[0], "standard_error": parameter.standard_errors[0]}
    return content | {"values": list(parameter.values), "standard_errors": list(parameter.standard_errors)}


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
    errors = (
        [member(path, content, f"{field}.standard_error")]
        if shared
        else _list(path, content, f"{field}.standard_errors")
    )
    if len(errors) != len(values):
        remedy = f"give {len(values)}, one for each value"
        raise InputError(path, f"{field}.standard_errors", f"has {len(errors)} entries", remedy)
    return FittedParameter(
        name,
        _text(path, content, f"{field}.meaning"),
        _text(path, content, f"{field}.unit"),
        shared,
        values,
        tuple(None if e is None else number(path, {"error": e}, "error") for e in errors),
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


def _texts(path: str | Path, content: Mapping[str, Any], field: str) -> tuple[str, ...]:
    return tuple(str(sentence) for sentence in _list(path, content, field))


def _text(path: str | Path, content: Mapping[str, Any], field: str) -> str:
    value = member(path, content, field)
    if not isinstance(value, str):
        raise InputError(path, field, f"is {value!r}", "give a text")
    return value
