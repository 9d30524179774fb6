"""A photograph of a session's target: one image from the frames of one light."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pbrdf.capture.frames import open_frames

Float = NDArray[np.float64]
WHOLE = (slice(None), slice(None))


@dataclass(frozen=True)
class Photograph:
    """Mean of a light's frames at its longest exposure, in its first band, above the dark level.

    Attributes
    ----------
    image : ndarray, shape (rows, columns)
        DN; where any frame is saturated, `saturation`.
    saturation : float
        DN.
    angle_deg : float
        Angle of the arm.
    """

    image: Float
    saturation: float
    angle_deg: float

    @classmethod
    def read(cls, manifest: str | Path) -> Photograph:
        """Read the frames that lie beside a manifest; raises `InputError` if one is missing or damaged."""
        store = open_frames(manifest)
        header = store.header
        states = [frames[-1] for (frames,) in store.read_states(header.bands_nm[0], *WHOLE)]
        mean = np.mean(states, axis=0, dtype=np.float64)
        saturated = np.max(states, axis=0) >= header.saturation
        image = np.where(saturated, header.saturation, mean - store.mean_dark(*WHOLE)[-1])
        return cls(image, header.saturation, header.angle_deg)
