"""A chessboard in many poses, against the finder of corners and the pinhole's projection."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pbrdf.calibration.chessboard import Board, find_view
from pbrdf.calibration.intrinsics import measure_camera
from pbrdf.instruments.interface import Setting
from pbrdf.instruments.virtual_board import LEAST_TILT_DEG, MOST_TILT_DEG, VirtualBoard
from pbrdf.instruments.virtual_rig import VirtualRig
from pbrdf.settings.rig import read_rig
from pbrdf.settings.targets import AMBIENT

SOURCE = Path(__file__).resolve().parents[2] / "config/rig/virtual.yaml"
BOARD: dict[str, Any] = {"corners": [9, 7], "square_mm": 5.0}
VIEWS = range(1, 13)


@pytest.fixture
def settings() -> dict[str, Any]:
    rig = deepcopy(dict(read_rig(SOURCE)))
    del rig["hot_pixels"]
    return rig


def projected(settings: dict[str, Any], board: VirtualBoard, squares: Any) -> Any:
    """Places in the image of points on the board, given in squares from its first inner corner."""
    flat = np.asarray(squares, dtype=np.float64) * BOARD["square_mm"]
    points = flat @ board.rotation[:, :2].T + board.origin_mm
    return 3200 * points[..., :2] / points[..., 2:] + settings["camera"]["principal_px"]


@pytest.mark.parametrize("view", VIEWS)
def test_every_view_shows_the_board_where_the_pinhole_projects_it(
    settings: dict[str, Any], view: int
) -> None:
    board = VirtualBoard(settings, BOARD, view)
    frame = VirtualRig(settings, board).expose("a", Setting(AMBIENT, 550, (0.0, 0.0, 0.0, 90.0), 0.08, 0))
    seen = find_view("a", frame, Board((9, 7), 5.0))
    assert seen is not None
    expected = projected(settings, board, seen.points_mm[:, :2] / 5.0)
    # a board of 9 by 7 corners looks the same upside down
    errors = min((seen.corners_px - places for places in (expected, expected[::-1])), key=np.std)
    assert np.abs(errors).max() < 0.2
    assert np.sqrt(np.mean(errors**2)) < 0.03
    assert np.abs(errors.mean(axis=0)).max() < 0.01


def test_boards_lie_within_the_frame_and_tilt_to_all_sides(settings: dict[str, Any]) -> None:
    boards = [VirtualBoard(settings, BOARD, view) for view in VIEWS]
    for board in boards:
        np.testing.assert_allclose(board.rotation @ board.rotation.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(board.rotation) == pytest.approx(1.0)
        rim = projected(settings, board, [(-1.5, -1.5), (-1.5, 7.5), (9.5, -1.5), (9.5, 7.5)])
        assert rim.min() > -0.5
        assert rim.max() < 191.5
        assert np.ptp(rim, axis=0).max() > 0.9 * 192
    normals = np.array([board.rotation[:, 2] for board in boards])
    tilts = np.degrees(np.arccos(normals[:, 2]))
    # the lines of sight to the boards' middles differ by half a degree
    assert LEAST_TILT_DEG - 1 <= tilts.min() < tilts.max() <= MOST_TILT_DEG + 1
    sides = np.sort(np.arctan2(normals[:, 1], normals[:, 0]))
    assert np.diff([*sides, sides[0] + 2 * np.pi]).max() < np.deg2rad(75)


def test_a_dozen_boards_tell_the_camera_to_a_thousandth_and_leave_no_doubt(
    settings: dict[str, Any],
) -> None:
    images = []
    for view in VIEWS:
        rig = VirtualRig(settings, VirtualBoard(settings, BOARD, view))
        images.append((f"{view}", rig.expose("a", Setting(AMBIENT, 550, (0.0, 0.0, 0.0, 90.0), 0.08, 0))))
    content = measure_camera(images, Board((9, 7), 5.0), (192, 192))
    assert content["verdict"] == "good"
    assert content["covered"] > 0.52
    errors = content["standard_errors"]
    assert max(errors["focal_px"]) < 0.002 * 3200
    off = np.subtract(content["focal_px"] + content["principal_px"], [3200, 3200, 95.2, 96.1])
    assert np.abs(off / (errors["focal_px"] + errors["principal_px"])).max() < 3


@pytest.mark.parametrize("focal_share", [0.4, 1.0, 3.0, 60.0])
@pytest.mark.parametrize("shape", [(192, 192), (2048, 2448), (300, 1200)])
@pytest.mark.parametrize("principal", [(0.5, 0.5), (0.1, 0.7), (1.5, -0.5)])
def test_boards_face_every_camera_within_its_frame(
    settings: dict[str, Any], focal_share: float, shape: tuple[int, int], principal: tuple[float, float]
) -> None:
    size = np.array(shape[::-1])
    camera = settings["camera"]
    camera |= {"rows": shape[0], "columns": shape[1], "focal_px": focal_share * float(size.min())}
    camera["principal_px"] = (size * principal).tolist()
    corners = np.array([(-1.5, -1.5), (-1.5, 7.5), (9.5, -1.5), (9.5, 7.5)]) * BOARD["square_mm"]
    for view in VIEWS:
        board = VirtualBoard(settings, BOARD, view)
        rim = corners @ board.rotation[:, :2].T + board.origin_mm
        assert rim[:, 2].min() > 0
        # the camera looks at the board's front, not along it
        sights = rim / np.linalg.norm(rim, axis=1, keepdims=True)
        assert (sights @ board.rotation[:, 2]).min() > 0.1
        seen = camera["focal_px"] * rim[:, :2] / rim[:, 2:] + camera["principal_px"]
        assert (seen > -0.5).all()
        assert (seen < size - 0.5).all()


def test_a_pose_is_of_seed_and_view_alone(settings: dict[str, Any]) -> None:
    truth = VirtualBoard(settings, BOARD, 3).truth
    assert VirtualBoard(deepcopy(settings), {**BOARD, "views": 40}, 3).truth == truth
    assert VirtualBoard(settings | {"seed": 7}, BOARD, 3).truth != truth
    assert VirtualBoard(settings, BOARD, 4).truth != truth
