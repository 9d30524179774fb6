"""Calibration documents of a session: copied from a virtual rig, or given by the user as files."""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from pbrdf.calibration.camera import KIND as CAMERA
from pbrdf.calibration.camera import Camera, nominal_camera
from pbrdf.calibration.flat_field import KIND as FLAT
from pbrdf.calibration.flat_field import FlatField, flat_image, named_image, write_flat
from pbrdf.calibration.lights import KIND as LIGHTS
from pbrdf.calibration.lights import nominal_lights, read_lights
from pbrdf.calibration.polarimeter import KIND as POLARIMETER
from pbrdf.calibration.polarimeter import PolarimeterCalibration, nominal_polarimeter
from pbrdf.calibration.radiometry import KIND as RADIOMETRY
from pbrdf.calibration.radiometry import Radiometry, nominal_radiometry
from pbrdf.calibration.sphere import KIND as SPHERE
from pbrdf.calibration.sphere import Sphere, nominal_sphere
from pbrdf.errors import InputError
from pbrdf.formats.documents import read_document, write_document
from pbrdf.instruments.virtual_geometry import UP, virtual_arm, virtual_flat, virtual_polarimeter

SESSION_KINDS = {
    "camera": CAMERA,
    "polarimeter": POLARIMETER,
    "lights": LIGHTS,
    "radiometry": RADIOMETRY,
    "flat": FLAT,
}
KINDS = {**SESSION_KINDS, "sphere": SPHERE}

_READERS: dict[str, Callable[[str | Path], object]] = {
    "camera": Camera.read,
    "polarimeter": PolarimeterCalibration.read,
    "lights": read_lights,
    "radiometry": Radiometry.read,
    "flat": FlatField.read,
    "sphere": Sphere.read,
}


def write_nominal(kind: str, rig: Mapping[str, Any], path: str | Path) -> None:
    """Write a calibration of a session copied from a virtual rig's file, marked ``source: nominal``.

    Parameters
    ----------
    kind : {"camera", "polarimeter", "lights", "radiometry", "flat"}
    rig : mapping
        The rig's file, checked against its schema.
    path : str or Path
        The document to write; a flat field's image goes beside it.

    Raises
    ------
    InputError
        If the rig is real: nothing is known of it before it is measured.
    """
    _refuse_real(rig, kind)
    if kind == "camera":
        content = nominal_camera(rig)
    elif kind == "lights":
        content = nominal_lights(virtual_arm(dict(rig)))
    elif kind == "polarimeter":
        bands = {nm: virtual_polarimeter(dict(rig), nm) for nm in rig["filters_nm"]}
        content = nominal_polarimeter(bands, UP)
    elif kind == "flat":
        picture = virtual_flat(dict(rig))
        content = {"source": "nominal", **write_flat(path, dict.fromkeys(rig["filters_nm"], picture))}
    else:
        content = nominal_radiometry(rig)
    write_document(path, SESSION_KINDS[kind], content)


def write_nominal_sphere(rig: Mapping[str, Any], radius_mm: float, path: str | Path) -> None:
    """Write ``sphere.json`` copied from a virtual rig's file; raises `InputError` for a real rig."""
    _refuse_real(rig, "sphere")
    write_document(path, SPHERE, nominal_sphere(rig, radius_mm))


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
        shutil.copyfile(Path(given).parent / content["image"], flat_image(path))
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


def _refuse_real(rig: Mapping[str, Any], kind: str) -> None:
    if rig["kind"] != "virtual":
        raise InputError(
            "rig",
            kind,
            "a real rig has no nominal calibration",
            f"give it as a file under `calibration.{kind}`",
        )
