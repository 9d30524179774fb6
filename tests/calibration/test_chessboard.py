"""Boards drawn through a known camera: found where they are, and the camera found again."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.chessboard import Board, BoardView, find_view, find_views
from pbrdf.calibration.intrinsics import LENS_MODELS, fit_camera, measure_camera
from pbrdf.errors import InputError
from pbrdf.formats.documents import write_document

CAMERA = Camera((812.0, 809.0), (317.4, 243.8), 480, 640, (-0.21, 0.09, 0.0012, -0.0008, 0.0))
PLAIN = Board((9, 6), 25.0)
CHARUCO = Board((9, 6), 25.0, 18.0, "DICT_4X4_50")
BOARDS = pytest.mark.parametrize("board", [PLAIN, CHARUCO], ids=["chessboard", "charuco"])
Image = NDArray[Any]


def _pattern(board: Board, square_px: int) -> NDArray[np.float32]:
    """The board from above, squares of `square_px`, with a white rim of one square."""
    across, down = board.corners[0] + 1, board.corners[1] + 1
    if board.dictionary:
        drawn = board.charuco().generateImage((across * square_px, down * square_px))
    else:
        dark = np.add.outer(np.arange(down), np.arange(across)) % 2 == 0
        drawn = np.kron(np.where(dark, 0, 255), np.ones((square_px, square_px)))
    return np.pad(drawn.astype(np.float32), square_px, constant_values=255)


@functools.cache
def _fine_rays() -> NDArray[np.float64]:
    """Rays of the camera, 9 a pixel."""
    samples = 3
    offsets = (np.arange(samples) - (samples - 1) / 2) / samples
    columns, rows = np.meshgrid(
        (np.arange(CAMERA.columns)[:, None] + offsets).ravel(),
        (np.arange(CAMERA.rows)[:, None] + offsets).ravel(),
    )
    return CAMERA.rays(columns, rows)


def _draw(board: Board, turn: Sequence[float], centre: Sequence[float], seed: int = 0) -> NDArray[np.uint8]:
    """Image of a board whose middle lies at `centre`, turned by the rotation vector `turn`."""
    square_px = 40
    rotation = cv2.Rodrigues(np.array(turn, np.float64))[0]
    middle = board.square_mm * (np.array(board.corners) - 1) / 2
    origin = np.array(centre) - rotation @ [*middle, 0.0]
    rays = _fine_rays()
    along = (rotation[:, 2] @ origin) / (rays @ rotation[:, 2])
    onto = ((rays * along[..., None] - origin) @ rotation)[..., :2] / board.square_mm
    # the first corner is two squares from the picture's edge: the rim and a square
    place = ((onto + 2) * square_px - 0.5).astype(np.float32)
    fine = cv2.remap(
        _pattern(board, square_px), place[..., 0], place[..., 1], cv2.INTER_LINEAR, borderValue=140.0
    )
    image = cv2.resize(fine, (CAMERA.columns, CAMERA.rows), interpolation=cv2.INTER_AREA)
    noisy = 20 + 0.8 * image + np.random.default_rng(seed).normal(0, 2, image.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def _poses(seed: int, tilt: float) -> list[tuple[list[float], list[float]]]:
    """Boards about the frame, tilted this way and that by up to `tilt` radians."""
    random = np.random.default_rng(seed)
    poses = []
    for index in range(12):
        azimuth = 2.4 * index
        turn = [tilt * np.cos(azimuth), tilt * np.sin(azimuth), random.normal(0, 0.2)]
        centre = [70 * np.cos(1.7 * index), 45 * np.sin(1.7 * index), random.uniform(420, 560)]
        poses.append((turn, centre))
    return poses


@functools.cache
def _images(board: Board, seed: int = 1, tilt: float = 0.5) -> list[tuple[str, Image]]:
    return [
        (f"view{index:02d}", _draw(board, *pose, seed=100 * seed + index))
        for index, pose in enumerate(_poses(seed, tilt))
    ]


@pytest.fixture(scope="module")
def plain_images() -> list[tuple[str, Image]]:
    return _images(PLAIN)


@BOARDS
def test_corners_are_found_where_the_camera_sees_them(board: Board) -> None:
    turn, centre = [0.3, -0.4, 0.2], [12.0, -8.0, 470.0]
    view = find_view("a", _draw(board, turn, centre), board)
    assert view is not None
    rotation = cv2.Rodrigues(np.array(turn))[0]
    middle = board.square_mm * np.array([*(np.array(board.corners) - 1), 0]) / 2
    expected = np.stack(CAMERA.project((board.points_mm() - middle) @ rotation.T + centre), -1)
    # a chessboard may be told from either end
    known = expected if board.dictionary else min(expected, expected[::-1], key=_off(view.corners_px))
    assert len(view.corners_px) == 54
    off = np.linalg.norm(view.corners_px - known, axis=1)
    assert np.sqrt(np.mean(off**2)) < 0.05
    assert off.max() < 0.15


def _off(corners: NDArray[np.float32]) -> Any:
    return lambda expected: np.abs(corners - expected).max()


@BOARDS
def test_the_camera_comes_back_within_its_standard_errors(board: Board) -> None:
    content = measure_camera(_images(board), board, (480, 640))
    errors = content["standard_errors"]
    for name in ("focal_px", "principal_px"):
        off = np.subtract(content[name], getattr(CAMERA, name)) / errors[name]
        assert np.abs(off).max() < 3.5, (name, off)
    assert max(errors["focal_px"]) < 0.5
    assert content["rms_px"] < 0.07
    assert content["distortion_model"] == "k1 k2 p1 p2"
    free = np.array(errors["distortion"]) > 0
    off = (np.array(content["distortion"]) - CAMERA.distortion)[free] / np.array(errors["distortion"])[free]
    assert np.abs(off).max() < 3.5
    assert content["verdict"] == "good"


def test_standard_errors_tell_the_truth() -> None:
    """Corners drawn with known noise: the camera strays by what the fit says of itself."""
    turns = _poses(3, 0.5)
    points = PLAIN.points_mm()
    strays = []
    for seed in range(40):
        random = np.random.default_rng(seed)
        views = []
        for index, (turn, centre) in enumerate(turns):
            rotation = cv2.Rodrigues(np.array(turn))[0]
            places = np.stack(CAMERA.project((points - [100, 62.5, 0]) @ rotation.T + centre), -1)
            noisy = (places + random.normal(0, 0.1, places.shape)).astype(np.float32)
            views.append(BoardView(f"{index}", points, noisy))
        fit = fit_camera(views, (480, 640), "k1 k2 p1 p2")
        found = [*fit.camera.focal_px, *fit.camera.principal_px, *fit.camera.distortion[:4]]
        true = [*CAMERA.focal_px, *CAMERA.principal_px, *CAMERA.distortion[:4]]
        strays.append(np.subtract(found, true) / fit.standard_errors[:8])
    # 40 trials fix a standard deviation to 11 %
    assert np.std(strays, axis=0) == pytest.approx(np.ones(8), abs=0.4)
    assert np.std(strays) == pytest.approx(1, abs=0.15)


def test_part_of_a_charuco_board_is_enough() -> None:
    image = _draw(CHARUCO, [0.2, 0.3, 0.0], [0.0, 0.0, 450.0])
    image[:, :300] = 90
    view = find_view("cut", image, CHARUCO)
    assert view is not None
    assert 8 <= len(view.corners_px) < 40
    assert view.corners_px[:, 0].min() > 300


def test_sixteen_bits_show_what_eight_do() -> None:
    image = _draw(PLAIN, [0.3, -0.4, 0.2], [12.0, -8.0, 470.0])
    eight = find_view("8", image, PLAIN)
    sixteen = find_view("16", image.astype(np.uint16) * 40 + 1000, PLAIN)
    assert eight is not None
    assert sixteen is not None
    assert np.abs(eight.corners_px - sixteen.corners_px).max() < 0.03


def test_the_document_names_views_without_a_board(
    plain_images: list[tuple[str, Image]], tmp_path: Path
) -> None:
    empty = np.random.default_rng(0).integers(0, 255, (480, 640)).astype(np.uint8)
    content = measure_camera([*plain_images[:9], ("empty", empty)], PLAIN, (480, 640))
    assert content["boards_found"] == 9
    assert content["boards_not_found"] == ["empty"]
    assert list(content["per_view"]) == [name for name, _ in plain_images[:9]]
    assert all(20 < view["tilt_deg"] < 40 for view in content["per_view"].values())
    assert set(content["models"]) == set(LENS_MODELS)
    write_document(tmp_path / "camera.json", "camera/1", content)
    camera = Camera.read(tmp_path / "camera.json")
    assert camera.focal_px == tuple(content["focal_px"])
    assert camera.distortion == tuple(content["distortion"])


def test_few_views_make_the_result_doubtful(plain_images: list[tuple[str, Image]]) -> None:
    content = measure_camera(plain_images[:4], PLAIN, (480, 640))
    assert "only 4 views show the board, 8 are enough" in content["verdict"]
    assert content["verdict"].startswith("doubtful: ")


def test_boards_that_all_lie_alike_are_doubtful_or_refused() -> None:
    """Seen square-on, a board farther away through a longer lens looks the same.

    The fit itself says 726 ± 0.04 px there where 812 px is true.
    """
    with pytest.raises(InputError, match="tilt the board differently in each image"):
        measure_camera(_images(PLAIN, tilt=0.0)[:5], PLAIN, (480, 640))
    content = measure_camera(_images(PLAIN, tilt=0.1), PLAIN, (480, 640))
    assert "tilts differ by" in content["verdict"]
    assert "the focal length is uncertain" in content["verdict"]


def test_a_view_that_fits_badly_is_named(plain_images: list[tuple[str, Image]]) -> None:
    """A board bent, or moved while the shutter was open."""
    bent = cv2.GaussianBlur(plain_images[3][1], (0, 0), 1.0)
    rows, columns = np.mgrid[:480, :640].astype(np.float32)
    bent = cv2.remap(bent, columns + 2 * np.sin(rows / 40), rows, cv2.INTER_LINEAR)
    images = [*plain_images[:3], ("bent", bent), *plain_images[4:]]
    assert "fit worse than the others: bent" in measure_camera(images, PLAIN, (480, 640))["verdict"]


def test_a_board_never_found_is_refused() -> None:
    empty = [(f"{seed}", np.full((480, 640), 90 + seed, np.uint8)) for seed in range(5)]
    with pytest.raises(InputError, match="board: is found in 0 of 5 images"):
        measure_camera(empty, PLAIN, (480, 640))


def test_the_wrong_board_is_refused(plain_images: list[tuple[str, Image]]) -> None:
    with pytest.raises(InputError, match=r"board: is found in \d of 4 images"):
        measure_camera(plain_images[:4], Board((8, 7), 25.0), (480, 640))


@pytest.mark.parametrize("shape", [(480, 641), (640, 480), (480, 640, 3)])
def test_an_image_of_another_size_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(InputError, match=r"odd\.png: image: has shape"):
        find_views([("odd.png", np.zeros(shape, np.uint8))], PLAIN, (480, 640))


PLAIN_TEXT = {"kind": "chessboard", "corners": [9, 6], "square_mm": 25}
CHARUCO_TEXT = PLAIN_TEXT | {"kind": "charuco", "marker_mm": 18, "dictionary": "DICT_4X4_50"}


def test_a_board_is_read_from_its_description() -> None:
    assert Board.described("config.yaml", PLAIN_TEXT) == PLAIN
    assert Board.described("config.yaml", CHARUCO_TEXT) == CHARUCO


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("kind", "circles"),
        ("corners", 9),
        ("corners", [9, 6, 3]),
        ("corners", [9, 2]),
        ("corners", [9, 6.5]),
        ("corners", [True, 6]),
        ("square_mm", 0),
        ("square_mm", "25 mm"),
        ("marker_mm", 25),
        ("marker_mm", -1),
        ("dictionary", "4x4"),
        ("dictionary", ["DICT_4X4_50"]),
    ],
)
def test_what_no_board_has_is_named(field: str, value: object) -> None:
    with pytest.raises(InputError) as refused:
        Board.described("config.yaml", CHARUCO_TEXT | {field: value})
    assert (refused.value.source, refused.value.field) == ("config.yaml", field)


@pytest.mark.parametrize("field", CHARUCO_TEXT)
def test_a_missing_field_of_a_board_is_named(field: str) -> None:
    with pytest.raises(InputError, match=f"{field}: is missing"):
        Board.described("config.yaml", {k: v for k, v in CHARUCO_TEXT.items() if k != field})


def test_more_squares_than_markers_are_refused() -> None:
    with pytest.raises(InputError, match="has 50 markers where the board shows 99"):
        Board.described("config.yaml", CHARUCO_TEXT | {"corners": [17, 10]})


def test_the_same_views_give_the_same_bits(plain_images: list[tuple[str, Image]]) -> None:
    threads = cv2.getNumThreads()
    cv2.setNumThreads(4)
    found = [measure_camera(plain_images, PLAIN, (480, 640)) for _ in range(4)]
    assert cv2.getNumThreads() == 4
    cv2.setNumThreads(threads)
    assert all(each == found[0] for each in found)
