"""Pages of the report, from files to files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path

from pbrdf.fitting import FitResult
from pbrdf.fitting.comparison import KIND as COMPARISON
from pbrdf.fitting.result import read_fit
from pbrdf.formats.documents import member, read_any, read_document, write_text
from pbrdf.formats.mueller_exr import read_mueller_exr
from pbrdf.formats.receipt import digest, receipt_content, receipt_summary
from pbrdf.formats.table_zarr import read_table
from pbrdf.report.capture_health import health_view, lights_health
from pbrdf.report.entries import (
    IndexEntry,
    calibration_link,
    calibration_words,
    read_calibration_entry,
    read_entry,
    write_entry,
)
from pbrdf.report.fit_view import ranked
from pbrdf.report.image_view import MuellerImage
from pbrdf.report.pages import image_page, index_page, material_entry, material_page
from pbrdf.report.panels_data import drawn_panels, write_slices
from pbrdf.report.table_view import offered_slices, whole_slices
from pbrdf.tabulation.consistency import read_consistency


def write_material_page(
    material: str,
    table: str | Path,
    receipt: str | Path,
    fits: Sequence[str | Path],
    comparison: str | Path,
    consistency: str | Path,
    calibrations: Sequence[str | Path],
    images: Sequence[str | Path],
    page: str | Path,
    values: str | Path,
    scripts: str | Path,
    entry: str | Path,
) -> None:
    """Write the page of a material with a table, the values of its slices, and its line of the index.

    Parameters
    ----------
    material : str
        Its name.
    table, receipt : str or Path
        The table (Zarr) and its receipt.
    fits : sequence of paths
        Documents of the fits.
    comparison : str or Path
        The document in which they are compared.
    consistency : str or Path
        What symmetries say of the table.
    calibrations : sequence of paths
        The calibrations behind the table; none for a table that came as a file.
    images : sequence of paths
        Receipts of the Mueller images behind it; none for a table that came as a file.
    page, values, scripts, entry : str or Path
        What is written; the report's folder holds `values`, a document, and `scripts`, a folder of the same
        name, under ``values/``.

    Raises
    ------
    InputError
        If an input cannot be read.
    """
    data, sources = read_table(table), calibration_sources(calibrations)
    fitted = [read_fit(fit) for fit in fits]
    best = next(iter(ranked(fitted)), None)
    address, whole = f"values/{Path(scripts).name}", whole_slices(data)
    panels = drawn_panels(address, data, best, offered_slices(data), whole)
    html = material_page(
        material,
        data,
        fitted,
        calibration_sources=sources,
        calibration_links=calibration_links(calibrations),
        provenance=_provenance(receipt, dict(zip(map(str, fits), fitted, strict=True)), calibrations, images),
        index="index.html",
        panels=panels,
        comparison=read_document(comparison, COMPARISON),
        consistency=read_consistency(consistency),
        health=health_view(lights_health(images)),
    )
    write_text(page, html)
    write_slices(values, data, whole)
    panels.write(scripts)
    write_entry(entry, material_entry(material, Path(page).name, data, fitted, sources))


def _provenance(
    receipt: str | Path,
    fits: Mapping[str, FitResult],
    calibrations: Sequence[str | Path],
    images: Sequence[str | Path],
) -> dict[str, str]:
    """Digests, settings and versions behind a material's page; `fits` by the paths of their documents."""
    content = read_any(receipt)
    inputs = dict(member(receipt, content, "inputs"))
    lines = {
        "table (SHA-256)": receipt_content(receipt),
        **{f"{role} of the table (SHA-256)": str(value) for role, value in inputs.items()},
        **{f"calibration {Path(each).stem} (SHA-256)": digest([each]) for each in calibrations},
        **{f"fit {Path(path).stem} (SHA-256)": digest([path]) for path in fits},
        **_settings("reconstruction", images),
        **_settings("tabulation", [receipt]),
    }
    for path, fit in fits.items():
        options = (f"{name} {value}" for name, value in asdict(fit.options).items())
        lines[f"fit {Path(path).stem}"] = ", ".join(options)
    lines["instruction set"] = str(member(receipt, content, "instruction_set"))
    return lines | {name: version(name) for name in ("pbrdf", "numpy", "nlopt", "matplotlib")}


def _settings(stage: str, receipts: Sequence[str | Path]) -> dict[str, str]:
    """Settings of a stage as its receipts tell them, each value once."""
    told: dict[str, list[str]] = {}
    for receipt in receipts:
        for name, value in dict(member(receipt, read_any(receipt), "settings")).items():
            told.setdefault(f"{stage}: {name}", []).append(str(value))
    return {name: ", ".join(dict.fromkeys(values)) for name, values in told.items()}


def write_image_page(
    material: str,
    folders: Sequence[str | Path],
    receipts: Sequence[str | Path],
    calibrations: Sequence[str | Path],
    page: str | Path,
    entry: str | Path,
) -> None:
    """Write the page of an object that is no sphere: its Mueller images; parameters as above."""
    sources = calibration_sources(calibrations)
    provenance = {f"Mueller images {Path(r).stem} (SHA-256)": receipt_content(r) for r in receipts}
    html = image_page(
        material,
        _images(folders, receipts),
        calibration_sources=sources,
        calibration_links=calibration_links(calibrations),
        provenance={**provenance, "pbrdf": version("pbrdf")},
        index="index.html",
    )
    write_text(page, html)
    write_entry(
        entry,
        IndexEntry(
            name=material,
            link=Path(page).name,
            kind="Mueller image",
            bands=sum(len(receipt_summary(receipt)) for receipt in receipts),
            coverage_percent=None,
            fits=(),
            calibration=calibration_words(sources),
        ),
    )


def _images(folders: Sequence[str | Path], receipts: Sequence[str | Path]) -> Iterator[MuellerImage]:
    """Mueller images of all lights and bands, read when they are wanted."""
    for folder, receipt in zip(folders, receipts, strict=True):
        for band, summary in receipt_summary(receipt).items():
            image = read_mueller_exr(Path(folder) / f"{band}.exr")
            title = f"{image.header['band']}, light {image.header['light']}°"
            yield MuellerImage(image.mueller, str(image.header["units"]), title, image.variance, summary)


def write_index(entries: Sequence[str | Path], calibrations: Sequence[str | Path], path: str | Path) -> None:
    """Write the index of pages from the entries of materials and of calibrations.

    Raises
    ------
    InputError
        If an entry cannot be read.
    """
    page = index_page(
        [read_entry(entry) for entry in entries],
        [read_calibration_entry(entry) for entry in calibrations],
        provenance={"pbrdf": version("pbrdf")},
    )
    write_text(path, page)


def calibration_sources(documents: Sequence[str | Path]) -> dict[str, str]:
    """`source` of each calibration, by kind."""
    return {Path(path).stem: str(member(path, read_any(path), "source")) for path in documents}


def calibration_links(documents: Sequence[str | Path]) -> dict[str, str]:
    """Relative address of each calibration's page, by kind."""
    return {Path(path).stem: calibration_link(path) for path in documents}
