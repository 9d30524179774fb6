"""Mitsuba's ``.pbsdf``: a pBRDF table in a tensor file, as ``measured_polarized`` reads it.

Fields: ``phi_d``, ``theta_d``, ``theta_h`` float32 (1, N), radians; ``wvls`` uint16 (B,), nm; ``M``
float32 (phi_d, theta_d, theta_h, wvls, 4, 4), 1/sr, table frames, no cosine. The plugin copies
exactly five wavelengths whatever the file says.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf.errors import InputError
from pbrdf.formats.table_data import TableData, check_axis
from pbrdf.formats.tensor_file import read_tensor_file, write_tensor_file

ANGLE_AXES = ("theta_h", "theta_d", "phi_d")
_LIMITS = {"theta_h": (0.0, np.pi / 2), "theta_d": (0.0, np.pi / 2), "phi_d": (-np.pi, np.pi)}
MITSUBA_BANDS = 5
# float32 at π resolves 2.4e-7 rad
_SAME_ANGLE = 1e-6


def read_pbsdf(path: str | Path, axes: Mapping[str, ArrayLike] | None = None) -> TableData:
    """Read a table of Mitsuba's ``measured_polarized``, with any number of wavelengths.

    Parameters
    ----------
    path : str or Path
    axes : mapping of str to array_like, optional
        ``theta_h``, ``theta_d``, ``phi_d`` in radians, for files whose own axis fields are empty.
        An axis that the file holds itself must agree with the one given.

    Returns
    -------
    TableData
        `mueller` is a read-only view of the mapped file, in an order other than C.

    Raises
    ------
    InputError
        If the file is damaged, an axis is empty and not given, or given and different.
    """
    given = _given_axes(path, axes)
    fields = read_tensor_file(path)
    missing = {*ANGLE_AXES, "wvls", "M"} - fields.keys()
    if missing:
        remedy = "give a table written for measured_polarized"
        raise InputError(path, ", ".join(sorted(missing)), "is not in the file", remedy)
    matrices = fields["M"]
    if matrices.dtype != np.float32:
        raise InputError(path, "M", f"has the type {matrices.dtype}", "write it as float32")
    own = {name: fields[name] for name in ANGLE_AXES}
    return table_from_file_order(path, {**own, **_repaired(path, own, given)}, fields["wvls"], matrices)


def write_pbsdf(path: str | Path, table: TableData) -> None:
    """Write a table for Mitsuba's ``measured_polarized``.

    Unknown nodes stay NaN: the plugin takes them as black. Variance, count and origin have no
    place in this format.

    Parameters
    ----------
    path : str or Path
    table : TableData
        With exactly five wavelengths, each a whole number of nm.

    Raises
    ------
    InputError
        If the wavelengths are not five whole numbers, or the disk refuses.
    """
    wavelengths = table.wavelengths_nm
    if len(wavelengths) != MITSUBA_BANDS:
        raise InputError(
            table.source,
            "wavelength",
            f"has {len(wavelengths)} bands where Mitsuba reads exactly {MITSUBA_BANDS}",
            f"select {MITSUBA_BANDS} bands, or split the table into files of {MITSUBA_BANDS}",
        )
    stored = np.rint(np.clip(wavelengths, 0, np.iinfo(np.uint16).max)).astype(np.uint16)
    if np.any(stored != wavelengths):
        remedy = "select bands at whole nanometres"
        raise InputError(table.source, "wavelength", f"{wavelengths} nm are not whole numbers", remedy)
    axes = {name: getattr(table, name).astype(np.float32)[None] for name in ANGLE_AXES}
    matrices = to_file_order(table.mueller)
    write_tensor_file(path, {**axes, "wvls": stored, "M": matrices})


def to_file_order(mueller: NDArray[np.float32]) -> NDArray[np.float32]:
    """View of (B, H, D, P, 4, 4) as the published files order it, (P, D, H, B, 4, 4), and back."""
    return mueller.transpose(3, 2, 1, 0, 4, 5)


def table_from_file_order(
    path: str | Path,
    axes: Mapping[str, NDArray[Any]],
    wavelengths: NDArray[Any],
    matrices: NDArray[np.float32],
) -> TableData:
    """Table of arrays as the published files hold them.

    Parameters
    ----------
    path : str or Path
        For messages.
    axes : mapping of str to ndarray, shapes (1, N) or (N,)
        ``theta_h``, ``theta_d``, ``phi_d``, radians.
    wavelengths : ndarray, shape (1, B) or (B,)
        nm.
    matrices : ndarray, shape (P, D, H, B, 4, 4), float32
        1/sr.

    Raises
    ------
    InputError
        If an axis is no ascending row of angles, shapes disagree or a value is infinite.
    """
    angles = {name: _row(path, name, axes[name]) for name in ANGLE_AXES}
    for name, values in angles.items():
        check_axis(path, name, values)
        low, high = _LIMITS[name]
        if values[0] < low - _SAME_ANGLE or values[-1] > high + _SAME_ANGLE:
            problem = f"runs from {values[0]:.6g} to {values[-1]:.6g}, beyond {low:.4g} to {high:.4g} rad"
            raise InputError(path, name, problem, "give the axis in radians")
    expected = tuple(len(angles[name]) for name in reversed(ANGLE_AXES))
    bands = _row(path, "wvls", wavelengths)
    if matrices.shape != (*expected, len(bands), 4, 4):
        problem = f"has shape {matrices.shape} where its axes say {(*expected, len(bands), 4, 4)}"
        raise InputError(path, "M", problem, "check that the axes belong to this file")
    # slab by slab, because the mask of a whole table would take 228 MiB
    if any(np.isinf(slab).any() for slab in matrices):
        raise InputError(path, "M", "holds infinite values", "write the table again from its source")
    return TableData(
        source=str(path),
        wavelengths_nm=bands,
        theta_h=angles["theta_h"],
        theta_d=angles["theta_d"],
        phi_d=angles["phi_d"],
        mueller=to_file_order(matrices),
    )


def _row(path: str | Path, name: str, values: NDArray[Any]) -> NDArray[np.float64]:
    """Read an axis stored as (N,) or (1, N) as float64 (N,)."""
    if (
        values.ndim not in (1, 2)
        or (values.ndim == 2 and values.shape[0] > 1)
        or values.dtype.kind not in "uif"
    ):
        problem = f"has shape {values.shape} and type {values.dtype}"
        raise InputError(path, name, problem, "store the axis as one row of numbers")
    return values.reshape(-1).astype(np.float64)


def _given_axes(path: str | Path, axes: Mapping[str, ArrayLike] | None) -> dict[str, NDArray[np.float64]]:
    """Axes of the caller as arrays; names other than the three angles are refused."""
    given = {} if axes is None else dict(axes)
    unknown = given.keys() - set(ANGLE_AXES)
    if unknown:
        problem = f"names the unknown axis {', '.join(sorted(unknown))}"
        raise InputError(path, "axes", problem, f"name only {', '.join(ANGLE_AXES)}")
    try:
        return {name: np.asarray(values, dtype=np.float64) for name, values in given.items()}
    except (TypeError, ValueError) as error:
        raise InputError(path, "axes", f"holds no numbers: {error}", "give lists of radians") from error


def _repaired(
    path: str | Path, own: Mapping[str, NDArray[Any]], given: Mapping[str, NDArray[np.float64]]
) -> dict[str, NDArray[Any]]:
    """Axes for the empty fields of a file; refuses what would be a guess."""
    repaired: dict[str, NDArray[Any]] = {}
    for name in ANGLE_AXES:
        if own[name].size == 0:
            if name not in given:
                problem = f"is empty (shape {own[name].shape}): the file does not say where its nodes lie"
                remedy = "name a file of axes in the column `details`, or with --axes FILE.yaml"
                raise InputError(path, name, problem, remedy)
            repaired[name] = given[name]
        elif name in given:
            stored = _row(path, name, own[name])
            if stored.shape != given[name].shape or not np.allclose(
                stored, given[name], rtol=0, atol=_SAME_ANGLE
            ):
                remedy = f"drop {name} from the file of axes, or give the table that it belongs to"
                raise InputError(path, name, "differs from the axis given", remedy)
    return repaired
