"""The table as a Zarr v3 folder, schema ``pbrdf/table/1``.

Arrays ``mueller`` and ``variance`` (wavelength, theta_h, theta_d, phi_d, row, col), ``count`` and
``origin`` (wavelength, theta_h, theta_d, phi_d), and a coordinate for each of the four axes; every
chunk carries a CRC-32C. `xarray.open_zarr` with ``consolidated=False`` opens it with its coordinates.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
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
from pbrdf.formats.zarr_claims import require_backed, require_sealed, seal

SCHEMA = "pbrdf/table/1"
FRAMES = (
    "L points to the light, V to the camera; the incident beam travels along z = -L, the reflected one "
    "along z = +V; both have x = norm(L x V), y = z x x; s2 > 0 along +45 degrees, s3 > 0 right circular"
)

ARRAYS = ("mueller", "variance", "count", "origin")
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


class TableWriter:
    """A table on the disk that takes shape band by band (`new_table`)."""

    def __init__(self, arrays: Mapping[str, zarr.Array[Any]]) -> None:
        self._arrays = arrays

    def write(self, index: int, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Write one band of each of the table's arrays, shapes (H, D, P, …), chunk by chunk."""
        for name, values in arrays.items():
            # a band at a time, so that a transposed view is never copied whole
            self._arrays[name][index : index + 1] = values[None]


