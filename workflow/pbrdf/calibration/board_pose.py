"""Where a board stood in a view, and how far its corners lie from where the camera puts them."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.chessboard import BoardView
from pbrdf.errors import InputError

Float = NDArray[np.float64]


def reprojection(camera: Camera, view: BoardView) -> Float:
    """Residuals of a view's corners at the board's most likely pose: found less projected (N, 2), px.

    Notes
    -----
    The pose is OpenCV's: a plane's homography, then Levenberg-Marquardt on the same distances that
    calibrate a camera.

    Raises
    ------
    InputError
        If no pose explains the view.
    """
    matrix = np.diag([*camera.focal_px, 1.0])
    matrix[:2, 2] = camera.principal_px
    points, corners = view.points_mm.astype(np.float64), view.corners_px.astype(np.float64)
    solved, rotation, translation = cv2.solvePnP(points, corners, matrix, np.array(camera.distortion))
    if not solved:
        raise InputError(view.name, "board", "has no pose", "calibrate the camera again")
    placed = points @ cv2.Rodrigues(rotation)[0].T + translation.ravel()
    residuals: Float = corners - np.stack(camera.project(placed), -1)
    return residuals
