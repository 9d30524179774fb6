"""The matrix that the pixels of the lamp's own disc agree on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pbrdf.optics.frames import change_frames
from pbrdf.optics.mueller import rotator

Float = NDArray[np.float64]


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
