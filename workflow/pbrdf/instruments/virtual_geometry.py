"""Where the parts of a virtual rig stand: the same for the frames it takes and for its nominal values."""

from __future__ import annotations

from typing import Any

import numpy as np

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
