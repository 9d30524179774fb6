"""Where two edges of a chessboard cross, by a model of the picture around it.

Around an inner corner the picture is ``level + contrast · e(d₁) · e(d₂)``: d₁ and d₂ are distances from two
straight edges, e the step from −1 to 1 blurred by a Gaussian (an error function). A search for gradients
that stand upright on lines through the corner (OpenCV's ``cornerSubPix``) errs with the place of the corner
within its pixel; this fit is limited by noise.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

Float = NDArray[np.float64]

_ITERATIONS = 20
_CONVERGED_PX = 1e-5
_FIRST_BLUR_PX, _BLURS_PX = 1.0, (0.3, 5.0)
_ASTRAY_PX = 1.0
"""A fit that leaves its start by more follows something else than the corner: the start stays."""


def refine_saddles(image: NDArray[Any], corners: Float, edges: Float, half_px: int) -> Float:
    """Corners (N, 2), px, of a chessboard's squares.

    Parameters
    ----------
    image : ndarray, shape (rows, columns)
    corners : ndarray, shape (N, 2)
        Columns and rows to start from, right to a pixel; what cannot be fitted stays there.
    edges : ndarray, shape (N, 2)
        Directions of the two edges through each, radians from the columns' axis to the rows'.
    half_px : int
        Pixels on each side of a corner that take part; no other corner may lie in them.

    Notes
    -----
    Levenberg-Marquardt on seven parameters of each corner, all corners at once.
    """
    whole = np.rint(corners).astype(np.intp)
    inside = ((whole >= half_px) & (whole < np.array(image.shape[::-1]) - half_px)).all(axis=1)
    refined = corners.copy()
    if inside.any():
        start = corners[inside] - whole[inside]
        fitted = whole[inside] + _fitted(_Windows(image, whole[inside], half_px), start, edges[inside])
        near = np.hypot(*(fitted - corners[inside]).T) < _ASTRAY_PX
        refined[np.flatnonzero(inside)[near]] = fitted[near]
    return refined


class _Windows:
    """Pixels around corners: places (pixel,) from the middle and values (corner, pixel)."""

    def __init__(self, image: NDArray[Any], middles: NDArray[np.intp], half: int) -> None:
        y, x = (offset.ravel() for offset in np.mgrid[-half : half + 1, -half : half + 1])
        self.x, self.y = x.astype(np.float64), y.astype(np.float64)
        self.values = image[middles[:, 1:] + y, middles[:, :1] + x].astype(np.float64)

    def model(self, parameters: Float) -> tuple[Float, Float]:
        """Predicted values (corner, pixel), and derivatives (corner, pixel, 7) by the parameters."""
        column, row, first, second, level, contrast, blur = parameters.T[..., np.newaxis]
        x, y = self.x - column, self.y - row
        steps, slopes, distances, feet = [], [], [], []
        for angle in (first, second):
            distance = np.cos(angle) * y - np.sin(angle) * x
            steps.append(erf(distance / (np.sqrt(2) * blur)))
            slopes.append(np.sqrt(2 / np.pi) / blur * np.exp(-((distance / blur) ** 2) / 2))
            distances.append(distance)
            feet.append(np.cos(angle) * x + np.sin(angle) * y)
        by_first, by_second = contrast * slopes[0] * steps[1], contrast * steps[0] * slopes[1]
        product = steps[0] * steps[1]
        derivatives = [
            by_first * np.sin(first) + by_second * np.sin(second),
            -by_first * np.cos(first) - by_second * np.cos(second),
            -by_first * feet[0],
            -by_second * feet[1],
            np.ones_like(product),
            product,
            -(by_first * distances[0] + by_second * distances[1]) / blur,
        ]
        return level + contrast * product, np.stack(derivatives, -1)


def _fitted(windows: _Windows, start: Float, edges: Float) -> Float:
    """Places (N, 2) of the corners from their windows' middles."""
    values = windows.values
    low, high = values.min(axis=1), values.max(axis=1)
    blur = np.full(len(start), _FIRST_BLUR_PX)
    parameters = np.column_stack([start, edges, (low + high) / 2, (high - low) / 2, blur])
    # which of the squares are the bright ones
    predicted = windows.model(parameters)[0]
    alike = np.sum((predicted - parameters[:, 4:5]) * (values - parameters[:, 4:5]), axis=1)
    parameters[:, 5] *= np.where(alike < 0, -1.0, 1.0)
    damping = np.full(len(start), 1e-3)
    predicted, derivatives = windows.model(parameters)
    square = np.sum((values - predicted) ** 2, axis=1)
    for _ in range(_ITERATIONS):
        step = _step(derivatives, values - predicted, damping)
        tried = parameters + step
        tried[:, 6] = np.clip(tried[:, 6], *_BLURS_PX)
        tried_square = np.sum((values - windows.model(tried)[0]) ** 2, axis=1)
        better = tried_square < square
        parameters = np.where(better[:, np.newaxis], tried, parameters)
        square = np.where(better, tried_square, square)
        damping = np.where(better, damping / 10, damping * 10)
        if np.abs(step[:, :2]).max() < _CONVERGED_PX:
            break
        predicted, derivatives = windows.model(parameters)
    return parameters[:, :2]


def _step(derivatives: Float, residual: Float, damping: Float) -> Float:
    """Marquardt's steps (N, 7)."""
    squares = np.einsum("nik,nil->nkl", derivatives, derivatives)
    diagonal = np.einsum("nkk->nk", squares)
    # of a flat window nothing is told: no step
    squares[:, range(7), range(7)] += damping[:, np.newaxis] * diagonal + np.finfo(float).tiny
    slope = np.einsum("nik,ni->nk", derivatives, residual)
    solved: Float = (np.linalg.pinv(squares, hermitian=True) @ slope[..., np.newaxis])[..., 0]
    return solved
