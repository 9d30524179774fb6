"""The page of two tables, one beside the other and their difference."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from pbrdf.formats.documents import write_text
from pbrdf.formats.receipt import digest
from pbrdf.formats.table_data import TableData
from pbrdf.models.table import open_table
from pbrdf.report.curves import against_theta_d
from pbrdf.report.figures import Float, Picture, number
from pbrdf.report.html import render
from pbrdf.report.mueller_panels import compared, slice_at
from pbrdf.report.table_comparison import (
    BandDifference,
    at_nodes_of,
    common_bands,
    compare_tables,
    write_comparison,
)
from pbrdf.report.table_view import SHOWN_NM, SHOWN_THETA_D, curves_of, theta_d_node

Named = Mapping[str, str | Path]


def write_comparison_page(tables: Named, page: str | Path, document: str | Path) -> None:
    """Compare two tables and write the page and its figures.

    Parameters
    ----------
    tables : mapping of str to path
        Two names, as they are shown, and their tables: ``.zarr``, ``.pbsdf`` or ``.mat``.
    page, document : str or Path
        What is written: HTML, and JSON of schema ``pbrdf/table-comparison/1``.

    Raises
    ------
    InputError
        If a table cannot be read, or they have no band or known node in common.
    """
    names = tuple(tables)
    first, other = (open_table(path).data for path in tables.values())
    found = compare_tables(first, other)
    digests = {name: digest([path]) for name, path in tables.items()}
    provenance = {f"{name} (SHA-256)": value for name, value in digests.items()}
    provenance["pbrdf"] = version("pbrdf")
    html = comparison_page((names[0], names[1]), first, other, found, provenance)
    write_comparison(document, (names[0], names[1]), digests, found)
    write_text(page, html)


def comparison_page(
    names: tuple[str, str],
    first: TableData,
    other: TableData,
    found: list[BandDifference],
    provenance: Mapping[str, str],
) -> str:
    """Page of two tables that were compared; the same bytes for the same arguments."""
    bands = [band for band, each in zip(common_bands(first, other), found, strict=True) if each.nodes]
    known = [each for each in found if each.nodes]
    shown = min(range(len(bands)), key=lambda k: abs(known[k].wavelength_nm - SHOWN_NM))
    order = [shown, *(k for k in range(len(bands)) if k != shown)]
    return render(
        "comparison.html.j2",
        title=f"{names[0]} and {names[1]}",
        index=None,
        names=names,
        verdict=verdict(names, known[shown]),
        key_figures=_key_figures(names, known[shown]),
        slices=[_slice(names, first, other, bands[k]) for k in order],
        curves=_curves(names, first, other, bands[shown]),
        bands=known,
        elements=[known[k] for k in order],
        provenance=provenance,
    )


def verdict(names: tuple[str, str], band: BandDifference) -> str:
    """Tell in a sentence how two tables differ in a band."""
    largest = max(v for row in band.elements_rms for v in row)
    return (
        f"At {number(band.wavelength_nm, 4)} nm, over {band.nodes} nodes that both know, M00 of {names[1]} "
        f"is {number(band.scale, 4)} times that of {names[0]} (median); apart from that factor it differs by "
        f"{number(band.m00_scaled_percent)}\u00a0% (median), and the other elements, divided by M00, by at "
        f"most {number(largest)} rms."
    )


def _key_figures(names: tuple[str, str], band: BandDifference) -> list[dict[str, Any]]:
    largest = max(v for row in band.elements_rms for v in row)
    return [
        {"value": band.scale, "unit": "", "digits": 4, "label": f"M00 of {names[1]} / M00 of {names[0]}"},
        {
            "value": band.m00_scaled_percent,
            "unit": "%",
            "digits": 3,
            "label": "median difference of M00 apart from that factor",
        },
        {
            "value": largest,
            "unit": "",
            "digits": 3,
            "label": "largest rms difference of another element, divided by M00",
        },
    ]


def _slice(names: tuple[str, str], first: TableData, other: TableData, band: int) -> dict[str, Any]:
    node = theta_d_node(first, band, SHOWN_THETA_D)
    shown = slice_at(first, band, node)
    every = (np.arange(len(first.theta_h)), np.array([node]), np.arange(len(first.phi_d)))
    theirs = at_nodes_of(first, other, band, every)[:, 0]
    titles = (*names, f"{names[1]} − {names[0]}")
    return {"where": shown.where, "pictures": compared(shown, theirs, titles)}


def _curves(names: tuple[str, str], first: TableData, other: TableData, band: int) -> Picture:
    def theirs(half: int, azimuth: int) -> Float:
        every = (np.array([half]), np.arange(len(first.theta_d)), np.array([azimuth]))
        return at_nodes_of(first, other, band, every)[0, :, 0].astype(np.float64)

    drawn = curves_of(first, band, {names[1]: theirs})
    return against_theta_d(drawn, float(first.wavelengths_nm[band]), names[0])
