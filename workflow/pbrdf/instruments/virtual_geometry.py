"""Where the parts of a virtual rig stand: the same for the frames it takes and for its nominal values."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf.optics.arm import Arm
from pbrdf.optics.polarimeter import Polarimeter

UP = (0.0, -1.0, 0.0)


def virtual_arm(rig: dict[str, Any]) -> Arm:
    """Arm of a virtual rig's file."""
    centre = (0.0, 0.0, float(rig["distance_mm"]))
    return Arm(centre, axis=UP, start=(0.0, 0.0, -1.0), radius_mm=rig["arm"]["radius_mm"], generator_axis=UP)


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
