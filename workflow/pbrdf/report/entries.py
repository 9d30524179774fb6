"""A material's line in the index, as a small document, so that the index needs no table to be opened."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from pbrdf.errors import InputError
from pbrdf.formats.documents import member, number, read_document, write_document

_KIND = "index-entry/1"


@dataclass(frozen=True)
class IndexEntry:
    """Key figures of a material.

    Attributes
    ----------
    name, link : str
        The material, and the relative address of its page.
    kind : str
        "table" or "Mueller image".
    bands : int
    coverage_percent : float or None
        Share of the visible nodes that are measured (known, where the table tells no origins).
    model : str or None
        Title of the fitted model.
    error_percent : float or None
        Median error of M00 of the fit.
    calibration : str
        "measured", "nominal (not measured)", … in words.
    """

    name: str
    link: str
    kind: str
    bands: int
    coverage_percent: float | None
    model: str | None
    error_percent: float | None
    calibration: str


def write_entry(path: str | Path, entry: IndexEntry) -> None:
    """Write an entry as a document of schema ``pbrdf/index-entry/1``."""
    write_document(path, _KIND, asdict(entry))


def read_entry(path: str | Path) -> IndexEntry:
    """Read an entry (`InputError` if a field is missing or of the wrong type)."""
    content = read_document(path, _KIND)
    return IndexEntry(
        name=_text(path, content, "name"),
        link=_text(path, content, "link"),
        kind=_text(path, content, "kind"),
        bands=int(number(path, content, "bands")),
        coverage_percent=_number_or_none(path, content, "coverage_percent"),
        model=None if member(path, content, "model") is None else _text(path, content, "model"),
        error_percent=_number_or_none(path, content, "error_percent"),
        calibration=_text(path, content, "calibration"),
    )


def _text(path: str | Path, content: Mapping[str, Any], field: str) -> str:
    value = member(path, content, field)
    if not isinstance(value, str):
        raise InputError(path, field, f"is {value!r}", "make the file again")
    return value


def _number_or_none(path: str | Path, content: Mapping[str, Any], field: str) -> float | None:
    return None if member(path, content, field) is None else number(path, content, field)


def calibration_words(sources: Mapping[str, str]) -> str:
    """Tell in a few words where the calibrations come from; the nominal ones are named."""
    nominal = [name for name, source in sources.items() if source == "nominal"]
    if not sources:
        return "not known"
    if nominal and len(nominal) == len(sources):
        return "all nominal (not measured)"
    if nominal:
        return f"{', '.join(nominal)} nominal (not measured)"
    return ", ".join(sorted(set(sources.values())))
