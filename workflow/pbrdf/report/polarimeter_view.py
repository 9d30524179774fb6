"""A polarimeter's page: retardances by band, signals beside their fit, and references before and after."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pbrdf.calibration.polarimeter import ELEMENTS, KIND
from pbrdf.formats.documents import member, number, read_document, wavelengths
from pbrdf.report.calibration_parts import (
    VALUE_HEAD,
    CalibrationView,
    Cell,
    Grid,
    Number,
    Section,
    value_row,
    with_error,
)
from pbrdf.report.element_matrices import matrices_picture
from pbrdf.report.figures import Picture
from pbrdf.report.figures import number as written
from pbrdf.report.polarimeter_maps import disc_picture, state_picture
from pbrdf.report.polarimeter_pictures import residual_picture, retardance_picture, signal_picture
from pbrdf.report.polarimeter_signals import ReferenceSignals, read_signals

SHOWN_NM = 550
"""Band that is shown first, where there is one."""


def polarimeter_view(document: str | Path, manifests: Mapping[str, str | Path]) -> CalibrationView:
    """Content of a measured polarimeter's page.

    Parameters
    ----------
    document : str or Path
        ``polarimeter.json``.
    manifests : mapping
        By reference its manifest.

    Raises
    ------
    InputError
        If an input cannot be used.
    """
    content = read_document(document, KIND)
    bands = wavelengths(document, content, "bands")
    signals = read_signals(document, content, manifests)
    first = SHOWN_NM if SHOWN_NM in bands else list(bands)[len(bands) // 2]
    largest = max(_errors_waves(document, content))
    return CalibrationView(
        values=[_zeros(document, content), _retardances(document, content, bands)],
        sections=[
            Section(
                "Retardance by band beside the ideal quarter wave",
                [retardance_picture(document, content)],
                f"Error bars are of one standard error: at most {written(largest, 2)} waves, less than a "
                "mark where none shows.",
            ),
            Section(
                "Signals beside their fit",
                [signal_picture(signals, first)],
                f"At {first} nm: the lamp's disc through each reference, state by state in the order they "
                "were taken, repeats of one state among them (hollow), and what the values above predict.",
            ),
            Section(
                "Residuals",
                [residual_picture(signals)],
                "Found − predicted, in units of the signal's own noise, in every band: what the lamp does "
                "faster than its fitted drift shows here, and what the elements do that the model does not "
                "know.",
                [_residuals(document, content, bands), _lamp(document, content, bands)],
            ),
            Section(
                "Residual maps",
                [
                    state_picture(signals.names, signals.bands_nm, signals.pulls),
                    disc_picture(signals.names, signals.bands_nm, signals.discs),
                ],
                "Above: the residuals of all photographs at once. Noise has no pattern; a slow change along "
                "a row is the lamp's, beside its fitted drift; columns that stand out in all rows are angles "
                "that a motor missed; a quick rhythm along a row is of an element that is not what the model "
                "says. Below: every pixel of the disc beside the same prediction, its own brightness free. "
                "Noise alone gives one, evenly; a slope or a ring is a retarder that is tilted or uneven, or "
                "a reflection; specks are dust or bad pixels.",
            ),
            Section(
                "References before and after calibration",
                [_matrices(signals, first)],
                f"At {first} nm, from the same signals, the fitted drift of the lamp taken out of both. "
                "Before: both retarders taken as quarter waves and every scale's zero as its element's axis. "
                "All divided by M00, x horizontal.",
                [_deviations(signals)],
            ),
        ],
        notes=[_ambiguities(content)],
    )


def _zeros(document: str | Path, content: Mapping[str, Any]) -> Grid:
    rows = [
        value_row(
            f"zero of the {name.replace('_', ' ')}",
            number(document, content, f"zeros_deg.{name}"),
            number(document, content, f"zeros_standard_error_deg.{name}"),
            "°",
        )
        for name in ELEMENTS
    ]
    chi_square = content.get("chi_square_per_freedom")
    if chi_square is not None:
        rows.append(value_row("χ² over the degrees of freedom", float(chi_square), None, "1"))
    rows.append(value_row("signals of a reference in a band", member(document, content, "states"), None, ""))
    return Grid("Angles of the elements' axes where their scales read zero", VALUE_HEAD, rows)


def _retardances(document: str | Path, content: Mapping[str, Any], bands: Mapping[int, str]) -> Grid:
    rows: list[list[Cell]] = []
    for name in bands.values():
        cells: list[Cell] = []
        for module in ("generator", "analyser"):
            field = f"bands.{name}.{module}_retardance"
            error = number(document, content, f"{field}_standard_error_deg")
            cells += [*with_error(number(document, content, f"{field}_deg"), error)]
        rows.append([f"{name} nm", *cells])
    return Grid(
        "Retardances; a quarter wave is 90°",
        ("band", "generator, °", "standard error, °", "analyser, °", "standard error, °"),
        rows,
    )


def _residuals(document: str | Path, content: Mapping[str, Any], bands: Mapping[int, str]) -> Grid:
    unit = member(document, content, "signal_unit")
    rows: list[list[Cell]] = []
    for name in bands.values():
        for reference, cell in member(document, content, f"bands.{name}.references").items():
            rows.append(
                [
                    f"{name} nm, {reference}",
                    *with_error(cell["amplitude"], cell["amplitude_standard_error"]),
                    Number(cell["mean_signal"], 4),
                    Number(cell["residual_rms"], 3),
                    "–" if cell["noise_rms"] is None else Number(cell["noise_rms"], 3),
                ]
            )
    return Grid(
        f"Amplitudes, residuals and noise in {unit}",
        (
            "band, reference",
            "amplitude",
            "its error",
            "mean signal",
            "residual rms",
            "noise rms",
        ),
        rows,
    )


def _lamp(document: str | Path, content: Mapping[str, Any], bands: Mapping[int, str]) -> Grid:
    """Drift of the lamp within the run of each reference in each band."""
    places = member(document, content, "lamp_known_at")
    if places is None:
        told, times = "from the first state to the last, in a straight line", ["change"]
    else:
        # numbered from one, as in the pictures
        told = f"against photograph {places[0] + 1} of the run, smooth between"
        times = [f"at {place + 1}" for place in places[1:]]
    rows: list[list[Cell]] = []
    for name in bands.values():
        for reference, cell in member(document, content, f"bands.{name}.references").items():
            told_here = zip(cell["lamp_drift"], cell["lamp_drift_standard_error"], strict=True)
            changes = [value for pair in told_here for value in with_error(*pair)]
            rows.append([f"{name} nm, {reference}", *changes])
    head = [column for time in times for column in (time, "its error")]
    return Grid(f"Relative change of the lamp's power {told}", ("band, reference", *head), rows)


def _matrices(signals: ReferenceSignals, nm: int) -> Picture:
    kinds = {"before": signals.before[nm], "after": signals.after[nm], "ideal": signals.ideal}
    return matrices_picture(signals.names, kinds, f"{nm} nm")


def _deviations(signals: ReferenceSignals) -> Grid:
    rows: list[list[Cell]] = []
    for nm in signals.bands_nm:
        cells: list[Cell] = []
        for index in range(len(signals.names)):
            for matrices in (signals.before[nm], signals.after[nm]):
                cells.append(Number(float(np.abs(matrices[index] - signals.ideal[index]).max()), 2))
        rows.append([f"{nm} nm", *cells])
    head = [f"{name}, {when}" for name in signals.names for when in ("before", "after")]
    return Grid("Largest deviation from the ideal matrix, divided by M00", ("band", *head), rows)


def _errors_waves(document: str | Path, content: Mapping[str, Any]) -> list[float]:
    """Standard errors of both retardances in all bands."""
    curve = member(document, content, "retardance_curve")
    return [float(e) for module in ("generator", "analyser") for e in curve[f"{module}_standard_error_waves"]]


def _ambiguities(content: Mapping[str, Any]) -> str:
    """What air alone leaves open, and how it was settled."""
    sentences = []
    for field, name in (
        ("frame_rotation", "common rotation of both frames"),
        ("s3_sign", "sign of s3"),
        ("scale_sense", "sense of the scales"),
    ):
        told = content.get(field, {})
        if told.get("settled"):
            sentences.append(f"{name}: settled by {told.get('by')}")
        else:
            sentences.append(f"{name}: not settled, {told.get('assumed', 'assumed')}")
    words = "; ".join(sentences)
    return f"{words[0].upper()}{words[1:]}."
