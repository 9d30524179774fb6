"""Where the parts of a virtual rig stand."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf.optics.arm import Arm, Vector, turned
from pbrdf.optics.polarimeter import Polarimeter

UP = (0.0, -1.0, 0.0)
TO_CAMERA = (0.0, 0.0, -1.0)


def virtual_arm(rig: dict[str, Any]) -> Arm:
    """Arm of a virtual rig's file, its axis tilted as that tells; the generator's x is along the axis."""
    about_x, about_z = rig["arm"].get("axis_tilt_deg", (0.0, 0.0))
    axis, start = (
        _vector(turned(turned(part, (1, 0, 0), about_x), (0, 0, 1), about_z)) for part in (UP, TO_CAMERA)
    )
    centre = (0.0, 0.0, float(rig["distance_mm"]))
    return Arm(centre, axis, start, radius_mm=rig["arm"]["radius_mm"], generator_axis=axis)


def virtual_polarimeter(rig: dict[str, Any], band_nm: int) -> Polarimeter:
    """Polarimeter of a virtual rig's file in one band."""
    elements = rig["polarimeter"]
    zeros = elements["zeros_deg"]
    return Polarimeter(
        generator_retardance=2 * np.pi * elements["generator_retardance_waves"][str(band_nm)],
        analyser_retardance=2 * np.pi * elements["analyser_retardance_waves"][str(band_nm)],
        zeros=(
            float(np.deg2rad(zeros["generator_polariser"])),
            float(np.deg2rad(zeros["generator_retarder"])),
            float(np.deg2rad(zeros["analyser_retarder"])),
            float(np.deg2rad(zeros["analyser_polariser"])),
        ),
    )


def virtual_flat(rig: dict[str, Any]) -> NDArray[np.float32]:
    """Share of the light that each pixel of a virtual rig's camera receives: its vignetting.

    Parameters
    ----------
    rig : dict
        The rig's file, checked against its schema.

    Returns
    -------
    ndarray, shape (rows, columns), float32
        ``1 − v (r / r_corner)²`` with r the distance from the principal point and r_corner that of the
        farthest pixel; ones where the file tells no vignetting.
    """
    camera = rig["camera"]
    cx, cy = camera["principal_px"]
    row, column = np.ogrid[: camera["rows"], : camera["columns"]]
    square = (column - cx) ** 2 + (row - cy) ** 2
    flat: NDArray[np.float32] = (1.0 - rig.get("vignetting", 0.0) * square / square.max()).astype(np.float32)
    return flat


def _vector(parts: NDArray[np.float64]) -> Vector:
    x, y, z = (float(part) for part in parts)
    return x, y, z
