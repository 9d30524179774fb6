"""Boards of known size, and where an image shows their corners."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from pbrdf.calibration.one_thread import one_thread
from pbrdf.calibration.saddle import refine_saddles
from pbrdf.errors import InputError
from pbrdf.formats.documents import member, positive

Float = NDArray[np.float64]
KINDS = ("chessboard", "charuco")

# A window that reaches a neighbouring square pulls the corner away. On OpenCV's own 13 views the rms is
# 0.230 px with a half window of 3 px, 0.179 with 0.3 of the lowest square, and 0.243 with 0.4 of it.
_WINDOW_PER_SQUARE = 0.3
# nor may it reach the marker in a ChArUco board's white square, and its rim is blurred
_WINDOW_PER_RIM = 0.7
_SMALLEST_WINDOW_PX, _LARGEST_WINDOW_PX = 2, 15
# the finder is slow and gains nothing above this; the corners are refined in the whole image
_FINDER_SIZE_PX = 1600
# a board with fewer tells little more than where it stands
_FEWEST_CORNERS = 8


@dataclass(frozen=True)
class Board:
    """A chessboard, or a ChArUco board if `dictionary` is given.

    Attributes
    ----------
    corners : tuple of int
        Inner corners along and down, one less than squares.
    square_mm : float
        Side of a square.
    marker_mm : float
        Side of a marker; 0 for a chessboard.
    dictionary : str
        OpenCV's name of the markers, such as ``DICT_4X4_50``; empty for a chessboard.
    """

    corners: tuple[int, int]
    square_mm: float
    marker_mm: float = 0.0
    dictionary: str = ""

    @classmethod
    def described(cls, source: str | Path, content: Mapping[str, Any]) -> Board:
        """Board of a description: ``kind``, ``corners``, ``square_mm``; a ChArUco's two more.

        Raises
        ------
        InputError
            If a value is missing or no board has it.
        """
        kind = member(source, content, "kind")
        if kind not in KINDS:
            raise InputError(source, "kind", f"is {kind!r}", f"write one of {', '.join(KINDS)}")
        corners = member(source, content, "corners")
        if (
            not isinstance(corners, list)
            or len(corners) != 2
            or not all(type(c) is int and c >= 3 for c in corners)
        ):
            raise InputError(
                source, "corners", f"is {corners!r}", "give two whole numbers from 3 of inner corners"
            )
        square_mm = positive(source, content, "square_mm")
        if kind == "chessboard":
            return cls((corners[0], corners[1]), square_mm)
        marker_mm = positive(source, content, "marker_mm")
        if marker_mm >= square_mm:
            problem = f"is {marker_mm:g} in squares of {square_mm:g}"
            raise InputError(source, "marker_mm", problem, "give the side of the black marker")
        dictionary = member(source, content, "dictionary")
        names = [name for name in dir(cv2.aruco) if name.startswith("DICT_")]
        if dictionary not in names:
            raise InputError(source, "dictionary", f"is {dictionary!r}", "write OpenCV's name of it")
        board = cls((corners[0], corners[1]), square_mm, marker_mm, dictionary)
        markers = (corners[0] + 1) * (corners[1] + 1) // 2
        available = len(board.dictionary_markers().bytesList)
        if markers > available:
            problem = f"has {available} markers where the board shows {markers}"
            raise InputError(source, "dictionary", problem, "correct `corners` or the name")
        return board

    def points_mm(self) -> NDArray[np.float32]:
        """Corners (N, 3) on the board, row by row."""
        columns, rows = np.meshgrid(np.arange(self.corners[0]), np.arange(self.corners[1]))
        points = np.stack([columns.ravel(), rows.ravel(), np.zeros(columns.size)], -1)
        return (self.square_mm * points).astype(np.float32)

    def dictionary_markers(self) -> Any:
        """OpenCV's object of the markers."""
        return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, self.dictionary))

    def charuco(self) -> Any:
        """OpenCV's object of the whole board."""
        squares = (self.corners[0] + 1, self.corners[1] + 1)
        return cv2.aruco.CharucoBoard(squares, self.square_mm, self.marker_mm, self.dictionary_markers())


@dataclass(frozen=True)
class Refinement:
    """How corners are refined: OpenCV's ``cornerSubPix``, then the fit of `pbrdf.calibration.saddle`.

    Attributes
    ----------
    half_window_px : int or None
        None takes `_WINDOW_PER_SQUARE` of the smallest square in the view, and stays off the markers.
    iterations : int
    step_px : float
        OpenCV's refinement of a corner stops at a step smaller than this.
    saddles : bool
        Whether the fit follows.
    """

    half_window_px: int | None = None
    iterations: int = 100
    step_px: float = 1e-4
    saddles: bool = True


FINE = Refinement()


@dataclass(frozen=True)
class BoardView:
    """What one image shows of the board: corners on it (N, 3), mm, and in the image (N, 2), px."""

    name: str
    points_mm: NDArray[np.float32]
    corners_px: NDArray[np.float32]


