"""The parts of a material's page that are cut from its table: slices, curves, coverage."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf.fitting import FitResult
from pbrdf.formats.table_data import Origin, TableData
from pbrdf.report.coverage_maps import ORIGIN_COLOURS, coverage_maps
from pbrdf.report.curves import Curve, against_theta_d
from pbrdf.report.figures import Float, Picture, number
from pbrdf.report.fit_view import model_at, model_title
from pbrdf.report.mueller_panels import compared, slice_at
from pbrdf.report.panels_data import TableSlice
from pbrdf.report.visibility import ORIGIN_NAMES, Coverage, visible_nodes

SHOWN_NM = 550.0
SHOWN_THETA_D = 30.0
OTHER_THETA_D = (10.0, 60.0)
MOST_OTHER_BANDS = 4
OFFERED_THETA_D = (5.0, 10.0, 20.0, 30.0, 45.0, 60.0, 75.0)
OFFERED_PHI_D = (0.0, 45.0, 90.0, 135.0, 180.0)
MOST_BANDS_OFFERED = 12
"""Bands from which on a page has the default slices alone: their scripts would fill the disk."""
CURVE_THETA_H = (0.0, 10.0, 40.0)
CURVE_PHI_D = 90.0
"""Here θi = θo, and every θd is above the horizon."""

FILLED = (Origin.MIRRORED, Origin.RECIPROCAL, Origin.INPAINTED)
PUBLISHED_GRID = (91, 91, 361)


def default_band(table: TableData) -> int:
    """Band nearest to 550 nm, where eyes and cameras see best: the one a page opens with."""
    return int(np.abs(table.wavelengths_nm - SHOWN_NM).argmin())


def slice_views(
    table: TableData, fit: FitResult | None, band: int, *, whole: bool = True
) -> list[dict[str, Any]]:
    """Pictures of slices: the default one, then, where `whole`, other bands, and other θd."""
    shown = _shown_slices(table, band)
    if not whole:
        # for readers without scripts: the controls of others reach the rest
        shown = shown[:1]
    return [_slice_view(table, fit, *at) for at in shown]


def whole_slices(table: TableData) -> list[TableSlice]:
    """Slices of which every node is written down: over φd at the default θd, and over θd where θi = θo."""
    node = theta_d_node(table, default_band(table), SHOWN_THETA_D)
    return [
        TableSlice("theta_d", "phi_d", node),
        TableSlice("phi_d", "theta_d", _phi_d_node(table, CURVE_PHI_D)),
    ]


def offered_slices(table: TableData) -> list[TableSlice]:
    """Slices that a page's controls choose from, none twice: the whole ones, and others beside them."""
    over_phi, over_theta = whole_slices(table)
    if len(table.wavelengths_nm) > MOST_BANDS_OFFERED:
        return [over_phi, over_theta]
    band = default_band(table)
    differences = {over_phi.node, *(theta_d_node(table, band, degrees) for degrees in OFFERED_THETA_D)}
    azimuths = {over_theta.node, *(_phi_d_node(table, degrees) for degrees in OFFERED_PHI_D)}
    return [
        *(TableSlice("theta_d", "phi_d", node) for node in sorted(differences)),
        *(TableSlice("phi_d", "theta_d", node) for node in sorted(azimuths)),
    ]


def _phi_d_node(table: TableData, degrees: float) -> int:
    return int(np.abs(np.degrees(table.phi_d) - degrees).argmin())


def curves(table: TableData, fits: Sequence[FitResult], band: int) -> Picture:
    """Draw table and fits along θd at three θh."""
    models = {model_title(fit.model): partial(_along_theta_d, table, fit, band) for fit in fits}
    return against_theta_d(curves_of(table, band, models), float(table.wavelengths_nm[band]))


def curves_of(table: TableData, band: int, others: Mapping[str, Callable[[int, int], Float]]) -> list[Curve]:
    """Gather the table along θd at three θh, and others beside it.

    `others` give matrices (D, 4, 4) for a node of θh and one of φd, by their titles.
    """
    azimuth = _phi_d_node(table, CURVE_PHI_D)
    halves = dict.fromkeys(int(np.abs(np.degrees(table.theta_h) - d).argmin()) for d in CURVE_THETA_H)
    visible, filled = visible_nodes(table, band)[:, :, azimuth], filled_nodes(table, band)[:, :, azimuth]
    drawn = []
    for half in halves:
        values = {"": table.mueller[band, half, :, azimuth].astype(np.float64)}
        values |= {title: other(half, azimuth) for title, other in others.items()}
        for matrices in values.values():
            matrices[~visible[half]] = np.nan
        variance = None if table.variance is None else table.variance[band, half, :, azimuth]
        angles = (float(table.theta_h[half]), float(table.phi_d[azimuth]))
        measured = values.pop("")
        drawn.append(Curve(*angles, table.theta_d, measured, filled[half], values, variance))
    return drawn


