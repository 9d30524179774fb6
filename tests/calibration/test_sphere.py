from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.sphere import Sphere
from pbrdf.errors import InputError
from pbrdf.formats.documents import write_document

CAMERA = Camera((3200.0, 3100.0), (95.2, 96.1), 180, 200)


def _outline(sphere: Sphere) -> NDArray[np.float64]:
    """Points where lines of sight graze the sphere: a circle across the line to its centre, (N, 3)."""
    centre = np.array(sphere.centre_mm)
    distance = np.linalg.norm(centre)
    along = centre / distance
    across = np.linalg.svd(along[None])[2][1:]
    shrink = 1 - (sphere.radius_mm / distance) ** 2
    turn = np.linspace(0, 2 * np.pi, 40_001)[:, None]
    ring = np.cos(turn) * across[0] + np.sin(turn) * across[1]
    return centre * shrink + sphere.radius_mm * np.sqrt(shrink) * ring


def test_lines_of_sight_to_the_outline_touch_the_sphere() -> None:
    """On the sphere, and square to its radius there; ours and the brute-force outline alike."""
    sphere = Sphere((120.0, -80.0, 900.0), 60.0)
    for points in (_outline(sphere), sphere.outline()):
        radii = points - np.array(sphere.centre_mm)
        assert np.linalg.norm(radii, axis=1) == pytest.approx(60.0)
        assert np.abs(np.sum(radii * points, axis=1)).max() < 1e-8


def test_the_outline_begins_at_the_right_and_turns_toward_the_bottom() -> None:
    sphere = Sphere((0.0, 0.0, 1000.0), 25.0)
    right, down = sphere.outline([0.0, np.pi / 2])
    assert right[:2] == pytest.approx([25 * np.sqrt(1 - 0.025**2), 0], abs=1e-12)
    assert down[:2] == pytest.approx([0, 25 * np.sqrt(1 - 0.025**2)], abs=1e-12)


@given(
    x=st.floats(-300, 300),
    y=st.floats(-300, 300),
    z=st.floats(100, 2000),
    share=st.floats(0.01, 0.8),
)
def test_the_window_is_that_of_the_projected_outline(x: float, y: float, z: float, share: float) -> None:
    sphere = Sphere((x, y, z), share * z)
    wide = Camera((150.0, 140.0), (2000.3, 1999.6), 4000, 4001)
    columns, rows = wide.project(_outline(sphere))
    window = sphere.window(wide, 0)
    for part, seen, length in zip(window, (rows, columns), (4000, 4001), strict=True):
        assert part.start == pytest.approx(max(np.floor(seen.min()), 0), abs=1e-3) or (
            abs(seen.min() - round(seen.min())) < 1e-3
        )
        assert part.stop == pytest.approx(min(np.ceil(seen.max()) + 1, length), abs=1e-3) or (
            abs(seen.max() - round(seen.max())) < 1e-3
        )


@pytest.mark.parametrize("k1", [-0.25, 0.25])
def test_with_a_lens_the_window_is_still_that_of_the_projected_outline(k1: float) -> None:
    """Off the axis, where the lens moves the outline by tens of pixels."""
    sphere = Sphere((250.0, -150.0, 900.0), 60.0)
    bent = Camera((1500.0, 1500.0), (1000.0, 750.0), 1500, 2000, (k1, 0.1, 0.001, -0.001, 0.0))
    columns, rows = bent.project(_outline(sphere))
    straight, _ = Camera((1500.0, 1500.0), (1000.0, 750.0), 1500, 2000).project(_outline(sphere))
    assert abs(columns.max() - straight.max()) > 10
    assert sphere.window(bent, 0) == (
        slice(int(np.floor(rows.min())), int(np.ceil(rows.max())) + 1),
        slice(int(np.floor(columns.min())), int(np.ceil(columns.max())) + 1),
    )


def test_a_sphere_beside_the_field_of_view_of_a_bending_lens_is_refused() -> None:
    """The lens's bare polynomial would bring it back into the frame."""
    bent = Camera((535.9, 536.2), (342.3, 235.6), 480, 640, (-0.3, 0.0, 0.0, 0.0, 0.0))
    with pytest.raises(InputError, match="no column of the frame shows it"):
        Sphere((1900.0, 0.0, 1000.0), 25.0).window(bent, 0)


def test_the_margin_widens_the_window_as_far_as_the_frame_goes() -> None:
    sphere = Sphere((0.0, 0.0, 1000.0), 25.0)
    rows, columns = sphere.window(CAMERA, 0)
    assert sphere.window(CAMERA, 3) == (
        slice(rows.start - 3, rows.stop + 3),
        slice(columns.start - 3, columns.stop + 3),
    )
    assert sphere.window(CAMERA, 1000) == (slice(0, 180), slice(0, 200))


def test_a_sphere_larger_than_the_frame_fills_it() -> None:
    assert Sphere((0.0, 0.0, 1000.0), 400.0).window(CAMERA, 2) == (slice(0, 180), slice(0, 200))


def test_a_sphere_half_out_of_the_frame_is_cut() -> None:
    rows, columns = Sphere((-30.0, 0.0, 1000.0), 25.0).window(CAMERA, 0)
    assert columns.start == 0
    assert 0 < columns.stop < 100
    assert rows.stop - rows.start > 150


@pytest.mark.parametrize(
    ("centre", "name"),
    [
        ((100.0, 0.0, 1000.0), "column"),
        ((-100.0, 0.0, 1000.0), "column"),
        ((0.0, 100.0, 1000.0), "row"),
        ((0.0, -100.0, 1000.0), "row"),
    ],
)
@pytest.mark.parametrize("margin_px", [0, 500])
def test_a_sphere_outside_the_frame_is_refused_however_wide_the_margin(
    centre: tuple[float, float, float], name: str, margin_px: int
) -> None:
    with pytest.raises(InputError, match=f"no {name} of the frame shows it"):
        Sphere(centre, 25.0).window(CAMERA, margin_px)


@pytest.mark.parametrize(
    ("centre", "radius"),
    [
        ((0.0, 0.0, -1000.0), 25.0),
        ((0.0, 0.0, 0.0), 25.0),
        ((0.0, 0.0, 25.0), 25.0),
        ((1000.0, 0.0, 24.0), 25.0),
    ],
)
def test_a_sphere_that_is_not_before_the_camera_is_refused(
    tmp_path: Path, centre: tuple[float, float, float], radius: float
) -> None:
    path = tmp_path / "sphere.json"
    write_document(path, "sphere/1", {"centre_mm": list(centre), "radius_mm": radius})
    with pytest.raises(InputError, match="on or behind the camera"):
        Sphere.read(path)