def find_views(
    images: Iterable[tuple[str, NDArray[Any]]],
    board: Board,
    shape: tuple[int, int],
    refinement: Refinement = FINE,
) -> tuple[list[BoardView], list[str]]:
    """Views in which the board was found, and the names of those in which it was not.

    Parameters
    ----------
    images : iterable of (name, image)
        One channel each, of any real dtype.
    board : Board
    shape : tuple of int
        Rows and columns that every image must have.
    refinement : Refinement

    Raises
    ------
    InputError
        If an image has another size or more channels.
    """
    views, without = [], []
    for name, image in images:
        if image.shape != shape:
            problem = f"has shape {image.shape} where the camera's is {shape}"
            raise InputError(name, "image", problem, "give single-channel images of one camera")
        view = find_view(name, image, board, refinement)
        if view is None:
            without.append(name)
        else:
            views.append(view)
    return views, without


@one_thread()
def find_view(
    name: str, image: NDArray[Any], board: Board, refinement: Refinement = FINE
) -> BoardView | None:
    """Corners of the board in one image (rows, columns), or None if it is not found there."""
    grey = _eight_bits(image)
    ids, corners = _charuco_corners(grey, board) if board.dictionary else _chessboard_corners(grey, board)
    if len(ids) < _FEWEST_CORNERS or min(np.ptp(ids // board.corners[0]), np.ptp(ids % board.corners[0])) < 1:
        return None
    half = refinement.half_window_px or _half_window(ids, corners, board)
    stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, refinement.iterations, refinement.step_px)
    start = corners.astype(np.float32).reshape(-1, 1, 2)
    refined = np.asarray(cv2.cornerSubPix(grey, start, (half, half), (-1, -1), stop), np.float64)
    refined = refined.reshape(-1, 2)
    points = board.points_mm()[ids]
    if refinement.saddles:
        refined = refine_saddles(image, refined, _edge_directions(points, refined), half)
    return BoardView(name, points, refined.astype(np.float32))


def _chessboard_corners(grey: NDArray[np.uint8], board: Board) -> tuple[NDArray[np.intp], Float]:
    shrink = max(1.0, max(grey.shape) / _FINDER_SIZE_PX)
    size = (round(grey.shape[1] / shrink), round(grey.shape[0] / shrink))
    small = cv2.resize(grey, size, interpolation=cv2.INTER_AREA)
    flags = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY
    found, places = cv2.findChessboardCornersSB(small, board.corners, flags=flags)
    if not found:
        return np.empty(0, np.intp), np.empty((0, 2))
    scale = np.array(grey.shape[::-1]) / np.array(small.shape[::-1])
    # the first pixel's centre is (0, 0) in both images
    corners = (places.reshape(-1, 2).astype(np.float64) + 0.5) * scale - 0.5
    return np.arange(len(corners)), corners


def _charuco_corners(grey: NDArray[np.uint8], board: Board) -> tuple[NDArray[np.intp], Float]:
    corners, ids, _, _ = cv2.aruco.CharucoDetector(board.charuco()).detectBoard(grey)
    if ids is None:
        return np.empty(0, np.intp), np.empty((0, 2))
    return ids.ravel().astype(np.intp), corners.reshape(-1, 2).astype(np.float64)


def _half_window(ids: NDArray[np.intp], corners: Float, board: Board) -> int:
    """Half window, px, that reaches neither the next corner nor a marker anywhere in the view."""
    grid = np.full((board.corners[1], board.corners[0], 2), np.nan)
    grid[ids // board.corners[0], ids % board.corners[0]] = corners
    along, down = np.diff(grid, axis=1)[:-1], np.diff(grid, axis=0)[:, :-1]
    area = np.abs(along[..., 0] * down[..., 1] - along[..., 1] * down[..., 0])
    heights = area / np.maximum(np.linalg.norm(along, axis=-1), np.linalg.norm(down, axis=-1))
    if not np.isfinite(heights).any():
        return _SMALLEST_WINDOW_PX
    share = _WINDOW_PER_SQUARE
    if board.dictionary:
        share = min(share, _WINDOW_PER_RIM * (1 - board.marker_mm / board.square_mm) / 2)
    return int(np.clip(np.rint(share * np.nanmin(heights)), _SMALLEST_WINDOW_PX, _LARGEST_WINDOW_PX))


def _edge_directions(points_mm: NDArray[np.float32], corners: Float) -> Float:
    """Directions (N, 2) in the image of the board's two axes at each corner, radians."""
    homography = cv2.findHomography(points_mm[:, :2], corners.astype(np.float32))[0]
    seen = np.append(points_mm[:, :2], np.ones((len(points_mm), 1)), axis=1) @ homography.T
    # derivative of a quotient, up to a positive factor
    along = homography[:2, :2].T - seen[:, np.newaxis, :2] / seen[:, 2, None, None] * homography[2, :2, None]
    directions: Float = np.arctan2(along[..., 1], along[..., 0])
    return directions


def _eight_bits(image: NDArray[Any]) -> NDArray[np.uint8]:
    """The image as OpenCV's finders take it: eight bits, from its darkest to its brightest level."""
    if image.dtype == np.uint8:
        return image.astype(np.uint8, copy=False)
    low, high = np.percentile(image, (0.5, 99.5))
    scaled = 255.0 * (image.astype(np.float64) - low) / max(high - low, 1e-300)
    grey: NDArray[np.uint8] = np.clip(np.rint(scaled), 0, 255).astype(np.uint8)
    return grey
