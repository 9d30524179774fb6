"""The fit of a material's table, from file to file."""

from __future__ import annotations

from pathlib import Path

from pbrdf.fitting.driver import fit_table
from pbrdf.fitting.options import FitOptions
from pbrdf.formats.receipt import receipt_content
from pbrdf.formats.table_zarr import read_table


def fit_material(
    table: str | Path, receipt: str | Path, model: str, path: str | Path, options: FitOptions
) -> None:
    """Fit a model to a table and write the result.

    Parameters
    ----------
    table, receipt : str or Path
        The table (Zarr) and its receipt.
    model : str
        Key in `pbrdf.models.MODELS`.
    path : str or Path
        The JSON document to write.
    options : FitOptions
        See there.

    Raises
    ------
    InputError
        If the table cannot be read or cannot be fitted.
    """
    fit_table(read_table(table), model, options, receipt_content(receipt)).write(path)
