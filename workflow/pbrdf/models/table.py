"""A table that answers for any pair of directions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf.errors import InputError
from pbrdf.formats.pbsdf import MITSUBA_BANDS, read_pbsdf
from pbrdf.formats.table_data import TableData
from pbrdf.formats.tensor_file import read_tensor_file
from pbrdf.optics.frames import normalised
from pbrdf.optics.rusinkiewicz import angles

Float = NDArray[np.float64]
_Span = tuple[NDArray[np.intp], NDArray[np.intp], Float]

# 16 corners of 16 doubles are 2 KiB a direction: a block stays in the cache of a core
_BLOCK = 2048


@dataclass(frozen=True)
class Table:
    """A pBRDF table as a function of directions and wavelength.

    Attributes
    ----------
    data : TableData
        Nodes and their matrices.
    """

    data: TableData

    def evaluate(self, to_light: ArrayLike, to_camera: ArrayLike, wavelength_nm: ArrayLike) -> Float:
        """Mueller matrices in 1/sr, table frames (`pbrdf.optics`), without the cosine.

        Multilinear in wavelength, θh, θd and φd, held constant beyond the ends of each axis. φd does
        not wrap: a complete table stores both of its ends.

        Parameters
        ----------
        to_light, to_camera : array_like, shapes (..., 3)
            Vectors toward the light and the camera, of any length, z along the surface normal.
        wavelength_nm : array_like, shape (...)
            nm. The three broadcast together.

        Returns
        -------
        ndarray, shape (..., 4, 4), float64
            As stored, M00 below zero included. NaN where a direction lies below the horizon, and
            where any node that takes part is NaN (Mitsuba gives 0 for both). Where light and camera
            coincide, the frames are those of φd = 0.

        Raises
        ------
        InputError
            If the shapes do not fit together.
        """
        light, camera, wavelength = _broadcast(to_light, to_camera, wavelength_nm)
        result = np.empty((*wavelength.shape, 4, 4))
        flat = result.reshape(-1, 4, 4)
        light, camera, wavelength = light.reshape(-1, 3), camera.reshape(-1, 3), wavelength.reshape(-1)
        for start in range(0, len(flat), _BLOCK):
            block = slice(start, start + _BLOCK)
            flat[block] = self._evaluate_block(
                normalised(light[block]), normalised(camera[block]), wavelength[block]
            )
        return result

    def _evaluate_block(self, light: Float, camera: Float, wavelength: Float) -> Float:
        theta_h, theta_d, phi_d = angles(light, camera)
        spans = (
            _span(self.data.wavelengths_nm, wavelength),
            _span(self.data.theta_h, theta_h),
            _span(self.data.theta_d, theta_d),
            _span(self.data.phi_d, phi_d),
        )
        matrices = np.zeros((len(wavelength), 4, 4))
        for corner in product((0, 1), repeat=4):
            weight = np.ones(len(wavelength))
            for upper, (_, _, fraction) in zip(corner, spans, strict=True):
                weight *= fraction if upper else 1.0 - fraction
            node = tuple(span[upper] for upper, span in zip(corner, spans, strict=True))
            matrices += weight[:, None, None] * self.data.mueller[node]
        # written so that NaN directions count as below too
        matrices[~((light[:, 2] >= 0.0) & (camera[:, 2] >= 0.0))] = np.nan
        return matrices


def require_known_kind(path: Path) -> None:
    """Refuse a file that no reader of tables is for (`InputError`)."""
    if path.suffix not in (".zarr", ".pbsdf", ".mat"):
        problem = f"is of the unknown kind {path.suffix!r}"
        raise InputError(path, "file", problem, "give a .zarr, .pbsdf or .mat table")


def count_bands(path: Path) -> int:
    """Bands of a table, read from as little of it as possible.

    A published ``.mat`` holds five. Five are taken too for a file that cannot be read: opening it says why.
    """
    try:
        if path.suffix == ".pbsdf":
            return int(read_tensor_file(path)["wvls"].size)
        if path.suffix == ".zarr":
            from pbrdf.formats.table_zarr import read_wavelengths

            return len(read_wavelengths(path))
    except (InputError, KeyError):
        return MITSUBA_BANDS
    else:
        return MITSUBA_BANDS


def open_table(path: str | Path, axes: Mapping[str, ArrayLike] | str | Path | None = None) -> Table:
    """Open a table of any kind that is known by its name.

    Parameters
    ----------
    path : str or Path
        A ``.zarr`` folder of this project, a ``.pbsdf`` of Mitsuba or a ``.mat`` of the KAIST dataset.
    axes : mapping or path, optional
        For a ``.pbsdf`` whose axis fields are empty: ``theta_h``, ``theta_d``, ``phi_d`` in radians, or
        the path of a YAML file that holds them (`pbrdf.formats.axes_file`).
        For a ``.mat`` without axes: the path of the ``.mat`` that holds them.

    Returns
    -------
    Table

    Raises
    ------
    InputError
        If there is no such file, its kind is unknown, it cannot be read, or `axes` does not suit it.
    """
    path = Path(path)
    if not path.exists():
        raise InputError(path, "file", "is not there", "check the path")
    require_known_kind(path)
    if path.suffix == ".zarr":
        if axes is not None:
            raise InputError(path, "axes", "are given, but a .zarr table holds its own", "leave them out")
        # Zarr, and SciPy below, take longer to import than NumPy: only those who need them wait
        from pbrdf.formats.table_zarr import read_table

        return Table(read_table(path))
    if path.suffix == ".pbsdf":
        if isinstance(axes, str | Path):
            from pbrdf.formats.axes_file import read_axes

            axes = read_axes(axes)
        return Table(read_pbsdf(path, axes))
    if isinstance(axes, Mapping):
        remedy = "give the path of pbrdf_table_info.mat"
        raise InputError(path, "axes", "are given as values", remedy)
    from pbrdf.formats.kaist_mat import read_kaist_mat

    return Table(read_kaist_mat(path, axes))


def _broadcast(
    to_light: ArrayLike, to_camera: ArrayLike, wavelength_nm: ArrayLike
) -> tuple[Float, Float, Float]:
    """Bring the three arguments to float64 arrays of shapes (..., 3), (..., 3), (...)."""
    arrays = [np.asarray(values, dtype=np.float64) for values in (to_light, to_camera, wavelength_nm)]
    for name, vectors in zip(("to_light", "to_camera"), arrays, strict=False):
        if vectors.shape[-1:] != (3,):
            raise InputError(
                "Table.evaluate", name, f"has shape {vectors.shape}", "give vectors of 3 numbers"
            )
    shapes = [arrays[0].shape[:-1], arrays[1].shape[:-1], arrays[2].shape]
    try:
        shape = np.broadcast_shapes(*shapes)
    except ValueError as error:
        problem = f"have shapes {', '.join(map(str, shapes))} beside their last axis"
        raise InputError("Table.evaluate", "arguments", problem, "give shapes that broadcast") from error
    light, camera = (np.broadcast_to(vectors, (*shape, 3)) for vectors in arrays[:2])
    return light, camera, np.broadcast_to(arrays[2], shape)


def _span(axis: Float, values: Float) -> _Span:
    """Nodes below and above each value, and how far it lies between them, in [0, 1).

    A node that takes no part is never named: on a node, and beyond the ends, both are the same.
    """
    last = len(axis) - 1
    lower = np.clip(np.searchsorted(axis, values, side="right") - 1, 0, last)
    upper = np.minimum(lower + 1, last)
    width = np.where(upper > lower, axis[upper] - axis[lower], 1.0)
    inside = np.clip(values, axis[0], axis[-1])
    fraction = (inside - axis[lower]) / width
    # a quotient may round up to the next node
    lower = np.where(fraction >= 1.0, upper, lower)
    fraction = np.where(fraction >= 1.0, 0.0, fraction)
    return lower, np.where(fraction > 0.0, upper, lower), fraction
