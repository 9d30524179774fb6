"""Flat targets: an evenly bright field and a Lambertian tile."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pbrdf.instruments.interface import Setting
from pbrdf.instruments.virtual_geometry import virtual_flat
from pbrdf.instruments.virtual_plane import VirtualField, VirtualTile
from pbrdf.instruments.virtual_rig import VirtualRig
from pbrdf.settings.plan import Light
from pbrdf.settings.rig import read_rig
from pbrdf.settings.targets import AMBIENT

SOURCE = Path(__file__).resolve().parents[2] / "config/rig/virtual.yaml"
STATES = [(0.0, 0.0, 0.0, 90.0), (0.0, 175.0, 35.0, 90.0), (10.0, 3.0, 40.0, 80.0)]


@pytest.fixture
def settings() -> dict[str, Any]:
    rig = deepcopy(dict(read_rig(SOURCE)))
    for name in ("lamp_drift", "hot_pixels"):
        del rig[name]
    return rig


def test_a_quarter_of_unpolarised_light_passes_in_every_state(settings: dict[str, Any]) -> None:
    """DN of a field of radiance one: power of the lamp, ¼, time and gain; vignetting shows."""
    rig = VirtualRig(settings, VirtualField(settings))
    expected = 3.3e6 / 4 * 0.02 / 2.0 * virtual_flat(settings) + 48
    for number, state in enumerate(STATES):
        frame = rig.expose(f"s{number}", Setting(AMBIENT, 550, state, 0.02, number)) / 4.0
        assert frame.mean() == pytest.approx(expected.mean(), rel=3e-4)
        corner = (slice(170, 192), slice(170, 192))
        assert frame[corner].mean() == pytest.approx(expected[corner].mean(), rel=2e-3)


def test_the_longest_exposure_of_the_flat_field_nearly_saturates(settings: dict[str, Any]) -> None:
    rig = VirtualRig(settings, VirtualField(settings))
    saturation = rig.frame_format.saturation
    for band_nm in settings["filters_nm"]:
        brightest = rig.expose("long", Setting(AMBIENT, band_nm, STATES[0], 0.036, 0)).max()
        assert 0.7 * saturation < brightest < saturation


def test_a_tile_is_lit_by_the_cosine_over_the_square_of_the_distance(settings: dict[str, Any]) -> None:
    """At the principal point the tile stands at the arm's centre: 0.8 m from the lamp, 20° beside it."""
    settings["camera"]["principal_px"] = [95.0, 96.0]
    image = VirtualTile(settings, 0.99).mueller_image(20.0, 550)
    assert image[96, 95, 0] == pytest.approx(0.99 / np.pi * np.cos(np.deg2rad(20)) / 0.8**2, rel=1e-6)
    assert not image[..., 1:].any()
    # the lamp stands on one side, so that this side is nearer to it
    lamp = VirtualTile(settings, 0.99).mueller_image(-20.0, 550)
    np.testing.assert_allclose(image[:, 95 - 80, 0], lamp[:, 95 + 80, 0], rtol=1e-6)
    assert abs(image[96, 95 - 80, 0] / image[96, 95 + 80, 0] - 1) > 0.02


def test_irradiance_of_a_pixel_far_off_is_that_of_its_own_point(settings: dict[str, Any]) -> None:
    image = VirtualTile(settings, 1.0).mueller_image(30.0, 550)
    angle = np.deg2rad(30)
    x, y = (np.array([10.0, 180.0]) - settings["camera"]["principal_px"]) / 3200 * 1000
    sides = [
        np.array([side * 800 * np.sin(angle), 0.0, -800 * np.cos(angle)]) - [x, y, 0.0] for side in (-1, 1)
    ]
    values = [800 * np.cos(angle) * 1e6 / np.pi / np.linalg.norm(side) ** 3 for side in sides]
    assert min(abs(image[180, 10, 0] / value - 1) for value in values) < 1e-6


@pytest.mark.parametrize("band_nm", [450, 550, 650])
def test_spectralon_is_well_exposed(settings: dict[str, Any], band_nm: int) -> None:
    rig = VirtualRig(settings, VirtualTile(settings, 0.99))
    brightest = rig.expose("a", Setting(Light("020.00", 20.0), band_nm, STATES[1], 0.06, 0)).max()
    assert 0.5 * rig.frame_format.saturation < brightest < 0.9 * rig.frame_format.saturation
