"""Figures for papers: PDF, SVG and PNG of what the pages show, and of the published figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path

import matplotlib.style
import numpy as np
from matplotlib.figure import Figure

from pbrdf.calibration.polarimeter import PolarimeterCalibration
from pbrdf.fitting.result import read_fit
from pbrdf.formats.beside import replace_file
from pbrdf.formats.documents import read_any
from pbrdf.formats.table_zarr import read_table
from pbrdf.reconstruction.validation import CALIBRATED, Validation
from pbrdf.report.curves import MODEL_STYLES
from pbrdf.report.element_matrices import matrices_picture
from pbrdf.report.figures import STYLE, Picture, number, picture
from pbrdf.report.fit_view import check_fit, ranked
from pbrdf.report.lit_sphere import INCIDENT
from pbrdf.report.sphere_pictures import sphere_pictures
from pbrdf.report.table_view import curves, default_band, slice_views
from pbrdf.report.validation import DRAWN_NM

FORMATS = ("pdf", "svg", "png")
DPI = 300
_SILENT: Mapping[str, dict[str, None]] = {
    "pdf": {"Creator": None, "Producer": None, "CreationDate": None},
    "png": {"Software": None},
}


def write_figure(shown: Picture, paths: Sequence[str | Path]) -> None:
    """Write a picture to files whose endings name their formats; the same picture gives the same bytes."""
    for path in map(Path, paths):
        kind = path.suffix[1:]
        content = shown.svg if kind == "svg" else _rendered(shown, kind)
        with replace_file(path) as beside:
            beside.write_bytes(content)


def retardance_figure(polarimeter: str | Path) -> Picture:
    """Draw the retardances of both retarders over the bands, as figure 1 of the paper's supplement.

    Raises
    ------
    InputError
        If the calibration cannot be read.
    """
    bands = PolarimeterCalibration.read(polarimeter).bands
    errors = read_any(polarimeter).get("bands", {})
    wavelengths = sorted(bands)
    lines = {
        "generator": [bands[nm].generator_retardance / (2 * np.pi) for nm in wavelengths],
        "analyser": [bands[nm].analyser_retardance / (2 * np.pi) for nm in wavelengths],
    }

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        figure.subplots_adjust(left=0.17, right=0.97, top=0.95, bottom=0.16)
        for (name, waves), (colour, dashes) in zip(lines.items(), MODEL_STYLES, strict=False):
            field = f"{name}_retardance_standard_error_deg"
            degrees = [errors.get(str(nm), {}).get(field) for nm in wavelengths]
            bars = [float(d or 0) / 360 for d in degrees] if any(degrees) else None
            axes.plot(wavelengths, waves, color=colour, ls=dashes, marker="o", ms=3, lw=1.2, label=name)
            if bars is not None:
                axes.errorbar(wavelengths, waves, yerr=bars, fmt="none", ecolor=colour, elinewidth=0.8)
        axes.axhline(0.25, color="#555555", lw=0.8, label="ideal")
        axes.set_xlabel("wavelength, nm")
        axes.set_ylabel("retardance, waves")
        axes.grid(True)
        axes.legend(frameon=False)

    described = "; ".join(
        f"{name} from {number(min(waves), 4)} to {number(max(waves), 4)} waves"
        for name, waves in lines.items()
    )
    return picture((4.2, 3.2), draw, f"Retardance of the two retarders against wavelength: {described}.")


def elements_figure(validation: str | Path) -> Picture:
    """Draw the five known elements as measured and ideal, as figure 2 of the paper's supplement.

    Raises
    ------
    InputError
        If the validation cannot be read.
    """
    content = Validation.read(validation)
    band = DRAWN_NM if DRAWN_NM in content.bands_nm else content.bands_nm[len(content.bands_nm) // 2]
    ways = [bands[band][CALIBRATED] for bands in content.results.values()]
    kinds = {"measured": [way.measured.mueller for way in ways], "ideal": [way.ideal for way in ways]}
    return matrices_picture(list(content.results), kinds, f"{number(band, 4)} nm")


def material_figures(table: str | Path, fits: Sequence[str | Path]) -> dict[str, Picture]:
    """Draw a material's figures by name: Mueller panels of table, best fit and difference; curves; sphere.

    Raises
    ------
    InputError
        If the table or a fit cannot be read, or they do not belong together.
    """
    data, fitted = read_table(table), [read_fit(fit) for fit in fits]
    for fit in fitted:
        check_fit(fit, data)
    ordered, band = ranked(fitted), default_band(data)
    panels = slice_views(data, ordered[0] if ordered else None, band, whole=False)[0]["pictures"]
    named = dict(zip(("mueller_table", "mueller_fit", "mueller_difference"), panels, strict=False))
    sphere = sphere_pictures(data, ordered, band)
    return {**named, "curves": curves(data, ordered, band), "sphere": sphere[next(iter(INCIDENT))]}


def write_material_figures(
    table: str | Path, fits: Sequence[str | Path], paths: Sequence[str | Path]
) -> None:
    """Write a material's figures to paths that end in their names, such as ``…/gold_curves.pdf``."""
    for name, shown in material_figures(table, fits).items():
        write_figure(shown, [path for path in paths if Path(path).stem.endswith(f"_{name}")])


def _rendered(shown: Picture, kind: str) -> bytes:
    with matplotlib.style.context(["default", STYLE | {"pdf.fonttype": 42}]):
        figure = Figure(figsize=(shown.width / 96, shown.height / 96))
        shown.draw(figure)
        buffer = BytesIO()
        figure.savefig(buffer, format=kind, dpi=DPI, metadata=_SILENT[kind])
    return buffer.getvalue()
