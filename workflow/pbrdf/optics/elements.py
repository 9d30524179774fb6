"""Elements that are put into the beam to test a polarimeter, and their ideal matrices."""

from __future__ import annotations

import numpy as np

from pbrdf.optics.mueller import Float, circular_polariser, linear_polariser

IDEAL: dict[str, Float] = {
    "air": np.eye(4),
    "LPH": linear_polariser(0.0),
    "LPV": linear_polariser(np.pi / 2),
    "CPL": circular_polariser(right=False),
    "CPR": circular_polariser(right=True),
}
"""Nothing, linear polarisers along x and y, left and right circular polarisers; x is horizontal."""
