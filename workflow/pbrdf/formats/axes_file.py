"""Axes of a table as a YAML file, for tables that do not hold their own.

Keys ``theta_h_deg``, ``theta_d_deg``, ``phi_d_deg``: lists of node positions in degrees, ascending.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.formats.table_data import check_axis
from pbrdf.formats.yaml_file import read_yaml

_LIMITS = {"theta_h_deg": (0.0, 90.0), "theta_d_deg": (0.0, 90.0), "phi_d_deg": (-180.0, 180.0)}


def read_axes(path: str | Path) -> dict[str, NDArray[np.float64]]:
    """Read axes.

    Parameters
    ----------
    path : str or Path
        YAML file with any of the three keys.

    Returns
    -------
    dict of str to ndarray, shape (N,), float64
        ``theta_h``, ``theta_d``, ``phi_d`` in radians, as far as the file gives them.

    Raises
    ------
    InputError
        If the file is missing or not YAML, a key is unknown, or an axis is not a list of finite,
        ascending numbers within its range.
    """
    content = read_yaml(path, "correct it")
    known = ", ".join(_LIMITS)
    if not isinstance(content, dict) or not content:
        raise InputError(path, "file", "holds no axes", f"give lists under {known}")
    unknown = [str(key) for key in content if key not in _LIMITS]
    if unknown:
        raise InputError(path, ", ".join(unknown), "is no axis", f"the keys are {known}")
    return {key.removesuffix("_deg"): _axis(path, key, values) for key, values in content.items()}


def _axis(path: str | Path, key: str, values: Any) -> NDArray[np.float64]:
    is_list = isinstance(values, list)
    if not is_list or any(isinstance(v, bool) or not isinstance(v, int | float) for v in values):
        raise InputError(path, key, "is not a list of numbers", "give node positions in degrees")
    degrees = np.asarray(values, dtype=np.float64)
    check_axis(path, key, degrees)
    low, high = _LIMITS[key]
    if degrees[0] < low or degrees[-1] > high:
        problem = f"runs from {degrees[0]:g} to {degrees[-1]:g}"
        raise InputError(path, key, problem, f"keep it within {low:g} to {high:g} degrees")
    return np.radians(degrees)
