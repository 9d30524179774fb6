from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.lens import Coefficients, distort, turning_radius, undistort
from pbrdf.errors import InputError
from pbrdf.formats.documents import write_document

PINHOLE = Camera((3200.0, 3100.0), (95.2, 96.1), 180, 200)
# the lens of OpenCV's own calibration set, with barrel distortion of 40 px in the corners
BARREL = Camera(
    (535.9, 536.2), (342.3, 235.6), 480, 640, (-0.26637, -0.038589, 0.0017832, -0.00028122, 0.23839)
)
PINCUSHION = Camera((800.0, 805.0), (310.0, 250.0), 480, 640, (0.2, 0.05, -0.001, 0.002, 0.01))
LENSES = pytest.mark.parametrize("camera", [BARREL, PINCUSHION], ids=["barrel", "pincushion"])


def _matrix(camera: Camera) -> NDArray[np.float64]:
    fx, fy = camera.focal_px
    cx, cy = camera.principal_px
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])


def _pixels(camera: Camera) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    columns, rows = np.meshgrid(
        np.linspace(-0.5, camera.columns - 0.5, 33), np.linspace(-0.5, camera.rows - 0.5, 25)
    )
    return columns, rows


@LENSES
def test_points_fall_where_opencv_puts_them(camera: Camera) -> None:
    points = camera.rays(*_pixels(camera)).reshape(-1, 3) * np.linspace(100, 3000, 825)[:, None]
    expected, _ = cv2.projectPoints(
        points, np.zeros(3), np.zeros(3), _matrix(camera), np.array(camera.distortion)
    )
    assert np.allclose(np.stack(camera.project(points), -1), expected[:, 0], rtol=0, atol=1e-9)


@LENSES
def test_rays_are_those_of_opencv(camera: Camera) -> None:
    columns, rows = _pixels(camera)
    places = np.stack([columns.ravel(), rows.ravel()], -1)
    stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 500, 1e-14)
    expected = cv2.undistortPoints(
        places, _matrix(camera), np.array(camera.distortion), None, None, None, stop
    ).reshape(-1, 2)
    rays = camera.rays(columns, rows).reshape(-1, 3)
    assert np.allclose(rays[:, :2] / rays[:, 2:], expected, rtol=0, atol=1e-9)


@LENSES
def test_a_ray_leads_back_to_its_pixel(camera: Camera) -> None:
    columns, rows = _pixels(camera)
    rays = camera.rays(columns, rows)
    assert np.allclose(np.linalg.norm(rays, axis=-1), 1, rtol=0, atol=1e-15)
    back = camera.project(700.0 * rays)
    assert np.allclose(back, (columns, rows), rtol=0, atol=1e-9)


@given(
    k1=st.floats(-0.4, 0.4),
    k2=st.floats(-0.2, 0.2),
    k3=st.floats(-0.2, 0.2),
    p1=st.floats(-0.01, 0.01),
    p2=st.floats(-0.01, 0.01),
    turn=st.floats(0, 6.28),
    share=st.floats(0, 0.95),
)
def test_undistortion_is_the_inverse_wherever_the_polynomial_rises(
    k1: float, k2: float, k3: float, p1: float, p2: float, turn: float, share: float
) -> None:
    lens: Coefficients = (k1, k2, p1, p2, k3)
    radius = share * min(turning_radius(lens), 1.0)
    x, y = np.array([radius * np.cos(turn)]), np.array([radius * np.sin(turn)])
    back = undistort(*distort(x, y, lens), lens)
    assert np.allclose(back, (x, y), rtol=0, atol=1e-9)


def test_a_pinhole_keeps_its_arithmetic() -> None:
    columns, rows = PINHOLE.project([[0, 0, 500], [5, 0, 1000], [0, -5, 1000]])
    assert columns == pytest.approx([95.2, 95.2 + 16.0, 95.2])
    assert rows == pytest.approx([96.1, 96.1, 96.1 - 15.5])
    assert PINHOLE.rays(95.2, 96.1).tolist() == [0, 0, 1]
    assert np.allclose(PINHOLE.rays(95.2 + 32.0, 96.1), np.array([0.01, 0, 1]) / np.sqrt(1.0001), atol=1e-15)


def test_the_radius_at_which_the_image_would_fold_is_that_of_the_polynomial() -> None:
    lens: Coefficients = (-0.3, 0.0, 0.0, 0.0, 0.0)
    assert turning_radius(lens) == pytest.approx(np.sqrt(1 / 0.9))
    assert turning_radius((0.2, 0.05, 0.0, 0.0, 0.0)) == np.inf
    assert turning_radius((0.0, 0.0, 0.0, 0.0, 0.0)) == np.inf


def test_what_lies_beside_the_field_of_view_falls_beside_the_frame() -> None:
    """The bare polynomial would put these points into the frame: it falls again beyond its turning radius."""
    bare, _ = cv2.projectPoints(
        np.array([[1900.0, 0.0, 1000.0]]),
        np.zeros(3),
        np.zeros(3),
        _matrix(BARREL),
        np.array([-0.3, 0, 0, 0, 0]),
    )
    assert 0 < bare[0, 0, 0] < 640
    camera = Camera(BARREL.focal_px, BARREL.principal_px, 480, 640, (-0.3, 0.0, 0.0, 0.0, 0.0))
    for x, y in ((1.9, 0.0), (-1.9, 0.1), (0.2, 1.9), (3.0, -9.0)):
        column, row = camera.project([1000 * x, 1000 * y, 1000.0])
        assert not (-0.5 <= column <= 639.5 and -0.5 <= row <= 479.5)


def test_a_place_no_direction_maps_to_has_no_ray() -> None:
    camera = Camera((500.0, 500.0), (320.0, 240.0), 480, 640, (-0.3, 0.0, 0.0, 0.0, 0.0))
    # the polynomial never exceeds 0.703, which is 351 px
    assert np.isfinite(camera.rays(320.0 + 351.0, 240.0)).all()
    assert np.isnan(camera.rays(320.0 + 352.0, 240.0)).all()


def test_distortion_is_read_and_its_absence_is_a_pinhole(tmp_path: Path) -> None:
    content = {"focal_px": [535.9, 536.2], "principal_px": [342.3, 235.6], "rows": 480, "columns": 640}
    path = tmp_path / "camera.json"
    write_document(path, "camera/1", content)
    assert Camera.read(path).distortion == (0.0, 0.0, 0.0, 0.0, 0.0)
    write_document(path, "camera/1", content | {"distortion": list(BARREL.distortion)})
    assert Camera.read(path) == BARREL


@pytest.mark.parametrize("distortion", [[-0.2, 0.1], "strong", [0, 0, 0, 0, "k3"], None])
def test_a_distortion_that_is_none_is_named(tmp_path: Path, distortion: object) -> None:
    content = {"focal_px": [536, 536], "principal_px": [342, 236], "rows": 480, "columns": 640}
    write_document(tmp_path / "camera.json", "camera/1", content | {"distortion": distortion})
    with pytest.raises(InputError, match=r"camera\.json: distortion"):
        Camera.read(tmp_path / "camera.json")


def test_a_lens_that_folds_its_own_frame_is_refused(tmp_path: Path) -> None:
    content = {"focal_px": [536, 536], "principal_px": [342, 236], "rows": 480, "columns": 640}
    write_document(tmp_path / "camera.json", "camera/1", content | {"distortion": [-0.8, 0, 0, 0, 0]})
    with pytest.raises(InputError, match="distortion: folds the image within the frame"):
        Camera.read(tmp_path / "camera.json")