def _along_theta_d(table: TableData, fit: FitResult, band: int, half: int, azimuth: int) -> Float:
    theta_h = np.full_like(table.theta_d, table.theta_h[half])
    return model_at(fit, band, theta_h, table.theta_d, np.asarray(table.phi_d[azimuth]))


def filled_nodes(table: TableData, band: int) -> NDArray[np.bool_]:
    """Nodes of a band that are no measurement, but copied or interpolated, shape (H, D, P)."""
    if table.origin is None:
        return np.zeros(table.mueller.shape[1:4], np.bool_)
    return np.isin(table.origin[band], FILLED)


def coverage_view(table: TableData, covered: Coverage, band: int) -> dict[str, Any]:
    """Gather what the page's template shows of a table's coverage, and what the table leaves untold."""
    rows: list[dict[str, Any]]
    if covered.origins:
        rows = [
            {"name": ORIGIN_NAMES[origin], "percent": 100 * share, "colour": ORIGIN_COLOURS[origin]}
            for origin, share in sorted(covered.origins.items(), key=lambda item: item[0] != Origin.MEASURED)
        ]
    else:
        rows = [
            {"name": "known", "percent": 100 * covered.known, "colour": None},
            {"name": "not known", "percent": 100 * (1 - covered.known), "colour": None},
        ]
    return {
        "picture": coverage_maps(table, band),
        "rows": rows,
        "visible": covered.visible,
        "missing": _missing(table),
    }


def _missing(table: TableData) -> list[str]:
    sentences = []
    if table.origin is None:
        sentences.append(
            "The table does not tell where its values come from: measured and filled look alike."
        )
    if table.count is None:
        sentences.append("The table does not tell how many photographs stand behind a node.")
    if table.variance is None:
        sentences.append("The table holds no variance: nothing here tells how certain a value is.")
    dark, known = _dark_and_known(table)
    if dark:
        sentences.append(
            f"M00 is zero or below at {number(100 * dark / known, 2)}\u00a0% of the known nodes."
        )
    grid = (len(table.theta_h), len(table.theta_d), len(table.phi_d))
    if any(own < full for own, full in zip(grid, PUBLISHED_GRID, strict=True)):
        own, full = ("×".join(str(n) for n in g) for g in (grid, PUBLISHED_GRID))
        sentences.append(f"The grid of {own} nodes (θh, θd, φd) is coarser than the published {full}.")
    return sentences


def _dark_and_known(table: TableData) -> tuple[int, int]:
    """Visible nodes of all bands whose M00 is not above zero, and all that are known."""
    dark = known = 0
    for band in range(len(table.wavelengths_nm)):
        first = table.mueller[band, ..., 0, 0][visible_nodes(table, band)]
        dark += int(np.count_nonzero(first <= 0))
        known += int(np.count_nonzero(np.isfinite(first)))
    return dark, known


def _shown_slices(table: TableData, band: int) -> list[tuple[int, int]]:
    """Band and θd node of each slice, the default one first, none twice."""
    others = [b for b in range(len(table.wavelengths_nm)) if b != band]
    if len(others) > MOST_OTHER_BANDS:
        others = [others[k] for k in np.linspace(0, len(others) - 1, MOST_OTHER_BANDS).round().astype(int)]
    shown = [(band, theta_d_node(table, band, SHOWN_THETA_D))]
    shown += [(b, theta_d_node(table, b, SHOWN_THETA_D)) for b in others]
    shown += [(band, theta_d_node(table, band, degrees)) for degrees in OTHER_THETA_D]
    return list(dict.fromkeys(shown))


def theta_d_node(table: TableData, band: int, degrees: float) -> int:
    """Node nearest to `degrees` among those where the band holds anything."""
    distance = np.abs(np.degrees(table.theta_d) - degrees)
    known = np.isfinite(table.mueller[band, ..., 0, 0]).any(axis=(0, 2))
    return int(np.where(known, distance, np.inf).argmin()) if known.any() else int(distance.argmin())


def _slice_view(table: TableData, fit: FitResult | None, band: int, node: int) -> dict[str, Any]:
    shown = slice_at(table, band, node)
    model = None
    if fit is not None:
        grid = np.meshgrid(table.theta_h, shown.theta_d, table.phi_d, indexing="ij")
        model = model_at(fit, band, *grid)[:, 0]
    return {"where": shown.where, "pictures": compared(shown, model)}
