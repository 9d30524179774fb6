"""The table of a material: merged from slices, or brought in from elsewhere; and sent out again."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf.formats.receipt import write_receipt
from pbrdf.formats.table_data import Origin, TableData
from pbrdf.formats.table_zarr import ARRAYS, new_table, write_table
from pbrdf.models.table import open_table
from pbrdf.tabulation.axes import Axes
from pbrdf.tabulation.band import Band, bands_of, possible_nodes
from pbrdf.tabulation.consistency import Disagreements, disagreement, write_consistency
from pbrdf.tabulation.fill import inpaint
from pbrdf.tabulation.inverse_map import Slip, paper_axes
from pbrdf.tabulation.merge import merge_band, open_slices
from pbrdf.tabulation.shares import merge_shares, open_shares
from pbrdf.tabulation.symmetry import copy_symmetric, pool_symmetric, require_circle


@dataclass(frozen=True)
class Tabulation:
    """How slices become a table.

    Attributes
    ----------
    nodes : tuple of int
        Numbers of nodes of θh, θd, φd.
    widest_gap_deg : float
        Widest step of θd between two lights that is interpolated, degrees.
    symmetrise : bool
        Whether nodes of one matrix get the mean of their measurements; otherwise symmetries only fill.
    fill_sigma : float
        Narrowest width of the filling Gaussian, steps of θd.
    mapping : {"slices", "paper"}
        Whether the lights gave slices, or shares by the supplement's map.
    slips : tuple of Slip
        Those of the supplement that the shares reproduce.
    """

    nodes: tuple[int, int, int]
    widest_gap_deg: float
    symmetrise: bool
    fill_sigma: float
    mapping: str = "slices"
    slips: tuple[Slip, ...] = ()

    def bands_of_lights(
        self, paths: Sequence[str | Path], axes: Axes, material: str
    ) -> tuple[tuple[int, ...], Iterator[Band]]:
        """Wavelengths (nm) and, one after another, bands of a table merged from slices or shares."""
        if self.mapping == "paper":
            shares = open_shares(paths, axes, material)
            bands_nm = shares[0].bands_nm
            return bands_nm, (merge_shares(shares, index, axes) for index in range(len(bands_nm)))
        slices, gap = open_slices(paths, axes, material), np.radians(self.widest_gap_deg)
        bands_nm = slices[0].bands_nm
        return bands_nm, (merge_band(slices, index, axes, gap) for index in range(len(bands_nm)))


def tabulate(
    slices: Sequence[str | Path],
    receipts: Sequence[str | Path],
    path: str | Path,
    consistency: str | Path,
    receipt: str | Path,
    *,
    material: str,
    settings: Tabulation,
    code: str,
) -> None:
    """Merge slices into the table of a material and fill its gaps, one band after another.

    Parameters
    ----------
    slices, receipts : sequence of paths
        The slices of its lights and their receipts.
    path, consistency, receipt : str or Path
        Where the table (Zarr), what its symmetries say of it, and its receipt go.
    material : str
        Its name.
    settings : Tabulation
    code : str
        Digest of the code.

    Raises
    ------
    InputError
        If the slices do not make a table.

    Notes
    -----
    One band and four lights are in memory at a time, however many there are.
    """
    axes = paper_axes(settings.nodes, settings.slips)
    require_circle(axes, material)
    bands_nm, bands = settings.bands_of_lights(slices, axes, material)
    grid = {
        "wavelength": np.array(bands_nm, np.float64),
        "theta_h": axes.theta_h,
        "theta_d": axes.theta_d,
        "phi_d": axes.phi_d,
    }
    counts = np.zeros(len(Origin), np.int64)
    found = Disagreements(axes.theta_h, axes.theta_d)
    with new_table(path, grid, {"material": material}) as writer:
        for index, band in enumerate(bands):
            found.add(bands_nm[index], disagreement(band))
            if settings.symmetrise:
                pool_symmetric(band)
            else:
                copy_symmetric(band)
            inpaint(band, settings.fill_sigma)
            counts += np.bincount(band.origin.ravel(), minlength=len(Origin))
            writer.write(index, {name: getattr(band, name) for name in ARRAYS})
    write_consistency(consistency, found, pooled=settings.symmetrise)
    write_receipt(
        receipt,
        outputs=[path, consistency],
        inputs={"slices": receipts},
        settings={
            "nodes": list(settings.nodes),
            "widest_gap_deg": settings.widest_gap_deg,
            "mapping": settings.mapping,
            "slips": list(settings.slips),
            "symmetrise": settings.symmetrise,
            "fill_sigma": settings.fill_sigma,
            "code": code,
        },
        summary=_shares(counts),
    )


def import_table(
    source: str | Path,
    axes: str | Path | None,
    path: str | Path,
    consistency: str | Path,
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
    path, consistency, receipt, material, code
        As for `tabulate`.

    Raises
    ------
    InputError
        If the file cannot be read, or its axes are missing and not given.
    """
    table = open_table(source, axes).data
    write_table(path, table, {"material": material, "imported": Path(source).name})
    found = Disagreements(table.theta_h, table.theta_d)
    for nm, band in zip(table.wavelengths_nm.tolist(), _judged(table), strict=True):
        found.add(nm, disagreement(band))
    write_consistency(consistency, found, pooled=False)
    write_receipt(
        receipt,
        outputs=[path, consistency],
        inputs={"source": [source], **({"axes": [axes]} if axes else {})},
        settings={"code": code},
        summary=coverage(table),
    )


def coverage(table: TableData) -> dict[str, Any]:
    """Shares of the nodes with light and camera above the horizon, by origin, bands together."""
    if table.origin is not None:
        return _shares(np.bincount(table.origin.ravel(), minlength=len(Origin)))
    possible = possible_nodes(table)
    total = int(possible.sum()) * len(table.wavelengths_nm)
    known = int(np.isfinite(table.mueller[:, possible, 0, 0]).sum())
    return {"possible_nodes": total, "known_share": known / total}


def _shares(counts: NDArray[np.int64]) -> dict[str, Any]:
    """Shares of the origins that can be seen, from the numbers of nodes of each."""
    total = int(counts[1:].sum())
    shares = {f"{origin.name.lower()}_share": int(counts[origin]) / total for origin in Origin if origin}
    return {"possible_nodes": total, **shares}


def _judged(table: TableData) -> Iterator[Band]:
    """Bands of a table; where it tells no origins, what is finite counts as measured."""
    if table.origin is not None:
        yield from bands_of(table)
        return
    for index in range(len(table.wavelengths_nm)):
        finite = np.isfinite(table.mueller[index : index + 1, ..., 0, 0])
        origin = np.where(finite, Origin.MEASURED, Origin.UNSEEN).astype(np.uint8)
        one: dict[str, Any] = {
            name: None if getattr(table, name) is None else getattr(table, name)[index : index + 1]
            for name in ("wavelengths_nm", "mueller", "variance", "count")
        }
        yield from bands_of(replace(table, origin=origin, **one))