@contextmanager
def new_table(
    path: str | Path,
    axes: Mapping[str, NDArray[np.float64]],
    attributes: Mapping[str, Any],
    arrays: Collection[str] = ARRAYS,
) -> Iterator[TableWriter]:
    """Write a table band by band, beside its place; it is renamed there when the block ends well.

    Parameters
    ----------
    path : str or Path
        Folder, by custom ``….zarr``; an old one is replaced once the new one is complete.
    axes : mapping
        ``wavelength`` (nm), ``theta_h``, ``theta_d`` and ``phi_d`` (radians), in this order.
    attributes : mapping
        JSON values that join the schema, units and frames in the attributes of the group.
    arrays : collection of str
        Which of `ARRAYS` the table has.

    Yields
    ------
    TableWriter
        Takes every band once; the same table gives the same bytes.

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
    with replace_folder(target) as beside:
        attributes = {**own, **attributes}
        group = zarr.create_group(store=str(beside), overwrite=True, zarr_format=3, attributes=attributes)
        created = _create_arrays(group, axes, arrays)
        seal(group, beside)
        yield TableWriter(created)


def write_table(path: str | Path, table: TableData, attributes: Mapping[str, Any]) -> None:
    """Write a whole table as `new_table` does; raises `InputError` as it does."""
    axes = (table.wavelengths_nm, table.theta_h, table.theta_d, table.phi_d)
    whole = {name: getattr(table, name) for name in ARRAYS if getattr(table, name) is not None}
    with new_table(path, dict(zip(_GRID, axes, strict=True)), attributes, whole.keys()) as writer:
        for index in range(len(table.wavelengths_nm)):
            writer.write(index, {name: values[index] for name, values in whole.items()})


def read_wavelengths(path: str | Path) -> NDArray[np.float64]:
    """Bands of a table, nm; raises `InputError` as `read_table` does."""
    wavelengths = _read_axis(path, _opened(path), "wavelength")
    _require_sealed(path)
    return wavelengths


def read_table(path: str | Path, *, bands: slice = slice(None), variance: bool = True) -> TableData:
    """Read a table.

    Parameters
    ----------
    path : str or Path
        Folder of `write_table`.
    bands : slice
        Which of its bands.
    variance : bool
        Whether to read the variances, which are as large as the matrices.

    Returns
    -------
    TableData

    Raises
    ------
    InputError
        If the folder is no table of this schema, an array is missing, has another shape or type
        than its axes say, or a chunk is missing or damaged.
    """
    group = _opened(path)
    axes = {name: _read_axis(path, group, name) for name in _GRID}
    grid = tuple(len(values) for values in axes.values())
    matrices = (*grid, 4, 4)
    mueller = _read_array(path, group, "mueller", np.float32, matrices, bands)
    if any(np.isinf(mueller[:, :, index]).any() for index in range(grid[2])):
        raise InputError(path, "mueller", "holds infinite values", _WRITE_AGAIN)
    table = TableData(
        source=str(path),
        wavelengths_nm=axes["wavelength"][bands],
        theta_h=axes["theta_h"],
        theta_d=axes["theta_d"],
        phi_d=axes["phi_d"],
        mueller=mueller,
        variance=_read_optional(path, group, "variance", np.float32, matrices, bands) if variance else None,
        count=_read_optional(path, group, "count", np.uint16, grid, bands),
        origin=_read_optional(path, group, "origin", np.uint8, grid, bands),
    )
    _require_sealed(path)
    return table


def _opened(path: str | Path) -> zarr.Group:
    if not (Path(path) / "zarr.json").is_file():
        raise InputError(path, "zarr.json", "is not there", "give the folder of a table")
    with _damage_named(path, "zarr.json"):
        group = zarr.open_group(store=str(path), mode="r", zarr_format=3, use_consolidated=False)
    schema = group.attrs.get("schema")
    if schema != SCHEMA:
        raise InputError(path, "schema", f"is {schema!r}", f"give a table of schema {SCHEMA!r}")
    return group


def _require_sealed(path: str | Path) -> None:
    """Refuse metadata that are possible and not those that were written."""
    with _damage_named(path, "zarr.json"):
        require_sealed(Path(path))


def _create_arrays(
    group: zarr.Group, axes: Mapping[str, NDArray[np.float64]], arrays: Collection[str]
) -> dict[str, zarr.Array[Any]]:
    """Coordinates first, then what will lie on them."""
    for name, values in axes.items():
        axis = np.asarray(values, dtype=np.float64)
        array = _create_array(
            group, name, axis.dtype, axis.shape, (name,), axis.shape, {"units": _UNITS[name]}
        )
        array[...] = axis
    shape = tuple(len(axes[name]) for name in _GRID)
    _, halves, differences, azimuths = shape
    slab = (1, halves, 1, azimuths, 4, 4)
    whole = (1, halves, differences, azimuths)
    meanings = " ".join(origin.name.lower() for origin in Origin)
    flags = {"flag_values": [int(origin) for origin in Origin], "flag_meanings": meanings}
    described: dict[str, tuple[type[np.generic], Mapping[str, Any]]] = {
        "mueller": (np.float32, {"units": "sr-1", "frames": FRAMES}),
        "variance": (np.float32, {"units": "sr-2"}),
        "count": (np.uint16, {"long_name": "pixels behind the node"}),
        "origin": (np.uint8, flags),
    }
    created = {}
    for name, (dtype, attributes) in described.items():
        if name not in arrays:
            continue
        if name in ("mueller", "variance"):
            created[name] = _create_array(
                group, name, np.dtype(dtype), (*shape, 4, 4), _MATRIX, slab, attributes
            )
        else:
            created[name] = _create_array(group, name, np.dtype(dtype), shape, _GRID, whole, attributes)
    return created


def _create_array(
    group: zarr.Group,
    name: str,
    dtype: np.dtype[Any],
    shape: tuple[int, ...],
    dimensions: tuple[str, ...],
    chunk: tuple[int, ...],
    attributes: Mapping[str, Any],
) -> zarr.Array[Any]:
    return group.create_array(
        name,
        shape=shape,
        chunks=chunk,
        dtype=dtype,
        compressors=[_COMPRESSOR, Crc32cCodec()],
        fill_value=np.nan if dtype.kind == "f" else 0,
        dimension_names=dimensions,
        attributes=dict(attributes),
        # a chunk that is always there is one whose loss can be noticed
        config={"write_empty_chunks": True},
    )


def _read_axis(path: str | Path, group: zarr.Group, name: str) -> NDArray[np.float64]:
    array = _array(path, group, name)
    if array.ndim != 1 or array.shape[0] > _LONGEST_AXIS or array.dtype != np.float64:
        problem = f"has shape {array.shape} and type {array.dtype}"
        raise InputError(path, name, problem, "write the axis as one row of float64")
    return _content(path, array, name)


def _read_array(
    path: str | Path,
    group: zarr.Group,
    name: str,
    dtype: type[np.generic],
    shape: tuple[int, ...],
    bands: slice,
) -> NDArray[Any]:
    array = _array(path, group, name)
    if array.shape != shape or array.dtype != dtype:
        problem = f"has shape {array.shape} and type {array.dtype}"
        expected = f"{shape} and {np.dtype(dtype)}"
        raise InputError(path, name, f"{problem} where the axes say {expected}", _WRITE_AGAIN)
    return _content(path, array, name, bands)


def _read_optional(
    path: str | Path,
    group: zarr.Group,
    name: str,
    dtype: type[np.generic],
    shape: tuple[int, ...],
    bands: slice,
) -> NDArray[Any] | None:
    with _damage_named(path, name):
        there = name in group
    return _read_array(path, group, name, dtype, shape, bands) if there else None


def _array(path: str | Path, group: zarr.Group, name: str) -> zarr.Array[Any]:
    with _damage_named(path, name):
        found = group.get(name)
    if not isinstance(found, zarr.Array):
        raise InputError(path, name, "is not in the table", _WRITE_AGAIN)
    return found


def _content(
    path: str | Path, array: zarr.Array[Any], name: str, first_axis: slice = slice(None)
) -> NDArray[Any]:
    """Values of an array whose chunks are all there."""
    with _damage_named(path, name):
        require_backed(array, Path(path) / name)
        lost = array.nchunks - array.nchunks_initialized
        content: NDArray[Any] = np.asarray(array[first_axis]) if lost == 0 else np.empty(0)
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
