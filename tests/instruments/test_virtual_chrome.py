"""The chrome ball's highlight: where it lies, how much light it holds and how it is polarised."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize

from pbrdf.errors import InputError
from pbrdf.instruments.interface import Setting
from pbrdf.instruments.virtual_chrome import REFLECTANCE, VirtualChrome, highlight_normal
from pbrdf.instruments.virtual_geometry import virtual_arm
from pbrdf.instruments.virtual_rig import VirtualRig
from pbrdf.settings.plan import Light, bright_state
from pbrdf.settings.rig import read_rig

SOURCE = Path(__file__).resolve().parents[2] / "config/rig/virtual.yaml"
ANGLES = [8.0, 41.0, 90.0, 140.0, 170.0]


@pytest.fixture
def settings() -> dict[str, Any]:
    return deepcopy(dict(read_rig(SOURCE)))


def centroid(image: NDArray[np.float32]) -> NDArray[np.float64]:
    """Column and row."""
    weight = image[..., 0].astype(np.float64)
    row, column = np.indices(weight.shape)
    return np.array([(weight * column).sum(), (weight * row).sum()]) / weight.sum()


def shortest_way(settings: dict[str, Any], ball: VirtualChrome, angle_deg: float) -> NDArray[np.float64]:
    """Column and row of the point of the ball by which the way from lamp to camera is shortest: Fermat."""
    lamp = virtual_arm(settings).light_position(angle_deg)

    def point(angles: NDArray[np.float64]) -> NDArray[np.float64]:
        x, y = np.sin(angles)
        return ball.centre_mm + ball.radius_mm * np.array([x, y, -np.sqrt(max(1 - x * x - y * y, 0.0))])

    def way(angles: NDArray[np.float64]) -> float:
        place = point(angles)
        return float(np.linalg.norm(place) + np.linalg.norm(lamp - place))

    start = highlight_normal(ball.centre_mm, ball.radius_mm, lamp)[:2] * 0.97
    found = minimize(way, np.arcsin(start), method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-13})
    x, y, z = point(found.x)
    projected: NDArray[np.float64] = 3200 * np.array([x, y]) / z + settings["camera"]["principal_px"]
    return projected


@pytest.mark.parametrize("angle_deg", ANGLES)
def test_the_highlight_lies_where_the_way_from_lamp_to_camera_is_shortest(
    settings: dict[str, Any], angle_deg: float
) -> None:
    ball = VirtualChrome(settings, 25.0, SOURCE)
    seen = centroid(ball.mueller_image(angle_deg, 550))
    np.testing.assert_allclose(seen, shortest_way(settings, ball, angle_deg), atol=0.01)


def test_the_highlight_holds_the_light_of_a_convex_mirrors_image(settings: dict[str, Any]) -> None:
    """Disc of radius r at distance u before a mirror of focal length −f = −R/2: image r f / (u + f)."""
    image = VirtualChrome(settings, 25.0, SOURCE).mueller_image(8.0, 550)[..., 0].astype(np.float64)
    disc = settings["lamp_disc"]
    behind = 1 / (1 / 12.5 + 1 / 775)
    radius_px = 3200 / (977 + behind) * disc["radius_mm"] * behind / 775
    assert image.sum() == pytest.approx(REFLECTANCE * disc["radiance"] * np.pi * radius_px**2, rel=0.02)


def test_a_mirror_turns_the_circular_part_round_and_keeps_what_is_along_s(settings: dict[str, Any]) -> None:
    """The arm is horizontal: s and the axes of both modules are vertical but for the ball's height."""
    for angle_deg in ANGLES:
        image = VirtualChrome(settings, 25.0, SOURCE).mueller_image(angle_deg, 550)
        row, column = np.unravel_index(image[..., 0].argmax(), image.shape[:2])
        mueller = image[row, column].reshape(4, 4) / image[row, column, 0]
        np.testing.assert_allclose(mueller, np.diag([1.0, 1.0, -1.0, -1.0]), atol=0.05)
        np.testing.assert_allclose(mueller @ mueller.T, np.eye(4), atol=1e-6)


def test_a_lamp_behind_the_ball_is_not_mirrored(settings: dict[str, Any]) -> None:
    assert not VirtualChrome(settings, 25.0, SOURCE).mueller_image(180.0, 550).any()


def test_the_highlight_moves_smoothly_with_the_lamp(settings: dict[str, Any]) -> None:
    """Steps of a tenth of a degree are equal to a thousandth of a pixel: sampling does not show."""
    ball = VirtualChrome(settings, 25.0, SOURCE)
    seen = np.array([centroid(ball.mueller_image(60.0 + 0.1 * n, 550)) for n in range(8)])
    steps = np.diff(seen, axis=0)
    assert np.abs(steps[:, 0]).min() > 0.02
    assert np.ptp(steps, axis=0).max() < 2e-3


@pytest.mark.parametrize("angle_deg", ANGLES)
def test_the_highlight_is_bright_and_not_saturated(settings: dict[str, Any], angle_deg: float) -> None:
    """In the state and exposure that the session takes of it; near the outline the image is narrow."""
    del settings["hot_pixels"]
    rig = VirtualRig(settings, VirtualChrome(settings, 25.0, SOURCE))
    light = Light("", angle_deg)
    states = [(0.0, 25.0 * n % 360.0, 5.0 * n, 90.0) for n in range(36)]
    frame = rig.expose("a", Setting(light, 550, states[bright_state(states)], 0.04, 0))
    least = 0.05 if angle_deg > 150 else 0.2
    assert least * rig.frame_format.saturation < frame.max() < 0.9 * rig.frame_format.saturation


def test_a_rig_that_does_not_know_its_lamp_is_refused(settings: dict[str, Any]) -> None:
    del settings["lamp_disc"]
    with pytest.raises(InputError) as refused:
        VirtualChrome(settings, 25.0, SOURCE)
    assert (refused.value.source, refused.value.field) == (str(SOURCE), "lamp_disc")
