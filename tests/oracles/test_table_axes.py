"""The axes and Stokes frames of the published KAIST tables (every fifth node) are ours."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
from numpy.typing import NDArray

from pbrdf.formats.kaist_mat import read_kaist_mat
from pbrdf.optics.frames import table_axis
from pbrdf.optics.rusinkiewicz import angles, cosines, directions

Arrays = dict[str, NDArray[Any]]
Float = NDArray[np.float64]
# float32 frames: 6e-8 a component, and the angle of two vectors grows with 1/sinθd
FRAME_AGREES = 1e-6


@pytest.fixture(scope="module")
def published(real_data: Path) -> Arrays:
    content: Arrays = scipy.io.loadmat(real_data / "table-axes" / "pbrdf_table_info_dsamp5.mat")
    return content


@pytest.fixture(scope="module")
def valid(published: Arrays) -> NDArray[np.bool_]:
    """Nodes (phi_d, theta_d, theta_h) with light and camera above the horizon and θd > 0."""
    cos_light, cos_camera = cosines(*grid(published))
    return (cos_light > 1e-6) & (cos_camera > 1e-6) & (grid(published)[1] > 0)


def grid(published: Arrays) -> tuple[Float, ...]:
    """θh, θd, φd of each node, in the file's order (phi_d, theta_d, theta_h)."""
    axes = (published[name].ravel().astype(np.float64) for name in ("phi_d", "theta_d", "theta_h"))
    phi_d, theta_d, theta_h = np.meshgrid(*axes, indexing="ij")
    return theta_h, theta_d, phi_d


def in_the_camera_plane(
    published: Arrays,
) -> tuple[Float, Float]:
    """Our directions of each node, turned about the normal so that the camera has azimuth 0."""
    light, camera = directions(*grid(published))
    azimuth = np.arctan2(camera[..., 1], camera[..., 0])
    c, s = np.cos(azimuth), np.sin(azimuth)
    zero, one = np.zeros_like(c), np.ones_like(c)
    turn = np.stack([np.stack(row, -1) for row in ((c, s, zero), (-s, c, zero), (zero, zero, one))], -2)
    return np.einsum("...ij,...j->...i", turn, light), np.einsum("...ij,...j->...i", turn, camera)


def test_axes_are_quadratic_in_theta_h_and_whole_degrees_elsewhere(
    published: Arrays,
) -> None:
    step = np.arange(0, 91, 5)
    expected = {
        "theta_h": np.radians((step / 90) ** 2 * 90),
        "theta_d": np.radians(step),
        "phi_d": np.radians(np.arange(-180, 181, 5)),
    }
    for name, values in expected.items():
        stored = published[name].ravel()
        assert stored.dtype == np.float32
        # two roundings to float32, one of them at π
        assert np.allclose(stored, values, rtol=0, atol=2.4e-7)


def test_a_table_with_these_axes_is_read(tmp_path: Path, real_data: Path) -> None:
    scipy.io.savemat(tmp_path / "a.mat", {"pbrdf_T": np.ones((73, 19, 19, 5, 4, 4), np.float32)})
    table = read_kaist_mat(tmp_path / "a.mat", real_data / "table-axes" / "pbrdf_table_info_dsamp5.mat")
    assert table.wavelengths_nm.tolist() == [450, 500, 550, 600, 650]
    assert table.mueller.shape == (5, 19, 19, 73, 4, 4)


def test_stored_beams_are_our_directions_with_the_camera_at_azimuth_zero(
    published: Arrays, valid: NDArray[np.bool_]
) -> None:
    light, camera = in_the_camera_plane(published)
    # θh = 0 has no azimuth of the half vector, hence none of φd; a camera on the normal has none either
    there = valid & (grid(published)[0] > 0) & (np.hypot(camera[..., 0], camera[..., 1]) > 1e-6)
    assert there.sum() > 15_000
    assert np.allclose(-published["xyzi_T"][there][:, 2], light[there], rtol=0, atol=FRAME_AGREES)
    assert np.allclose(published["xyzo_T"][there][:, 2], camera[there], rtol=0, atol=FRAME_AGREES)


def test_stored_beams_have_the_angles_of_their_node(published: Arrays, valid: NDArray[np.bool_]) -> None:
    light, camera = -published["xyzi_T"][valid][:, 2], published["xyzo_T"][valid][:, 2]
    theta_h, theta_d, phi_d = angles(light, camera)
    node_h, node_d, node_p = (values[valid] for values in grid(published))
    assert np.allclose(theta_h, node_h, rtol=0, atol=1e-6)
    assert np.allclose(theta_d, node_d, rtol=0, atol=1e-6)
    has_azimuth = node_h > 0
    turned = np.angle(np.exp(1j * (phi_d - node_p)))[has_azimuth]
    # float32 directions fix the azimuth to 6e-8 over the sine of the first node of θh, 0.0048
    assert np.abs(turned).max() < 1e-4


@pytest.mark.parametrize("beam", ["xyzi_T", "xyzo_T"])
def test_stored_frames_are_right_handed_and_across_both_beams_as_ours(
    published: Arrays, valid: NDArray[np.bool_], beam: str
) -> None:
    frames = published[beam][valid].astype(np.float64)
    light, camera = -published["xyzi_T"][valid][:, 2], published["xyzo_T"][valid][:, 2]
    x, y, z = frames[:, 0], frames[:, 1], frames[:, 2]
    assert np.allclose(np.cross(z, x), y, rtol=0, atol=FRAME_AGREES)
    ours = table_axis(light, camera)
    along = np.sum(x * ours, axis=-1)
    # the sign of x means nothing: half a turn leaves a Stokes vector as it is
    assert np.allclose(x, np.sign(along)[:, None] * ours, rtol=0, atol=FRAME_AGREES)
