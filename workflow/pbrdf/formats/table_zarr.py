"""The table as a Zarr v3 folder, schema ``pbrdf/table/1``.

Arrays ``mueller`` and ``variance`` (wavelength, theta_h, theta_d, phi_d, row, col), ``count`` and
``origin`` (wavelength, theta_h, theta_d, phi_d), and a coordinate for each of the four axes; every
chunk carries a CRC-32C. `xarray.open_zarr` with ``consolidated=False`` opens it with its coordinates.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import zarr
from numpy.typing import NDArray
from zarr.codecs import BloscCodec, Crc32cCodec

from pbrdf.errors import InputError
from pbrdf.formats.folders import replace_folder
from pbrdf.formats.table_data import Origin, TableData
from pbrdf.formats.zarr_claims import require_backed

SCHEMA = "pbrdf/table/1"
FRAMES = (
    "L points to the light, V to the camera; the incident beam travels along z = -L, the reflected one "
    "along z = +V; both have x = norm(L x V), y = z x x; s2 > 0 along +45 degrees, s3 > 0 right circular"
)

_GRID = ("wavelength", "theta_h", "theta_d", "phi_d")
_UNITS = {"wavelength": "nm", "theta_h": "rad", "theta_d": "rad", "phi_d": "rad"}
_MATRIX = (*_GRID, "row", "col")
# More nodes than any axis can mean, and few enough to hold in memory
_LONGEST_AXIS = 100_000
_WRITE_AGAIN = "write the table again from its source"

# Tried on a smooth and a noisy table (ratio smooth/noisy; write, read in MB/s on two cores, CRC included):
# none 1.0/1.0, 680, 3460 · zstd 1 2.05/1.35, 760, 1420 · blosc zstd 1 shuffled 2.20/1.59, 690, 1440 ·
# blosc lz4 shuffled 1.85/1.60, 900, 2650.
_COMPRESSOR = BloscCodec(cname="lz4", clevel=1, shuffle="shuffle", typesize=4)


def write_table(path: str | Path, table: TableData, attributes: Mapping[str, Any]) -> None:
    """Write a table beside its place, then rename it there; the same table gives the same bytes.

    Parameters
    ----------
    path : str or Path
        Folder, by custom ``….zarr``; an old one is replaced once the new one is complete.
    table : TableData
    attributes : mapping
        JSON values that join the schema, units and frames in the attributes of the group.

    Raises
    ------
    InputError
        If an attribute has a name of the schema's own, or the disk refuses.
    """
    target = Path(path)
    own = {"schema": SCHEMA, "units": "1/sr", "frames": FRAMES}
    taken = own.keys() & attributes.keys()
    if taken:
        raise InputError(target, ", ".join(sorted(taken)), "is an attribute of the schema", "rename yours")
    try:
        with replace_folder(target) as beside:
            attributes = {**own, **attributes}
            group = zarr.create_group(store=str(beside), overwrite=True, zarr_format=3, attributes=attributes)
            _write_arrays(group, table)
    except OSError as error:
        problem = f"cannot be written: {error.strerror}"
        raise InputError(target, "folder", problem, "check the rights and room of its place") from error


def read_table(path: str | Path) -> TableData:
    """Read a whole table.

    Parameters
    ----------
    path : str or Path
        Folder of `write_table`.

    Returns
    -------
    TableData

    Raises
    ------
    InputError
        If the folder is no table of this schema, an array is missing, has another shape or type
        than its axes say, or a chunk is missing or damaged.
    """
    if not (Path(path) / "zarr.json").is_file():
        raise InputError(path, "zarr.json", "is not there", "give the folder of a table")
    with _damage_named(path, "zarr.json"):
        group = zarr.open_group(store=str(path), mode="r", zarr_format=3, use_consolidated=False)
    schema = group.attrs.get("schema")
    if schema != SCHEMA:
        raise InputError(path, "schema", f"is {schema!r}", f"give a table of schema {SCHEMA!r}")
    axes = {name: _read_axis(path, group, name) for name in _GRID}
    grid = tuple(len(values) for values in axes.values())
    mueller = _read_array(path, group, "mueller", np.float32, (*grid, 4, 4))
    if any(np.isinf(mueller[:, :, index]).any() for index in range(grid[2])):
        raise InputError(path, "mueller", "holds infinite values", _WRITE_AGAIN)
    return TableData(
        source=str(path),
        wavelengths_nm=axes["wavelength"],
        theta_h=axes["theta_h"],
        theta_d=axes["theta_d"],
        phi_d=axes["phi_d"],
        mueller=mueller,
        variance=_read_optional(path, group, "variance", np.float32, (*grid, 4, 4)),
        count=_read_optional(path, group, "count", np.uint16, grid),
        origin=_read_optional(path, group, "origin", np.uint8, grid),
    )


def _write_arrays(group: zarr.Group, table: TableData) -> None:
    """Coordinates first, then what lies on them."""
    axes = (table.wavelengths_nm, table.theta_h, table.theta_d, table.phi_d)
    for name, values in zip(_GRID, axes, strict=True):
        axis = np.asarray(values, dtype=np.float64)
        _write_array(group, name, axis, (name,), axis.shape, {"units": _UNITS[name]})
    halves, differences, azimuths = (len(values) for values in axes[1:])
    slab = (1, halves, 1, azimuths, 4, 4)
    _write_array(group, "mueller", table.mueller, _MATRIX, slab, {"units": "sr-1", "frames": FRAMES})
    if table.variance is not None:
        _write_array(group, "variance", table.variance, _MATRIX, slab, {"units": "sr-2"})
    whole = (1, halves, differences, azimuths)
    if table.count is not None:
        _write_array(group, "count", table.count, _GRID, whole, {"long_name": "photographs behind the node"})
    if table.origin is not None:
        meanings = " ".join(origin.name.lower() for origin in Origin)
        flags = {"flag_values": [int(origin) for origin in Origin], "flag_meanings": meanings}
        _write_array(group, "origin", table.origin, _GRID, whole, flags)


def _write_array(
    group: zarr.Group,
    name: str,
    values: NDArray[Any],
    dimensions: tuple[str, ...],
    chunk: tuple[int, ...],
    attributes: Mapping[str, Any],
) -> None:
    """Write one array, chunk row by chunk row, so that a transposed view is never copied whole."""
    array = group.create_array(
        name,
        shape=values.shape,
        chunks=chunk,
        dtype=values.dtype,
        compressors=[_COMPRESSOR, Crc32cCodec()],
        fill_value=np.nan if values.dtype.kind == "f" else 0,
        dimension_names=dimensions,
        attributes=dict(attributes),
        # a chunk that is always there is one whose loss can be noticed
        config={"write_empty_chunks": True},
    )
    for start in range(0, values.shape[0], chunk[0]):
        array[start : start + chunk[0]] = values[start : start + chunk[0]]


def _read_axis(path: str | Path, group: zarr.Group, name: str) -> NDArray[np.float64]:
    array = _array(path, group, name)
    if array.ndim != 1 or array.shape[0] > _LONGEST_AXIS or array.dtype != np.float64:
        problem = f"has shape {array.shape} and type {array.dtype}"
        raise InputError(path, name, problem, "write the axis as one row of float64")
    return _content(path, array, name)


def _read_array(
    path: str | Path, group: zarr.Group, name: str, dtype: type[np.generic], shape: tuple[int, ...]
) -> NDArray[Any]:
    array = _array(path, group, name)
    if array.shape != shape or array.dtype != dtype:
        problem = f"has shape {array.shape} and type {array.dtype}"
        expected = f"{shape} and {np.dtype(dtype)}"
        raise InputError(path, name, f"{problem} where the axes say {expected}", _WRITE_AGAIN)
    return _content(path, array, name)


def _read_optional(
    path: str | Path, group: zarr.Group, name: str, dtype: type[np.generic], shape: tuple[int, ...]
) -> NDArray[Any] | None:
    with _damage_named(path, name):
        there = name in group
    return _read_array(path, group, name, dtype, shape) if there else None


def _array(path: str | Path, group: zarr.Group, name: str) -> zarr.Array[Any]:
    with _damage_named(path, name):
        found = group.get(name)
    if not isinstance(found, zarr.Array):
        raise InputError(path, name, "is not in the table", _WRITE_AGAIN)
    return found


def _content(path: str | Path, array: zarr.Array[Any], name: str) -> NDArray[Any]:
    """All values of an array whose chunks are all there."""
    with _damage_named(path, name):
        require_backed(array, Path(path) / name)
        lost = array.nchunks - array.nchunks_initialized
        content: NDArray[Any] = np.asarray(array[...]) if lost == 0 else np.empty(0)
    if lost:
        raise InputError(path, name, f"has lost {lost} of {array.nchunks} chunks", _WRITE_AGAIN)
    return content


@contextmanager
def _damage_named(path: str | Path, name: str) -> Iterator[None]:
    """Turn what Zarr and its codecs raise on damaged files into an `InputError`."""
    try:
        yield
    # JSON, Zarr's metadata, Blosc and the checksum each raise a type of their own
    except Exception as error:
        problem = f"is damaged ({type(error).__name__}: {error})"
        raise InputError(path, name, problem, _WRITE_AGAIN) from error
