"""A material's sphere in ambient light to its ``sphere.json``."""

from __future__ import annotations

from pathlib import Path

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.outline import measure_sphere
from pbrdf.calibration.photograph import Photograph
from pbrdf.calibration.sphere import KIND
from pbrdf.errors import InputError
from pbrdf.formats.documents import write_document
from pbrdf.formats.receipt import digests


def locate_sphere(manifest: str | Path, camera: str | Path, radius_mm: float, document: str | Path) -> None:
    """Find where the sphere stands.

    Parameters
    ----------
    manifest : str or Path
        Of the photograph in ambient light; its frames lie beside it.
    camera : str or Path
        The session's ``camera.json``.
    radius_mm : float
        Radius of the sphere, measured by hand.
    document : str or Path
        What is written.

    Raises
    ------
    InputError
        If the photograph or the camera cannot be used, or too little of an outline is seen.
    """
    photograph = Photograph.read(manifest)
    try:
        content = measure_sphere(photograph.image, Camera.read(camera), radius_mm, photograph.saturation)
    except InputError as error:
        raise InputError(manifest, error.field, error.problem, error.remedy) from None
    inputs = digests({"ambient": manifest, "camera": camera})
    write_document(document, KIND, {**content, "inputs": inputs})
