"""The fit of a material's table, from file to file."""

from __future__ import annotations

from pathlib import Path

from pbrdf.fitting.driver import fit
from pbrdf.formats.receipt import receipt_content
from pbrdf.formats.table_zarr import read_table


def fit_material(
    table: str | Path,
    receipt: str | Path,
    model: str,
    path: str | Path,
    *,
    downsample: int,
    starts: int,
    seed: int,
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
    downsample, starts, seed : int
        See `pbrdf.fitting.fit`.

    Raises
    ------
    InputError
        If the table cannot be read or cannot be fitted.
    """
    result = fit(
        read_table(table),
        model,
        downsample=downsample,
        starts=starts,
        seed=seed,
        digest=receipt_content(receipt),
    )
    result.write(path)
