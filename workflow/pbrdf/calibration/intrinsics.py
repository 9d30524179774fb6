"""Intrinsics and lens distortion of a camera from views of a board."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.chessboard import FINE, Board, BoardView, Refinement, find_views
from pbrdf.calibration.lens import Coefficients
from pbrdf.calibration.one_thread import one_thread
from pbrdf.errors import InputError

Float = NDArray[np.float64]

_NO_TANGENTIAL = cv2.CALIB_ZERO_TANGENT_DIST
LENS_MODELS: dict[str, int] = {
    "pinhole": cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3 | _NO_TANGENTIAL,
    "k1": cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3 | _NO_TANGENTIAL,
    "k1 k2": cv2.CALIB_FIX_K3 | _NO_TANGENTIAL,
    "k1 k2 p1 p2": cv2.CALIB_FIX_K3,
    "k1 k2 p1 p2 k3": 0,
}
"""Lens models, each a case of the next, and OpenCV's flags of them."""

FEWEST_VIEWS = 3
ENOUGH_VIEWS = 8
# parallel boards, however many, leave the focal length open, and its standard error is then no measure of it
NO_SPREAD_DEG, LEAST_SPREAD_DEG = 5.0, 20.0
WORST_FOCAL, DOUBTFUL_FOCAL = 0.05, 0.005
LEAST_COVERED = 0.5
ODD_VIEW = 3.0
DOUBTFUL_RMS_PX = 1.0
_TILT = "tilt the board differently in each image, by 20° and more"


@dataclass(frozen=True)
class CameraFit:
    """A camera and how well the views agree on it.

    Attributes
    ----------
    camera : Camera
    model : str
        A key of `LENS_MODELS`.
    standard_errors : tuple of float
        Of fx, fy, cx, cy, k1, k2, p1, p2, k3, in their units; 0 for what the model fixes.
    rms_px : float
        Root mean square distance of a corner from its projection.
    view_rms_px : tuple of float
    normals : ndarray
        Normals (view, 3) of the boards in the camera's frame.
    bic : float
        Bayesian information criterion; the lowest of several models is the one that the data support.
    """

    camera: Camera
    model: str
    standard_errors: tuple[float, ...]
    rms_px: float
    view_rms_px: tuple[float, ...]
    normals: Float
    bic: float


def measure_camera(
    images: Iterable[tuple[str, NDArray[Any]]],
    board: Board,
    shape: tuple[int, int],
    refinement: Refinement = FINE,
) -> dict[str, Any]:
    """Content of ``camera.json`` from images of a board.

    Parameters
    ----------
    images : iterable of (name, image)
        One channel each.
    board : Board
    shape : tuple of int
        Rows and columns of the camera.
    refinement : Refinement

    Raises
    ------
    InputError
        If an image has another size, fewer than `FEWEST_VIEWS` show the board, all show it at the same
        tilt to `NO_SPREAD_DEG`, or the focal length's standard error exceeds `WORST_FOCAL` of it.
    """
    views, without = find_views(images, board, shape, refinement)
    if len(views) < FEWEST_VIEWS:
        problem = f"is found in {len(views)} of {len(views) + len(without)} images"
        remedy = f"show the whole board, as described, in {ENOUGH_VIEWS} or more at different tilts"
        raise InputError("chessboard images", "board", problem, remedy)
    fits = {model: fit_camera(views, shape, model) for model in LENS_MODELS}
    sound = [fit for fit in fits.values() if fit.camera.sees_through_every_pixel()]
    best = min(sound, key=lambda fit: fit.bic)
    if _spread_deg(best.normals) < NO_SPREAD_DEG:
        raise InputError("chessboard images", "board", "has the same tilt in every image", _TILT)
    if not _focal_error(best) < WORST_FOCAL:
        problem = f"is known to {100 * _focal_error(best):.0f} % only"
        raise InputError("chessboard images", "focal_px", problem, _TILT)
    return _content(best, fits, views, without)


@one_thread()
def fit_camera(
    views: Sequence[BoardView], shape: tuple[int, int], model: str, square_pixels: bool = False
) -> CameraFit:
    """Camera that projects the corners of all views best.

    Parameters
    ----------
    views : sequence of BoardView
    shape : tuple of int
        Rows and columns of the camera.
    model : str
        A key of `LENS_MODELS`.
    square_pixels : bool
        Whether both focal lengths are the same.

    Raises
    ------
    InputError
        If no camera explains the views.

    Notes
    -----
    Zhang's method (IEEE PAMI 22(11), 2000) as OpenCV has it. Its standard errors take the corners'
    errors as independent and alike.
    """
    flags = LENS_MODELS[model] | (cv2.CALIB_FIX_ASPECT_RATIO if square_pixels else 0)
    try:
        found = cv2.calibrateCameraExtended(
            [view.points_mm for view in views],
            [view.corners_px for view in views],
            shape[::-1],
            np.eye(3),
            np.zeros(5),
            flags=flags,
        )
    except cv2.error:
        raise _no_camera() from None
    rms, matrix, lens, rotations, _, errors, _, view_rms = found
    k1, k2, p1, p2, k3 = (float(c) for c in lens.ravel()[:5])
    if not (
        np.isfinite([rms, *matrix.ravel(), k1, k2, p1, p2, k3]).all() and matrix[0, 0] > 0 < matrix[1, 1]
    ):
        raise _no_camera()
    distortion: Coefficients = (k1, k2, p1, p2, k3)
    camera = Camera(
        (float(matrix[0, 0]), float(matrix[1, 1])),
        (float(matrix[0, 2]), float(matrix[1, 2])),
        *shape,
        distortion,
    )
    standard_errors = [float(e) for e in errors.ravel()[:9]]
    if square_pixels:
        # OpenCV gives no error for the length that follows the other
        standard_errors[0] = standard_errors[1]
    corners = sum(len(view.points_mm) for view in views)
    free = np.count_nonzero(standard_errors) - square_pixels + 6 * len(views)
    bic = 2 * corners * np.log(rms**2 / 2) + free * np.log(2 * corners)
    normals = np.array([cv2.Rodrigues(rotation)[0][:, 2] for rotation in rotations])
    return CameraFit(
        camera,
        model,
        tuple(standard_errors),
        float(rms),
        tuple(float(r) for r in view_rms.ravel()),
        normals,
        float(bic),
    )


