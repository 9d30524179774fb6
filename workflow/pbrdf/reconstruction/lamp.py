"""The lamp's own disc in a Mueller image: where it is, and the matrix that its pixels agree on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.optics.frames import change_frames
from pbrdf.optics.mueller import rotator

Float = NDArray[np.float64]

SEEN = 10.0
"""Standard deviations of its noise by which a pixel that shows the lamp is above darkness."""

BRIGHT = 0.5
"""Share of the brightest neighbourhood's M00: below it lie edge, ghosts and stray light."""

EDGE_PX = 2
"""Pixels taken off along the edge, which the disc covers in part and the lens blurs."""

MOST_SATURATED = 0.5
"""Share of the disc that may lack a matrix: what is left of a disc more saturated is no fair sample."""


@dataclass(frozen=True)
class LampMatrix:
    """Mean Mueller matrix of the lamp's pixels.

    Attributes
    ----------
    mueller : ndarray, shape (4, 4)
        Divided by M00.
    standard_error : ndarray, shape (4, 4)
        Of `mueller`, from the stored variances. They say nothing of covariances: elements count as
        uncorrelated.
    scatter : ndarray, shape (4, 4)
        Standard deviation of the pixels' own matrices, each divided by its M00.
    m00_dn_per_s : float
        Mean M00, DN/s.
    pixels : int
        Their number.
    """

    mueller: Float
    standard_error: Float
    scatter: Float
    m00_dn_per_s: float
    pixels: int


def lamp_pixels(
    m00: NDArray[np.floating], variance: NDArray[np.floating], source: str | Path, field: str
) -> NDArray[np.bool_]:
    """Find the pixels that show the lamp, from the frames alone.

    Parameters
    ----------
    m00, variance : ndarray, shape (rows, columns)
        M00 and its variance; NaN where a state is saturated at every exposure.
    source : str or Path
        Where the image comes from, for messages.
    field : str
        Its band, for messages.

    Returns
    -------
    ndarray, shape (rows, columns), bool
        Bright pixels with a matrix, those along the edge left out.

    Raises
    ------
    InputError
        If none shows the lamp, or most of its disc is saturated.
    """
    saturated = np.isnan(m00)
    known = np.where(saturated, 0.0, m00).astype(np.float32)
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


def lamp_matrix(
    mueller: NDArray[np.floating],
    variance: NDArray[np.floating],
    lamp: NDArray[np.bool_],
    turn: tuple[float, float],
) -> LampMatrix:
    """Average the matrices of the lamp's pixels.

    Parameters
    ----------
    mueller, variance : ndarray, shape (16, rows, columns)
        Elements and their variances between the modules' frames.
    lamp : ndarray, shape (rows, columns), bool
        The pixels to average.
    turn : tuple of float
        Angles about the beam from the modules' x axes, generator's and analyser's, to those wanted, radians.
    """
    angle_in, angle_out = turn
    pixels = mueller[:, lamp].T.astype(np.float64).reshape(-1, 4, 4)
    pixels = change_frames(pixels, angle_in, angle_out)
    count = len(pixels)
    sums = variance[:, lamp].sum(axis=1, dtype=np.float64).reshape(4, 4)
    error = np.sqrt(rotator(angle_out) ** 2 @ sums @ rotator(angle_in).T ** 2) / count
    mean = pixels.mean(axis=0)
    m00 = float(mean[0, 0])
    normalised = mean / m00
    # of a ratio, to first order; M00 over itself has none
    standard_error = np.hypot(error, normalised * error[0, 0]) / m00
    standard_error[0, 0] = 0.0
    scatter = (pixels / pixels[:, :1, :1]).std(axis=0, ddof=1)
    return LampMatrix(normalised, standard_error, scatter, m00, count)
