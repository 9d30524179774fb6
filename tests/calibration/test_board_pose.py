"""Residuals of a board's corners are those that calibrated the camera."""

from __future__ import annotations

import numpy as np
import pytest

from pbrdf.calibration.board_pose import reprojection
from pbrdf.calibration.camera import Camera
from pbrdf.calibration.chessboard import Board, BoardView
from pbrdf.calibration.intrinsics import fit_camera
from pbrdf.optics.arm import turned

CAMERA = Camera((800.0, 805.0), (310.0, 250.0), 480, 640, (0.2, 0.05, -0.001, 0.002, 0.01))
BOARD = Board((9, 6), 20.0)


def view(name: str, tilt_deg: float, about: tuple[float, float, float], noise_px: float) -> BoardView:
    """A board at 500 mm, its corners as the camera projects them, with noise."""
    points = BOARD.points_mm().astype(np.float64)
    axes = np.stack([turned(axis, about, tilt_deg) for axis in np.eye(3)])
    placed = (points - points.mean(axis=0)) @ axes + (0.0, 0.0, 500.0)
    corners = np.stack(CAMERA.project(placed), -1)
    corners += np.random.default_rng(len(name)).normal(0.0, noise_px, corners.shape)
    return BoardView(name, BOARD.points_mm(), corners.astype(np.float32))


def test_without_noise_nothing_is_left() -> None:
    assert np.abs(reprojection(CAMERA, view("a", 25.0, (0.0, 1.0, 0.0), 0.0))).max() < 1e-3


def test_their_rms_is_that_of_the_calibration() -> None:
    tilts = [
        ((1.0, 0.0, 0.0), 30.0),
        ((0.0, 1.0, 0.0), -25.0),
        ((0.6, 0.8, 0.0), 35.0),
        ((0.8, -0.6, 0.0), 20.0),
    ]
    views = [view("v" * (n + 1), tilt, about, 0.1) for n, (about, tilt) in enumerate(tilts)]
    fit = fit_camera(views, (480, 640), "k1 k2 p1 p2 k3")
    for each, rms in zip(views, fit.view_rms_px, strict=True):
        residuals = reprojection(fit.camera, each)
        assert np.sqrt(np.mean(np.sum(residuals**2, axis=1))) == pytest.approx(rms, rel=1e-3)
