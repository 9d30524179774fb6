"""Pages: HTML files that ask for nothing but the scripts beside them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from pbrdf.fitting import FitResult
from pbrdf.formats.documents import write_text
from pbrdf.formats.table_data import TableData
from pbrdf.report.consistency_view import consistency_view
from pbrdf.report.entries import CalibrationEntry, FitEntry, IndexEntry, calibration_words
from pbrdf.report.figures import number
from pbrdf.report.fit_view import (
    as_close,
    check_fit,
    fit_view,
    median_error,
    model_title,
    polarised_residual,
    ranked,
    tie_words,
)
from pbrdf.report.folder import PANELS, PLOTLY, SCRIPT
from pbrdf.report.html import render
from pbrdf.report.image_view import MuellerImage, image_views
from pbrdf.report.mitsuba_words import mitsuba_words
from pbrdf.report.model_comparison import comparison_view
from pbrdf.report.panels_data import Panels
from pbrdf.report.physical_map import physicality_view
from pbrdf.report.sphere_pictures import sphere_pictures, thumbnail
from pbrdf.report.table_view import coverage_view, curves, default_band, slice_views
from pbrdf.report.visibility import coverage


def material_page(
    name: str,
    table: TableData,
    fits: Sequence[FitResult],
    *,
    calibration_sources: Mapping[str, str],
    provenance: Mapping[str, str],
    calibration_links: Mapping[str, str] | None = None,
    index: str | None = None,
    panels: Panels | None = None,
    health: Mapping[str, Any] | None = None,
    comparison: Mapping[str, Any] | None = None,
    consistency: Mapping[str, Any] | None = None,
) -> str:
    """Page of a material: slices of the table, the fit beside them, residuals, coverage.

    Parameters
    ----------
    name : str
        The material, as text: it is escaped.
    table : TableData
    fits : sequence of FitResult
        Fits of this table; which is best tells `pbrdf.report.fit_view.ranked`.
    calibration_sources : mapping of str to str
        For each calibration where it comes from: "measured" or "file". Empty for a table that came as
        a file.
    provenance : mapping of str to str
        Digests, versions and settings, shown as they are.
    calibration_links : mapping of str to str, optional
        Relative addresses of the calibrations' pages, by the same names.
    index : str, optional
        Relative address of the index.
    panels : Panels, optional
        Slices to choose from. A page that has them lies in the report's folder and draws with the scripts
        there; one without draws what does not move.
    health : mapping, optional
        From `pbrdf.report.capture_health.health_view`.
    comparison : mapping, optional
        Content of the fits' document ``pbrdf/comparison/1``.
    consistency : mapping, optional
        Content of the table's document ``pbrdf/consistency/2``.

    Returns
    -------
    str
        HTML; the same bytes for the same arguments.

    Raises
    ------
    InputError
        If a fit is not of this table.
    """
    for each in fits:
        check_fit(each, table)
    ordered = ranked(fits)
    fit = ordered[0] if ordered else None
    band = default_band(table)
    covered = coverage(table)
    share, kind = covered.headline
    physical = physicality_view(table, band)
    key = [{"value": 100 * share, "unit": "%", "digits": 3, "label": f"of the visible nodes {kind}"}]
    words = f"{_count(len(table.wavelengths_nm), 'band')}, "
    words += f"{number(100 * share)}\u00a0% of the visible nodes {kind}"
    if fit is None:
        words += "; no model was fitted."
        key.append(
            {
                "value": physical["bands"][band]["physical_percent"],
                "unit": "%",
                "digits": 3,
                "label": f"of them physical at {number(float(table.wavelengths_nm[band]), 4)} nm",
            }
        )
    else:
        title = model_title(fit.model)
        error = 100 * median_error(fit, table)
        words += "; the best fit is that of " if len(fits) > 1 else "; "
        words += f"{title}{', which' if len(fits) > 1 else ''} fits M00 with a median error of "
        words += f"{number(error, 2)}\u00a0%.{tie_words(ordered)}"
        if fit.bounds_met:
            words += f" {_count(len(fit.bounds_met), 'parameter')} ended on a bound."
        key += [
            {
                "value": error,
                "unit": "%",
                "digits": 3,
                "label": "median error of M00 over the nodes of the fit",
            },
            {
                "value": 100 * polarised_residual(fit, band),
                "unit": "%",
                "digits": 3,
                "label": f"largest rms residual of the other elements, of the rms of M00, at "
                f"{number(fit.wavelengths_nm[band], 4)} nm",
            },
        ]
    return render(
        "material.html.j2",
        scripts=() if panels is None else (SCRIPT, PLOTLY, PANELS),
        title=name,
        index=index,
        verdict=words,
        key_figures=key,
        calibration_sources=calibration_sources,
        calibration_links=calibration_links or {},
        wavelengths=[float(w) for w in table.wavelengths_nm],
        band=band,
        spheres=sphere_pictures(table, ordered, band),
        panels=None if panels is None else panels.about(),
        comparison=None if comparison is None else comparison_view(comparison, band),
        slices=slice_views(table, fit, band, whole=panels is None),
        curves=curves(table, ordered, band),
        fits=[fit_view(each, band) for each in ordered],
        consistency=None if consistency is None else consistency_view(consistency),
        mitsuba=mitsuba_words(name, table.wavelengths_nm.tolist()),
        coverage=coverage_view(table, covered, band),
        has_variance=table.variance is not None,
        physicality=physical,
        health=health,
        provenance=provenance,
    )


def material_entry(
    name: str,
    link: str,
    table: TableData,
    fits: Sequence[FitResult],
    calibration_sources: Mapping[str, str],
) -> IndexEntry:
    """Index entry of a material with a table."""
    ordered = ranked(fits)
    small, alt = thumbnail(table, ordered, default_band(table))
    return IndexEntry(
        name=name,
        link=link,
        kind="table",
        bands=len(table.wavelengths_nm),
        coverage_percent=100 * coverage(table).headline[0],
        fits=tuple(
            FitEntry(
                model_title(fit.model),
                100 * median_error(fit, table),
                best=fit is ordered[0],
                tied=fit is not ordered[0] and as_close(fit, ordered[0]),
            )
            for fit in fits
        ),
        calibration=calibration_words(calibration_sources),
        picture=small,
        alt=f"{name}. {alt}",
    )


def image_page(
    name: str,
    images: Iterable[MuellerImage],
    *,
    calibration_sources: Mapping[str, str],
    provenance: Mapping[str, str],
    calibration_links: Mapping[str, str] | None = None,
    index: str | None = None,
) -> str:
    """Page of an object without geometry: its Mueller images, decomposed.

    `images` are taken one at a time: none needs to stay in memory. The other parameters are those of
    `material_page`. Raises `InputError` for an image of another shape.
    """
    views = image_views(images)
    words = f"{_count(len(views), 'Mueller image')} of an object without known geometry: no table, no fit."
    if views:
        words += f" {views[0]['words']}"
    return render(
        "image.html.j2",
        title=name,
        index=index,
        verdict=words,
        key_figures=views[0]["key_figures"] if views else [],
        calibration_sources=calibration_sources,
        calibration_links=calibration_links or {},
        images=views,
        provenance=provenance,
    )


def index_page(
    entries: Sequence[IndexEntry],
    calibrations: Sequence[CalibrationEntry] = (),
    *,
    provenance: Mapping[str, str],
    title: str = "Materials",
) -> str:
    """Page that lists materials and calibrations, in the order given, with links to theirs."""
    words = f"{_count(len(entries), 'material')}" if entries else "No materials yet"
    fitted = [(entry, entry.best) for entry in entries if entry.best is not None]
    if fitted:
        entry, best = min(fitted, key=lambda pair: pair[1].error_percent)
        words += f"; the closest fit is that of {entry.name} ({best.model}, "
        words += f"median error of M00 {number(best.error_percent, 2)}\u00a0%)"
    return render(
        "index.html.j2",
        scripts=(SCRIPT,),
        title=title,
        index=None,
        verdict=words + ".",
        models=list(dict.fromkeys(fit.model for entry in entries for fit in entry.fits)),
        entries=entries,
        calibrations=calibrations,
        provenance=provenance,
    )


def write_page(path: str | Path, page: str) -> None:
    """Write a page whole or not at all."""
    write_text(path, page)


def _count(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"
