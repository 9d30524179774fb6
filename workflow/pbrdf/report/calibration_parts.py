"""What a calibration's page is made of: tables of values with their errors, and sections with pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from pbrdf.report.figures import Picture


@dataclass(frozen=True)
class Number:
    """A value of the document, shown with some digits; `zeros` says whether also with zeros at their end."""

    value: float | int
    digits: int = 3
    zeros: bool = False


Cell = Number | str
NONE = "–"
VALUE_HEAD = ("quantity", "value", "standard error", "unit")


@dataclass(frozen=True)
class Grid:
    """A table: the first cell of a row names it.

    Attributes
    ----------
    caption : str
    head : sequence of str
        Names of the columns, units in them where a column has one unit.
    rows : sequence of sequence of Cell
    """

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]


@dataclass(frozen=True)
class Section:
    """Pictures of one thing, with a caption and tables."""

    title: str
    pictures: Sequence[Picture] = ()
    caption: str = ""
    tables: Sequence[Grid] = ()
    side_by_side: bool = False


@dataclass(frozen=True)
class CalibrationView:
    """Content of a calibration's page.

    Attributes
    ----------
    values : sequence of Grid
        Tables that come before the pictures.
    sections : sequence of Section
    notes : sequence of str
        What the measurement leaves open, in sentences.
    """

    values: Sequence[Grid]
    sections: Sequence[Section] = ()
    notes: Sequence[str] = field(default=())


def with_error(value: float, error: float) -> tuple[Number, Number]:
    """A value to the second digit of its standard error, and that error."""
    known = error > 0
    return Number(value, _digits(value, error), known), Number(error, 2, known)


def value_row(name: str, value: float, error: float | None, unit: str, digits: int = 4) -> list[Cell]:
    """Row of a table whose columns are quantity, value, standard error and unit."""
    if error is None or not error > 0:
        return [name, Number(value, digits), NONE, unit]
    return [name, *with_error(value, error), unit]


def _digits(value: float, error: float) -> int:
    """Significant digits of a value down to the second one of its error."""
    if not error > 0 or value == 0:
        return 4
    # as it is written: 0.00996 is 0.010 to two digits
    written = float(f"{error:.1e}")
    return int(np.clip(np.floor(np.log10(abs(value))) - np.floor(np.log10(written)) + 2, 2, 9))
