"""Calibration documents that the user gives as files."""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable
from pathlib import Path

from pbrdf.calibration.camera import KIND as CAMERA
from pbrdf.calibration.camera import Camera
from pbrdf.calibration.flat_field import KIND as FLAT
from pbrdf.calibration.flat_field import FlatField, flat_image, named_image
from pbrdf.calibration.lights import KIND as LIGHTS
from pbrdf.calibration.lights import read_lights
from pbrdf.calibration.polarimeter import KIND as POLARIMETER
from pbrdf.calibration.polarimeter import PolarimeterCalibration
from pbrdf.calibration.radiometry import KIND as RADIOMETRY
from pbrdf.calibration.radiometry import Radiometry
from pbrdf.calibration.sphere import KIND as SPHERE
from pbrdf.calibration.sphere import Sphere
from pbrdf.errors import InputError
from pbrdf.formats.beside import replace_file
from pbrdf.formats.documents import read_document, write_document

KINDS = {
    "camera": CAMERA,
    "polarimeter": POLARIMETER,
    "lights": LIGHTS,
    "radiometry": RADIOMETRY,
    "flat": FLAT,
    "sphere": SPHERE,
}

_READERS: dict[str, Callable[[str | Path], object]] = {
    "camera": Camera.read,
    "polarimeter": PolarimeterCalibration.read,
    "lights": read_lights,
    "radiometry": Radiometry.read,
    "flat": FlatField.read,
    "sphere": Sphere.read,
}


def write_given(kind: str, given: str | Path, path: str | Path) -> None:
    """Check a calibration that the user gives as a file, and write it marked ``source: file``.

    Raises
    ------
    InputError
        If the file is not a calibration of that kind.
    """
    _READERS[kind](given)
    content = read_document(given, KINDS[kind])
    del content["schema"]
    if kind == "flat":
        with replace_file(flat_image(path)) as beside:
            shutil.copyfile(Path(given).parent / content["image"], beside)
        content |= named_image(path)
    write_document(path, KINDS[kind], {**content, "source": "file"})


def write_given_sphere(given: str | Path, radius_mm: float, path: str | Path) -> None:
    """Check a sphere that the user gives as a file, and write it marked ``source: file``.

    Raises
    ------
    InputError
        If the file is not of a sphere, or of another radius than the table of materials says.
    """
    radius = Sphere.read(given).radius_mm
    if not math.isclose(radius, radius_mm, rel_tol=1e-9):
        problem = f"is {radius:g} mm where the table of materials says {radius_mm:g} mm"
        raise InputError(given, "radius_mm", problem, "make the two agree")
    write_given("sphere", given, path)
