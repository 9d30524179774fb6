"""A material's line in the index, as a small document, so that the index needs no table to be opened."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from pbrdf.errors import InputError
from pbrdf.formats.documents import member, number, read_document, write_document

_KIND = "index-entry/3"
_CALIBRATION_KIND = "calibration-entry/1"


@dataclass(frozen=True)
class FitEntry:
    """Key figures of a model fitted to a material.

    Attributes
    ----------
    model : str
        Its title.
    error_percent : float
        Median error of M00.
    best, tied : bool
        Whether it is the best of the material by the cost over all elements, or as close.
    """

    model: str
    error_percent: float
    best: bool = False
    tied: bool = False


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
    fits : tuple of FitEntry
    calibration : str
        "measured", "camera file; polarimeter, lights measured", … in words.
    picture, alt : str
        ``data:`` address of a small picture of the material, and what it shows; empty where there is none.
    """

    name: str
    link: str
    kind: str
    bands: int
    coverage_percent: float | None
    fits: tuple[FitEntry, ...]
    calibration: str
    picture: str = ""
    alt: str = ""

    @property
    def best(self) -> FitEntry | None:
        """The fit that is marked as the best."""
        return next((fit for fit in self.fits if fit.best), None)


def write_entry(path: str | Path, entry: IndexEntry) -> None:
    """Write an entry as a document of schema ``pbrdf/index-entry/3``."""
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
        fits=tuple(
            FitEntry(
                _text(path, fit, "model"),
                number(path, fit, "error_percent"),
                _truth(path, fit, "best"),
                _truth(path, fit, "tied"),
            )
            for fit in member(path, content, "fits")
        ),
        calibration=_text(path, content, "calibration"),
        picture=_text(path, content, "picture"),
        alt=_text(path, content, "alt"),
    )


def _text(path: str | Path, content: Mapping[str, Any], field: str) -> str:
    value = member(path, content, field)
    if not isinstance(value, str):
        raise InputError(path, field, f"is {value!r}", "make the file again")
    return value


def _truth(path: str | Path, content: Mapping[str, Any], field: str) -> bool:
    value = member(path, content, field)
    if not isinstance(value, bool):
        raise InputError(path, field, f"is {value!r}", "make the file again")
    return value


def _number_or_none(path: str | Path, content: Mapping[str, Any], field: str) -> float | None:
    return None if member(path, content, field) is None else number(path, content, field)


def calibration_words(sources: Mapping[str, str]) -> str:
    """Tell in a few words where the calibrations come from."""
    if not sources:
        return "not known"
    by_source: dict[str, list[str]] = {}
    for name, source in sources.items():
        by_source.setdefault(source, []).append(name)
    if len(by_source) == 1:
        return next(iter(by_source))
    return "; ".join(f"{', '.join(names)} {source}" for source, names in sorted(by_source.items()))


@dataclass(frozen=True)
class CalibrationEntry:
    """A calibration's line in the index.

    Attributes
    ----------
    subject, kind, link : str
        Its session (of a sphere the material), what was calibrated, and the relative address of its page.
    source, verdict : str
        As its document tells them.
    """

    subject: str
    kind: str
    link: str
    source: str
    verdict: str


def write_calibration_entry(path: str | Path, entry: CalibrationEntry) -> None:
    """Write an entry as a document of schema ``pbrdf/calibration-entry/1``."""
    write_document(path, _CALIBRATION_KIND, asdict(entry))


def read_calibration_entry(path: str | Path) -> CalibrationEntry:
    """Read an entry (`InputError` if a field is missing or of the wrong type)."""
    content = read_document(path, _CALIBRATION_KIND)
    return CalibrationEntry(
        **{field.name: _text(path, content, field.name) for field in fields(CalibrationEntry)}
    )


def calibration_link(document: str | Path) -> str:
    """Relative address of the page of a calibration's document.

    A document lies in the folder of its session, a sphere's in that of its material.
    """
    path = Path(document)
    return f"calibration_{path.parent.name}_{path.stem}.html"
