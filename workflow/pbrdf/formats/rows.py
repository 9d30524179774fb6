"""Tables that the user writes as text: comma- or tab-separated, with a header."""

from __future__ import annotations

import csv
import io
from pathlib import Path

from pbrdf.errors import InputError

Row = dict[str, str | None]


def read_rows(
    path: str | Path, columns: tuple[str, ...], delimiter: str, named_in: str
) -> list[tuple[int, Row]]:
    """Read a table of text.

    Parameters
    ----------
    path : str or Path
        UTF-8, with or without a byte order mark.
    columns : tuple of str
        The header it must have.
    delimiter : str
        What separates cells.
    named_in : str
        Where the user named this file, for the remedy when it is not there.

    Returns
    -------
    list of (line number, cells by column)

    Raises
    ------
    InputError
        If the file is missing, not UTF-8, empty, of other columns, or a cell is too long.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(path, "file", "does not exist", f"correct {named_in}")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(path, "file", f"is not UTF-8 ({error.reason})", "save it as UTF-8") from None
    with io.StringIO(text, newline="") as lines:
        reader = csv.DictReader(lines, delimiter=delimiter)
        try:
            if tuple(reader.fieldnames or ()) != columns:
                remedy = f"write the columns {delimiter.join(columns)}".replace("\t", " <tab> ")
                raise InputError(path, "header", f"is {reader.fieldnames}", remedy)
            rows = [(reader.line_num, row) for row in reader]
        except csv.Error as error:
            raise InputError(path, f"line {reader.line_num}", f"is no row ({error})", "correct it") from None
    if not rows:
        raise InputError(path, "rows", "there are none", "write one below the header")
    return rows
