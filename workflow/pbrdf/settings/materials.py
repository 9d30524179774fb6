"""The table of materials: what each is photographed with, or where its measurements lie."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from pbrdf.errors import InputError
from pbrdf.formats.rows import read_rows

COLUMNS = ("material", "source", "session", "radius_mm", "path", "details")
SOURCES = ("rig", "capture", "images", "table")
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")
NAME_RULE = "use at most 64 letters, digits, - and _, the first a letter or a digit"
ABSENT = "-"
TAKEN = ("calibration", "report")
"""Folders beside those of the materials."""

Refusal = Callable[[str, str, str], InputError]


@dataclass(frozen=True)
class Material:
    """A row of the table of materials.

    Attributes
    ----------
    name : str
        Matches `NAME`, so that it may become a path.
    source : {"rig", "capture", "images", "table"}
        Photographed by the rig; a capture written elsewhere; a folder of images; a finished table.
    session : str or None
        The calibration session it belongs to.
    radius_mm : float or None
        Radius of the sphere, measured by hand; None for anything that is not a sphere.
    path : Path or None
        Folder of the capture or the images, or the table's file.
    details : Path or None
        CSV of the images' settings, or YAML with the axes of a table that lacks them.
    """

    name: str
    source: str
    session: str | None = None
    radius_mm: float | None = None
    path: Path | None = None
    details: Path | None = None


def read_materials(path: str | Path, data: str | None = None) -> dict[str, Material]:
    """Read the table of materials.

    Parameters
    ----------
    path : str or Path
        A tab-separated file with the columns of `COLUMNS`; ``-`` stands for nothing.
    data : str, optional
        What ``{data}`` in its paths stands for.

    Returns
    -------
    dict
        Material by name, in the order of the file.

    Raises
    ------
    InputError
        If the file is missing or a row is not as it should be.
    """
    path = Path(path)
    rows = [
        _material(path, number, row, data)
        for number, row in read_rows(path, COLUMNS, "\t", "`materials` in the config")
    ]
    names = [material.name for material in rows]
    for name in names:
        if names.count(name) > 1:
            raise InputError(path, "material", f"`{name}` stands there twice", "keep one row a material")
    return {material.name: material for material in rows}


def select(
    materials: Mapping[str, Material], only: Iterable[str], source: str | Path, field: str = "only"
) -> dict[str, Material]:
    """Materials named in `only`, or all if it is empty; raises `InputError` for a name not in the table."""
    chosen = list(only)
    for name in chosen:
        if name not in materials:
            near = get_close_matches(name, materials, n=1)
            remedy = f"did you mean `{near[0]}`?" if near else f"the table has {', '.join(materials)}"
            raise InputError(source, field, f"no material is called `{name}`", remedy)
    return {name: materials[name] for name in chosen} if chosen else dict(materials)


def placed_materials(
    materials: Mapping[str, Material], placed: Callable[[Path], Path], source: str | Path
) -> dict[str, Material]:
    """Materials with their paths put where `placed` says; raises `InputError` for one that leads nowhere."""
    found = {}
    for name, material in materials.items():
        for column, path in (("path", material.path), ("details", material.details)):
            if path and not placed(path).exists():
                raise InputError(
                    source,
                    f"{name}, {column}",
                    f"there is no {path}",
                    "correct the path, or set `data` in the config",
                )
        found[name] = replace(
            material,
            path=placed(material.path) if material.path else None,
            details=placed(material.details) if material.details else None,
        )
    return found


def _material(path: Path, number: int, row: dict[str | Any, str | Any], data: str | None) -> Material:
    def refuse(column: str, problem: str, remedy: str) -> InputError:
        return InputError(path, f"line {number}, {column}", problem, remedy)

    if None in row:
        raise refuse("cells", f"are more than {len(COLUMNS)}", "put one tab between columns")
    cells = {}
    for column in COLUMNS:
        value = row.get(column)
        if value is None or value == "":
            raise refuse(column, "is empty", f"write `{ABSENT}` where there is nothing to say")
        cells[column] = None if value == ABSENT else value
    name, source = cells["material"] or ABSENT, cells["source"] or ABSENT
    for column in ("material", "session"):
        if cells[column] is not None and not NAME.fullmatch(cells[column] or ""):
            raise refuse(
                column,
                f"{cells[column]!r} cannot become a folder",
                NAME_RULE,
            )
    if cells["material"] is None:
        raise refuse("material", "has no name", "name the material")
    if name in TAKEN:
        raise refuse("material", f"cannot be `{name}`", "choose another name: that folder is taken")
    if source not in SOURCES:
        raise refuse("source", f"is {source!r}", f"use one of {', '.join(SOURCES)}")
    if source != "rig" and cells["path"] is None:
        raise refuse("path", f"is missing for the source `{source}`", "say where the measurements lie")
    if source == "images" and cells["details"] is None:
        raise refuse("details", "is missing for the source `images`", "name the CSV of the images' settings")
    if source == "rig" and cells["radius_mm"] is None:
        raise refuse("radius_mm", "is missing", "measure the sphere's radius by hand")
    if source != "table" and cells["session"] is None:
        raise refuse("session", "is missing", "name the calibration session that the photographs belong to")
    return Material(
        name,
        source,
        cells["session"],
        _radius(cells["radius_mm"], refuse),
        _placed("path", cells["path"], data, refuse),
        _placed("details", cells["details"], data, refuse),
    )


def _radius(cell: str | None, refuse: Refusal) -> float | None:
    if cell is None:
        return None
    try:
        radius = float(cell)
    except ValueError:
        radius = -1.0
    if not 0.0 < radius < float("inf"):
        raise refuse("radius_mm", f"is {cell!r}", "give a positive length in mm")
    return radius


def _placed(column: str, cell: str | None, data: str | None, refuse: Refusal) -> Path | None:
    if cell is None:
        return None
    if "{data}" in cell:
        if data is None:
            remedy = "set `data` in the config, or --config data=FOLDER"
            raise refuse(column, "uses {data}, which the config leaves open", remedy)
        cell = cell.replace("{data}", data)
    return Path(cell)
