"""A session's photographs of a board to its ``camera.json``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from pbrdf.calibration.camera import KIND
from pbrdf.calibration.chessboard import Board
from pbrdf.calibration.intrinsics import measure_camera
from pbrdf.calibration.photograph import Photograph
from pbrdf.formats.documents import write_document
from pbrdf.formats.receipt import digests


def calibrate_camera(manifests: Mapping[str, str | Path], board: Board, document: str | Path) -> None:
    """Measure the camera.

    Parameters
    ----------
    manifests : mapping
        By name of the view the manifest of its only light; frames lie beside it.
    board : Board
    document : str or Path
        What is written.

    Raises
    ------
    InputError
        If a photograph cannot be read, or the views do not tell the camera (`measure_camera`).
    """
    images = [(name, Photograph.read(manifest).image) for name, manifest in manifests.items()]
    rows, columns = images[0][1].shape
    content = measure_camera(images, board, (rows, columns))
    write_document(document, KIND, {**content, "inputs": digests(manifests)})
