"""Pages of calibrations, from files to files: one a document."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from pbrdf.calibration.chessboard import Board
from pbrdf.formats.documents import member, read_any, write_text
from pbrdf.formats.receipt import digest
from pbrdf.report.calibration_parts import CalibrationView, Grid
from pbrdf.report.camera_view import camera_view
from pbrdf.report.entries import CalibrationEntry, write_calibration_entry
from pbrdf.report.flat_view import flat_view
from pbrdf.report.html import render
from pbrdf.report.lights_view import lights_view
from pbrdf.report.polarimeter_view import polarimeter_view
from pbrdf.report.radiometry_view import radiometry_view
from pbrdf.report.sphere_view import sphere_view
from pbrdf.report.summary import document_summary

MEASURED = "measured"
TITLES = {"flat": "flat field"}


def write_calibration_page(
    kind: str,
    subject: str,
    document: str | Path,
    photographs: Sequence[str | Path],
    others: Mapping[str, str | Path],
    board: Board,
    page: str | Path,
    entry: str | Path,
) -> None:
    """Write the page of a calibration, and its line of the index.

    Parameters
    ----------
    kind : str
        A key of `pbrdf.calibration.documents.KINDS`.
    subject : str
        The session, or of a sphere the material.
    document : str or Path
        The calibration.
    photographs : sequence of str or Path
        Manifests of what it was measured from; frames lie beside them. None for one given as a file.
    others : mapping
        Documents, by kind, that its pictures need: ``camera`` for lights and sphere.
    board : Board
        What a camera is measured with.
    page, entry : str or Path
        What is written.

    Raises
    ------
    InputError
        If an input cannot be read.
    """
    content = read_any(document)
    source = str(member(document, content, "source"))
    verdict = str(content.get("verdict", "no verdict: its values were not judged"))
    measured = source == MEASURED
    view = _measured(kind, document, photographs, others, board) if measured else given_view(document)
    html = calibration_page(
        _title(kind, subject),
        verdict,
        view,
        given=not measured,
        provenance=_provenance(document, content),
    )
    write_text(page, html)
    write_calibration_entry(entry, CalibrationEntry(subject, kind, Path(page).name, source, verdict))


def calibration_page(
    title: str, verdict: str, view: CalibrationView, *, given: bool, provenance: Mapping[str, str]
) -> str:
    """Page of a calibration.

    Parameters
    ----------
    title, verdict : str
        As text: they are escaped.
    view : CalibrationView
    given : bool
        Whether it came as a file.
    provenance : mapping of str to str
        Digests and versions, shown as they are.

    Returns
    -------
    str
        HTML; the same bytes for the same arguments.
    """
    return render(
        "calibration.html.j2",
        title=title,
        index="index.html",
        verdict=verdict,
        given=given,
        view=view,
        provenance=provenance,
    )


def given_view(document: str | Path) -> CalibrationView:
    """Content of the page of a calibration that came as a file: its values as they stand there."""
    rows = [[name, text] for name, text in document_summary(document).items() if name != "verdict"]
    return CalibrationView(values=[Grid("As the file tells them", ("field", "value"), rows)])


def _measured(
    kind: str,
    document: str | Path,
    photographs: Sequence[str | Path],
    others: Mapping[str, str | Path],
    board: Board,
) -> CalibrationView:
    by_target = {Path(manifest).parents[2].name: manifest for manifest in photographs}
    if kind == "camera":
        return camera_view(document, board, by_target)
    if kind == "polarimeter":
        return polarimeter_view(document, by_target)
    if kind == "lights":
        return lights_view(document, others["camera"], photographs)
    if kind == "sphere":
        return sphere_view(document, others["camera"], photographs[0])
    return flat_view(document) if kind == "flat" else radiometry_view(document)


def _title(kind: str, subject: str) -> str:
    name = TITLES.get(kind, kind).capitalize()
    return f"{name} of {subject}" if kind == "sphere" else f"{name} of session {subject}"


def _provenance(document: str | Path, content: Mapping[str, Any]) -> dict[str, str]:
    inputs = content.get("inputs", {})
    return {
        "document (SHA-256)": digest([document]),
        **{f"from {name} (SHA-256)": str(value) for name, value in inputs.items()},
        "pbrdf": version("pbrdf"),
    }