def _no_camera() -> InputError:
    return InputError("chessboard images", "board", "no camera explains the views", _TILT)


def _focal_error(fit: CameraFit) -> float:
    """The larger of the relative standard errors of the focal lengths."""
    return float(np.max(np.array(fit.standard_errors[:2]) / fit.camera.focal_px))


def _content(
    best: CameraFit, fits: Mapping[str, CameraFit], views: Sequence[BoardView], without: Sequence[str]
) -> dict[str, Any]:
    camera, errors = best.camera, best.standard_errors
    return {
        "source": "measured",
        "focal_px": list(camera.focal_px),
        "principal_px": list(camera.principal_px),
        "rows": camera.rows,
        "columns": camera.columns,
        "distortion": list(camera.distortion),
        "distortion_model": best.model,
        "standard_errors": {
            "focal_px": list(errors[:2]),
            "principal_px": list(errors[2:4]),
            "distortion": list(errors[4:]),
        },
        "rms_px": best.rms_px,
        "per_view": {
            view.name: {"rms_px": rms, "corners": len(view.points_mm), "tilt_deg": _tilt_deg(normal)}
            for view, rms, normal in zip(views, best.view_rms_px, best.normals, strict=True)
        },
        "models": {name: {"rms_px": fit.rms_px, "bic": fit.bic} for name, fit in fits.items()},
        "models_differ_px": _models_differ_px(best, fits),
        "boards_found": len(views),
        "boards_not_found": list(without),
        "covered": _covered(views, camera),
        "verdict": _verdict(best, fits, views, without),
    }


def _verdict(
    fit: CameraFit, fits: Mapping[str, CameraFit], views: Sequence[BoardView], without: Sequence[str]
) -> str:
    """``good``, or ``doubtful`` and why."""
    doubts = []
    if len(views) < ENOUGH_VIEWS:
        doubts.append(f"only {len(views)} views show the board, {ENOUGH_VIEWS} are enough")
    spread = _spread_deg(fit.normals)
    if spread < LEAST_SPREAD_DEG:
        doubts.append(
            f"the boards' tilts differ by {spread:.0f}° at most, so that the focal length is uncertain"
        )
    if _focal_error(fit) > DOUBTFUL_FOCAL:
        doubts.append(f"the focal length is known to {100 * _focal_error(fit):.1f} % only")
    covered = _covered(views, fit.camera)
    if covered < LEAST_COVERED:
        differ = _models_differ_px(fit, fits)
        beyond = f", lens models differ by {differ:.1f} px beyond" if differ > 0 else ""
        doubts.append(f"corners lie in {100 * covered:.0f} % of the frame{beyond}")
    if fit.rms_px > DOUBTFUL_RMS_PX:
        doubts.append(f"corners lie {fit.rms_px:.1f} px from their places")
    middle = np.median(fit.view_rms_px)
    odd = [v.name for v, r in zip(views, fit.view_rms_px, strict=True) if r > ODD_VIEW * middle]
    if odd:
        doubts.append(f"these views fit worse than the others: {', '.join(odd)}")
    if len(without) > len(views):
        doubts.append(f"the board is not found in {len(without)} images")
    return f"doubtful: {'; '.join(doubts)}" if doubts else "good"


def _models_differ_px(best: CameraFit, fits: Mapping[str, CameraFit]) -> float:
    """How far, within the frame, the models that hold the best one's coefficients move its pixels, px."""
    camera = best.camera
    columns, rows = np.meshgrid(np.linspace(0, camera.columns - 1, 33), np.linspace(0, camera.rows - 1, 33))
    rays = camera.rays(columns, rows)
    free = np.count_nonzero(best.standard_errors)
    moved = [
        np.hypot(*np.subtract(fit.camera.project(rays), (columns, rows))).max()
        for fit in fits.values()
        if np.count_nonzero(fit.standard_errors) > free
    ]
    return float(max(moved, default=0.0))


def _tilt_deg(normal: Float) -> float:
    return float(np.degrees(np.arccos(min(1.0, abs(normal[2])))))


def _spread_deg(normals: Float) -> float:
    """Largest angle between the normals of two boards."""
    return float(np.degrees(np.arccos(np.clip(np.abs(normals @ normals.T).min(), 0, 1))))


def _covered(views: Sequence[BoardView], camera: Camera) -> float:
    """Share of the frame within the hull of all corners."""
    hull = cv2.convexHull(np.concatenate([view.corners_px for view in views]))
    return float(cv2.contourArea(hull) / (camera.rows * camera.columns))
