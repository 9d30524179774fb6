"""The page that shows elements in the beam as measured beside what they should be."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from pbrdf.formats.documents import write_text
from pbrdf.formats.receipt import digest
from pbrdf.reconstruction.comparison import Comparison, rms_over, worst
from pbrdf.reconstruction.validation import CALIBRATED, UNCALIBRATED, WAYS, Validation
from pbrdf.report.element_matrices import matrices_picture
from pbrdf.report.entries import calibration_link
from pbrdf.report.figures import Picture, number
from pbrdf.report.html import render

DRAWN_NM = 550
"""Band of the published figure, drawn where it was taken."""


def write_validation_page(document: str | Path, page: str | Path) -> None:
    """Write the page of a session's validation; raises `InputError` if the document is damaged."""
    provenance = {"validation (SHA-256)": digest([document]), "pbrdf": version("pbrdf")}
    write_text(page, validation_page(Validation.read(document), provenance))


def validation_page(validation: Validation, provenance: Mapping[str, str]) -> str:
    """Page of a session's validation.

    Parameters
    ----------
    validation : Validation
    provenance : mapping of str to str
        Digests and versions, shown as they are.

    Returns
    -------
    str
        HTML; the same bytes for the same arguments.
    """
    bands = validation.bands_nm
    first = DRAWN_NM if DRAWN_NM in bands else bands[len(bands) // 2]
    calibrated, uncalibrated = (validation.comparisons(way) for way in WAYS)
    figures = (
        ("largest deviation, calibrated", worst(calibrated).largest),
        ("largest deviation, uncalibrated", worst(uncalibrated).largest),
        ("rms deviation, calibrated", rms_over(calibrated)),
        ("rms deviation, uncalibrated", rms_over(uncalibrated)),
    )
    return render(
        "validation.html.j2",
        title=f"Validation of session {validation.session}",
        index=None,
        verdict=validation.verdict,
        key_figures=[{"label": name, "value": value, "unit": "", "digits": 3} for name, value in figures],
        calibration_sources=validation.sources,
        calibration_links={
            kind: calibration_link(Path(validation.session) / f"{kind}.json") for kind in validation.sources
        },
        pictures=[(nm, _picture(validation, nm)) for nm in [first, *(nm for nm in bands if nm != first)]],
        elements=[_element(validation, element) for element in validation.results],
        provenance=provenance,
    )


def _picture(validation: Validation, band_nm: int) -> Picture:
    by_element = [bands[band_nm] for bands in validation.results.values()]
    kinds = {
        "calibrated": [ways[CALIBRATED].measured.mueller for ways in by_element],
        "ideal": [ways[CALIBRATED].ideal for ways in by_element],
        "uncalibrated": [ways[UNCALIBRATED].measured.mueller for ways in by_element],
    }
    return matrices_picture(list(validation.results), kinds, f"{number(band_nm, 4)} nm")


def _element(validation: Validation, element: str) -> dict[str, Any]:
    """Rows of an element's part of the table: its bands, then all of them together."""
    bands = validation.results[element]
    return {
        "name": element,
        "bands": [{"nm": nm, **{way: _figures(ways[way]) for way in WAYS}} for nm, ways in bands.items()],
        "all": {way: _overall([ways[way] for ways in bands.values()]) for way in WAYS},
    }


def _figures(comparison: Comparison) -> dict[str, Any]:
    row, column = comparison.place
    return {
        "largest": comparison.largest,
        "error": comparison.largest_error,
        "element": f"M{row}{column}",
        "rms": comparison.rms,
        "noise_rms": comparison.noise_rms,
    }


def _overall(comparisons: list[Comparison]) -> dict[str, Any]:
    noise = float(np.sqrt(np.mean([each.noise_rms**2 for each in comparisons])))
    return {**_figures(worst(comparisons)), "rms": rms_over(comparisons), "noise_rms": noise}
