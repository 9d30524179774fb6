"""OpenCV's own calibration set: its result with its settings, and a better one with ours."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.chessboard import Board, Refinement, find_views
from pbrdf.calibration.intrinsics import fit_camera, measure_camera
from pbrdf.formats.documents import write_document

BOARD = Board((9, 6), 25.0)
SHAPE = (480, 640)
THEIRS = Refinement(half_window_px=11, iterations=30, step_px=0.1, saddles=False)


@pytest.fixture(scope="module")
def images(real_data: Path) -> list[tuple[str, NDArray[np.uint8]]]:
    files = sorted((real_data / "chessboard").glob("left*.jpg"))
    return [(file.name, cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)) for file in files]


def test_with_the_files_own_settings_its_camera_comes_out(
    images: list[tuple[str, NDArray[np.uint8]]],
) -> None:
    views, without = find_views(images, BOARD, SHAPE, THEIRS)
    assert (len(views), without) == (13, [])
    fit = fit_camera(views, SHAPE, "k1 k2 p1 p2 k3", square_pixels=True)
    assert fit.camera.focal_px[0] == fit.camera.focal_px[1] == pytest.approx(535.9159, abs=0.05)
    assert fit.camera.principal_px == pytest.approx((342.2832, 235.5708), abs=0.05)
    assert fit.camera.distortion == pytest.approx(
        (-0.26637, -0.03859, 0.001783, -0.000281, 0.23839), abs=0.005
    )
    assert fit.rms_px == pytest.approx(0.39259, abs=0.001)
    theirs = [0.1930, 1.1820, 0.1732, 0.1934, 0.1596, 0.1797, 0.2310, 0.2420, 0.2963, 0.1672, 0.2020, 0.3810]
    assert fit.view_rms_px == pytest.approx([*theirs, 0.1744], abs=0.02)


def test_corners_that_stay_within_their_squares_are_better(
    images: list[tuple[str, NDArray[np.uint8]]], tmp_path: Path
) -> None:
    content = measure_camera(images, BOARD, SHAPE)
    assert content["rms_px"] < 0.165
    assert max(view["rms_px"] for view in content["per_view"].values()) < 0.22
    assert content["focal_px"] == pytest.approx([533.6, 533.7], abs=0.3)
    assert content["distortion_model"] == "k1 k2 p1 p2 k3"
    assert (content["boards_found"], content["boards_not_found"]) == (13, [])
    # no view shows the board in the left fifth of the frame
    assert content["verdict"].startswith("doubtful: corners lie in 46 % of the frame")
    write_document(tmp_path / "camera.json", "camera/1", content)
    assert Camera.read(tmp_path / "camera.json").focal_px == tuple(content["focal_px"])


def test_a_model_of_the_corner_is_better_than_its_gradients(
    images: list[tuple[str, NDArray[np.uint8]]],
) -> None:
    fitted, _ = find_views(images, BOARD, SHAPE)
    gradients, _ = find_views(images, BOARD, SHAPE, Refinement(saddles=False))
    rms = [fit_camera(views, SHAPE, "k1 k2 p1 p2").rms_px for views in (fitted, gradients)]
    assert rms[0] < 0.92 * rms[1] < 0.92 * 0.185


def test_the_larger_window_is_the_worse(images: list[tuple[str, NDArray[np.uint8]]]) -> None:
    """Within 11 px of a corner these views show the next square: the reason for a window a view."""
    views, _ = find_views(images, BOARD, SHAPE)
    wide, _ = find_views(images, BOARD, SHAPE, THEIRS)
    assert 2 * fit_camera(views, SHAPE, "k1 k2").rms_px < fit_camera(wide, SHAPE, "k1 k2").rms_px
