"""The lamp's own disc in a picture of it: which pixels show it."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from pbrdf.errors import InputError

SEEN = 10.0
"""Standard deviations of its noise by which a pixel that shows the lamp is above darkness."""

BRIGHT = 0.5
"""Share of the brightest neighbourhood: below it lie edge, ghosts and stray light."""

EDGE_PX = 2
"""Pixels taken off along the edge, which the disc covers in part and the lens blurs."""

MOST_SATURATED = 0.5
"""Share of the disc that may be saturated: what is left of a disc more saturated is no fair sample."""


def lamp_pixels(
    brightness: NDArray[np.floating], variance: NDArray[np.floating], source: str | Path, field: str
) -> NDArray[np.bool_]:
    """Find the pixels that show the lamp, from the frames alone.

    Parameters
    ----------
    brightness, variance : ndarray, shape (rows, columns)
        Brightness over all states, such as M00, and its variance; NaN where a state is saturated.
    source : str or Path
        Where the image comes from, for messages.
    field : str
        Its band, for messages.

    Returns
    -------
    ndarray, shape (rows, columns), bool
        Bright pixels that are not saturated, those along the edge left out.

    Raises
    ------
    InputError
        If none shows the lamp, or most of its disc is saturated.
    """
    saturated = np.isnan(brightness)
    known = np.where(saturated, 0.0, brightness).astype(np.float32)
    noise = np.sqrt(np.where(saturated, np.inf, variance))
    seen = known > SEEN * noise
    # a median over neighbours: a hot pixel is not the lamp
    steady = cv2.medianBlur(np.where(seen, known, 0.0).astype(np.float32), 3)
    bright = seen & (known > BRIGHT * float(steady.max()))
    square = np.ones((2 * EDGE_PX + 1, 2 * EDGE_PX + 1), np.uint8)
    # saturated pixels are the lamp's too: it is the brightest thing there is
    disc = cv2.erode((bright | saturated).astype(np.uint8), square, borderValue=0).astype(np.bool_)
    if not disc.any():
        raise InputError(source, field, "shows the lamp in no pixel", "check arm, shutter and exposure times")
    lost = float(saturated[disc].mean())
    if lost > MOST_SATURATED:
        problem = f"is saturated at every exposure in {100 * lost:.0f} % of the lamp's pixels"
        raise InputError(source, field, problem, "add a shorter exposure")
    lamp: NDArray[np.bool_] = disc & ~saturated
    return lamp
