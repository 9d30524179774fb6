"""Balls under ambient light: where their outline lies, and that it stands out."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pbrdf.instruments.virtual_ambient import BACKDROP, ball_normals
from pbrdf.instruments.virtual_chrome import OFFSET_MM, chrome_ambient
from pbrdf.instruments.virtual_sphere import VirtualSphere, ambient_sphere
from pbrdf.settings.rig import read_rig

SOURCE = Path(__file__).resolve().parents[2] / "config/rig/virtual.yaml"


@pytest.fixture
def settings() -> dict[str, Any]:
    return deepcopy(dict(read_rig(SOURCE)))


def test_rays_meet_a_ball_where_its_equation_says() -> None:
    centre = np.array([3.0, -2.0, 100.0])
    toward = np.random.default_rng(1).normal((0, 0, 1), 0.1, (500, 3))
    toward /= np.linalg.norm(toward, axis=-1, keepdims=True)
    hit, normal = ball_normals(toward, centre, 10.0)
    nearest = np.linalg.norm(np.cross(toward, centre), axis=-1)
    np.testing.assert_array_equal(hit, nearest < 10.0)
    assert 50 < hit.sum() < 450
    points = centre + 10.0 * normal[hit]
    np.testing.assert_allclose(np.cross(points, toward[hit]), 0.0, atol=1e-9)
    assert np.all(np.sum(normal[hit] * toward[hit], -1) < 0)


@pytest.mark.parametrize("material", ["plastic", "gold"])
def test_the_outline_is_the_cone_that_grazes_the_sphere(settings: dict[str, Any], material: str) -> None:
    """Area and middle of what is brighter than half way from the cloth to the edge, against the cone's."""
    image = ambient_sphere(settings, material, 25.0, SOURCE).mueller_image(0.0, 550)
    assert not image[..., 1:].any()
    seen = image[..., 0]
    # on the axis a sphere is a circle of tan(asin(R/z))
    radius = 3200 * np.tan(np.arcsin(25.0 / 1000.0))
    row, column = np.indices(seen.shape)
    distance = np.hypot(column - 95.2, row - 96.1)
    np.testing.assert_allclose(seen[distance > radius + 5], BACKDROP, rtol=1e-4)
    inner = seen[(distance > radius - 6) & (distance < radius - 4)]
    assert inner.min() > 8 * BACKDROP
    across = seen[96]
    right = np.flatnonzero(across > (BACKDROP + across[96 + 75]) / 2)
    assert right[-1] + 0.5 == pytest.approx(95.2 + radius, abs=0.8)
    assert right[0] - 0.5 == pytest.approx(95.2 - radius, abs=0.8)


def test_an_ambient_sphere_stands_where_the_lamp_lights_it(settings: dict[str, Any]) -> None:
    ambient = ambient_sphere(settings, "plastic", 25.0, SOURCE)
    lit = VirtualSphere(settings, "plastic", 25.0, SOURCE)
    np.testing.assert_array_equal(ambient.truth["centre_mm"], lit.centre_mm)
    assert ambient.name != lit.name


def test_the_room_is_brighter_above(settings: dict[str, Any]) -> None:
    seen = chrome_ambient(settings, 25.0, SOURCE).mueller_image(0.0, 550)[..., 0]
    assert seen[50, 95] > 1.5 * seen[142, 95] > 10 * BACKDROP


def test_the_chrome_ball_is_not_quite_at_the_arms_centre(settings: dict[str, Any]) -> None:
    ball = chrome_ambient(settings, 25.0, SOURCE)
    np.testing.assert_allclose(ball.truth["centre_mm"], np.array([0, 0, 1000.0]) + OFFSET_MM)
    seen = ball.mueller_image(0.0, 550)[..., 0] > 10 * BACKDROP
    row, column = np.indices(seen.shape)
    expected = np.array([95.2, 96.1]) + 3200 * np.array(OFFSET_MM[:2]) / (1000 + OFFSET_MM[2])
    np.testing.assert_allclose([column[seen].mean(), row[seen].mean()], expected, atol=0.1)
