"""MATLAB files of the published KAIST tables: ``pbrdf_T`` (raw) and ``pbrdf_T_f`` (filled).

Arrays lie as (phi_d, theta_d, theta_h, wvls, 4, 4), 1/sr, table frames. The axes ``theta_h``,
``theta_d``, ``phi_d`` (1, N) in radians and ``wvls`` (1, B) in nm lie in the same file or in one of
their own (``pbrdf_table_info.mat``).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.formats.mat_file import MatDamage, mat_arrays
from pbrdf.formats.pbsdf import ANGLE_AXES, table_from_file_order
from pbrdf.formats.table_data import TableData

_VARIABLES = {"filled": "pbrdf_T_f", "raw": "pbrdf_T"}
_AXES = (*ANGLE_AXES, "wvls")


def read_kaist_mat(
    path: str | Path,
    axes_path: str | Path | None = None,
    *,
    form: Literal["filled", "raw"] | None = None,
) -> TableData:
    """Read a table of the published dataset from its MATLAB form.

    Parameters
    ----------
    path : str or Path
        MAT-file up to version 7.
    axes_path : str or Path, optional
        File of the axes, where `path` does not hold them itself.
    form : {"filled", "raw"}, optional
        Which table to take; filled where there are both and nothing is said.

    Returns
    -------
    TableData
        With `mueller` in an order other than C.

    Raises
    ------
    InputError
        If a file cannot be read, is HDF5 (version 7.3), or lacks the table or an axis.
    """
    names = _names(path)
    variable = _choose(path, names, form)
    content = _load(path, [variable, *(name for name in _AXES if name in names)])
    axes = _axes(path, content, axes_path)
    stored = content[variable]
    if stored.dtype.kind != "f":
        raise InputError(path, variable, f"has the type {stored.dtype}", "save it as single or double")
    # MATLAB's order leaves the 16 elements of one matrix megabytes apart
    matrices = np.ascontiguousarray(stored, dtype=np.float32)
    return table_from_file_order(path, axes, axes["wvls"], matrices)


def _choose(path: str | Path, names: set[str], form: Literal["filled", "raw"] | None) -> str:
    """Name of the variable to read."""
    wanted = tuple(_VARIABLES.values()) if form is None else (_VARIABLES[form],)
    for variable in wanted:
        if variable in names:
            return variable
    there = ", ".join(sorted(names)) or "nothing"
    raise InputError(
        path, " or ".join(wanted), f"is not in the file, which holds {there}", "give the table's file"
    )


def _axes(
    path: str | Path, content: dict[str, NDArray[Any]], axes_path: str | Path | None
) -> dict[str, NDArray[Any]]:
    """Gather the four axes from the table's own file or the other; they must not disagree."""
    own = {name: content[name] for name in _AXES if name in content}
    other = {} if axes_path is None else _load(axes_path, list(_AXES))
    for name in _AXES:
        if name not in own and name not in other:
            remedy = "give the file that holds the axes (pbrdf_table_info.mat of the dataset)"
            raise InputError(path if axes_path is None else axes_path, name, "is not in the file", remedy)
        if name in own and name in other and not _agree(own[name], other[name]):
            remedy = "leave the axes file out, or give the one that belongs to the table"
            raise InputError(path, name, f"differs from that of {axes_path}", remedy)
    return {**other, **own}


def _agree(own: NDArray[Any], other: NDArray[Any]) -> bool:
    """Whether two axes are the same to float32."""
    numbers = own.dtype.kind in "uif" and other.dtype.kind in "uif"
    return numbers and own.shape == other.shape and bool(np.allclose(own, other, rtol=0, atol=1e-6))


def _names(path: str | Path) -> set[str]:
    """Names of the variables in a MAT-file."""
    with _readable(path):
        return set(mat_arrays(path))


def _load(path: str | Path, names: list[str]) -> dict[str, NDArray[Any]]:
    """Load the named variables, those that are there."""
    with _readable(path):
        arrays = mat_arrays(path)
        return {name: arrays[name].read() for name in names if name in arrays}


@contextmanager
def _readable(path: str | Path) -> Iterator[None]:
    """Turn what a file that cannot be read raises into an `InputError`."""
    try:
        yield
    except NotImplementedError as error:
        remedy = "save it with MATLAB's save(…, '-v7')"
        raise InputError(path, "file", "is MAT version 7.3 (HDF5)", remedy) from error
    except OSError as error:
        raise InputError(path, "file", error.strerror or str(error), "check the path") from error
    except MatDamage as error:
        problem = f"is no MAT-file that can be read ({error})"
        raise InputError(path, "file", problem, "fetch or save it again") from error
