"""The table of a material: merged from slices, or brought in from elsewhere; and sent out again."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pbrdf.formats.pbsdf import write_pbsdf
from pbrdf.formats.receipt import write_receipt
from pbrdf.formats.table_data import Origin, TableData
from pbrdf.formats.table_zarr import read_table, write_table
from pbrdf.models.table import open_table
from pbrdf.tabulation.axes import table_axes
from pbrdf.tabulation.fill import fill, measured_only
from pbrdf.tabulation.merge import merge_slices, possible_nodes


def tabulate(
    slices: Sequence[str | Path],
    receipts: Sequence[str | Path],
    path: str | Path,
    receipt: str | Path,
    *,
    material: str,
    nodes: tuple[int, int, int],
    widest_gap_deg: float,
    fill_sigma: float,
    code: str,
) -> None:
    """Merge slices into the table of a material and fill its gaps.

    Parameters
    ----------
    slices, receipts : sequence of paths
        The slices of its lights and their receipts.
    path, receipt : str or Path
        Where the table (Zarr) and its receipt go.
    material : str
        Its name.
    nodes : tuple of int
        Numbers of nodes of θh, θd, φd.
    widest_gap_deg : float
        Widest step of θd between two lights that is interpolated, degrees.
    fill_sigma : float
        First width of the filling Gaussian, nodes.
    code : str
        Digest of the code.

    Raises
    ------
    InputError
        If the slices do not make a table.
    """
    merged = merge_slices(slices, table_axes(*nodes), material, np.radians(widest_gap_deg))
    table = fill(merged, fill_sigma)
    write_table(path, table, {"material": material})
    write_receipt(
        receipt,
        outputs=[path],
        inputs={"slices": receipts},
        settings={
            "nodes": list(nodes),
            "widest_gap_deg": widest_gap_deg,
            "fill_sigma": fill_sigma,
            "code": code,
        },
        summary=coverage(table),
    )


def import_table(
    source: str | Path,
    axes: str | Path | None,
    path: str | Path,
    receipt: str | Path,
    *,
    material: str,
    code: str,
) -> None:
    """Bring in a table in another format.

    Parameters
    ----------
    source : str or Path
        A ``.pbsdf``, a KAIST ``.mat`` or a ``.zarr`` of ours.
    axes : str or Path, optional
        File with the axes of a table that lacks them (`pbrdf.models.table.open_table`).
    path, receipt, material, code
        As for `tabulate`.

    Raises
    ------
    InputError
        If the file cannot be read, or its axes are missing and not given.
    """
    table = open_table(source, axes).data
    write_table(path, table, {"material": material, "imported": Path(source).name})
    write_receipt(
        receipt,
        outputs=[path],
        inputs={"source": [source], **({"axes": [axes]} if axes else {})},
        settings={"code": code},
        summary=coverage(table),
    )


def export_pbsdf(path: str | Path, raw: str | Path, filled: str | Path) -> None:
    """Write a table as two ``.pbsdf``: measured nodes only, and with its gaps filled.

    Raises
    ------
    InputError
        If the table cannot be read, or Mitsuba could not load the result.
    """
    table = read_table(path)
    write_pbsdf(filled, table)
    write_pbsdf(raw, measured_only(table))


def coverage(table: TableData) -> dict[str, Any]:
    """Shares of the nodes with light and camera above the horizon, by origin, bands together."""
    possible = possible_nodes(table)
    bands = len(table.wavelengths_nm)
    total = int(possible.sum()) * bands
    if table.origin is None:
        known = int(np.isfinite(table.mueller[:, possible, 0, 0]).sum())
        return {"possible_nodes": total, "known_share": known / total}
    counts = np.bincount(table.origin[:, possible].ravel(), minlength=len(Origin))
    shares = {f"{origin.name.lower()}_share": int(counts[origin]) / total for origin in Origin if origin}
    return {"possible_nodes": total, **shares}
