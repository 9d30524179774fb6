"""Elements in the beam: the lamp's disc as the camera sees it through them."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.instruments.interface import Setting
from pbrdf.instruments.virtual_beam import VirtualBeam, element_mueller
from pbrdf.instruments.virtual_geometry import UP
from pbrdf.instruments.virtual_rig import VirtualRig
from pbrdf.optics.elements import IDEAL
from pbrdf.optics.mueller import circular_polariser, linear_polariser, rotator
from pbrdf.settings.plan import Light
from pbrdf.settings.rig import read_rig

SOURCE = Path(__file__).resolve().parents[2] / "config/rig/virtual.yaml"
STRAIGHT = Light("180.00", 180.0)
TOWARD_CAMERA = (0.0, 0.0, -1.0)
STATES = [(0.0, 25.0 * n % 360.0, 5.0 * n, 90.0) for n in range(36)]


@pytest.fixture
def settings() -> dict[str, Any]:
    return deepcopy(dict(read_rig(SOURCE)))


def _image(settings: dict[str, Any], element: str) -> NDArray[np.float64]:
    flat = VirtualBeam(settings, element, SOURCE).mueller_image(180.0, 550)
    return flat.astype(np.float64).reshape(*flat.shape[:2], 4, 4)


def test_the_lamp_is_a_disc_where_the_pinhole_projects_it(settings: dict[str, Any]) -> None:
    """Area π (f R / z)² and centre at the principal point: the arm at 180° stands on the view's axis."""
    bright = _image(settings, "air")[..., 0, 0] / settings["lamp_disc"]["radiance"]
    radius = 3200 * 12.7 / 1800
    assert bright.sum() == pytest.approx(np.pi * radius**2, rel=1e-3)
    row, column = np.indices(bright.shape)
    assert (bright * column).sum() / bright.sum() == pytest.approx(95.2, abs=1e-2)
    assert (bright * row).sum() / bright.sum() == pytest.approx(96.1, abs=1e-2)
    distance = np.hypot(column - 95.2, row - 96.1)
    assert np.all(bright[distance < radius - 0.5] == 1.0)
    assert not bright[distance > radius + 0.5].any()


def test_the_edge_of_the_disc_covers_pixels_as_a_circle_does(settings: dict[str, Any]) -> None:
    """Coverage by 64 points a pixel; a straight edge through a pixel deviates by an eighth at most."""
    bright = _image(settings, "air")[..., 0, 0] / settings["lamp_disc"]["radiance"]
    inside = np.zeros(bright.shape)
    offsets = (np.arange(8) + 0.5) / 8 - 0.5
    row, column = np.indices(bright.shape)
    for dy in offsets:
        for dx in offsets:
            inside += np.hypot(column + dx - 95.2, row + dy - 96.1) < 3200 * 12.7 / 1800
    assert np.abs(bright - inside / 64).max() < 0.125


def test_every_pixel_of_the_disc_holds_the_elements_matrix(settings: dict[str, Any]) -> None:
    """X of both modules is vertical: a polariser along the camera's y lets +s1 through, one along x −s1."""
    expected = {
        "air": np.eye(4),
        "LPH": linear_polariser(np.pi / 2),
        "LPV": linear_polariser(),
        "CPL": circular_polariser(right=False),
        "CPR": circular_polariser(right=True),
    }
    assert expected.keys() == IDEAL.keys()
    for element, matrix in expected.items():
        image = _image(settings, element)
        middle = image[96, 95]
        np.testing.assert_allclose(middle, settings["lamp_disc"]["radiance"] * matrix, atol=1e-6)
        coverage = _image(settings, "air")[..., :1, :1] / settings["lamp_disc"]["radiance"]
        np.testing.assert_allclose(image, coverage * middle, atol=1e-6)


@pytest.mark.parametrize("element", IDEAL)
def test_an_element_is_told_in_the_frames_of_generator_and_analyser(element: str) -> None:
    """Frames turned about the beam: R(θ) re-expresses what leaves, R(θ)ᵀ what enters."""
    straight = element_mueller(element, UP, UP, TOWARD_CAMERA)
    turned_in, turned_out = (_turned(UP, angle) for angle in (0.3, -0.7))
    expected = rotator(-0.7) @ straight @ rotator(0.3).T
    found = element_mueller(element, turned_in, turned_out, TOWARD_CAMERA)
    np.testing.assert_allclose(found, expected, atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.2])
def test_a_horizontal_polariser_dims_by_malus_law(angle: float) -> None:
    """Light linear along an axis at `angle` to the camera's x: cos² of it passes, polarised along x."""
    linear = (np.cos(angle), np.sin(angle), 0.0)
    behind = element_mueller("LPH", linear, (1.0, 0.0, 0.0), TOWARD_CAMERA) @ [1.0, 1.0, 0.0, 0.0]
    np.testing.assert_allclose(behind, np.cos(angle) ** 2 * np.array([1.0, 1.0, 0.0, 0.0]), atol=1e-12)


@pytest.mark.parametrize("band_nm", [450, 500, 550, 600, 650])
def test_air_is_well_exposed_and_never_saturates_at_the_short_exposure(
    settings: dict[str, Any], band_nm: int
) -> None:
    rig = VirtualRig(settings, VirtualBeam(settings, "air", SOURCE))
    brightest = [
        rig.expose(f"s{n}", Setting(STRAIGHT, band_nm, state, 0.005, n)).max()
        for n, state in enumerate(STATES)
    ]
    assert max(brightest) < 0.9 * rig.frame_format.saturation
    assert max(brightest) > 0.5 * rig.frame_format.saturation


@pytest.mark.parametrize("angle_deg", [0.0, 90.0, 179.99, 180.01])
def test_an_arm_beside_the_beam_is_refused(settings: dict[str, Any], angle_deg: float) -> None:
    with pytest.raises(InputError) as refused:
        VirtualBeam(settings, "LPH", SOURCE).mueller_image(angle_deg, 550)
    assert (refused.value.source, refused.value.field) == (str(SOURCE), "angle_deg")
    assert refused.value.remedy == "turn the arm to 180°"


def test_an_unknown_element_is_refused(settings: dict[str, Any]) -> None:
    with pytest.raises(InputError) as refused:
        VirtualBeam(settings, "LP45", SOURCE)
    assert (refused.value.field, refused.value.problem) == ("element", "is 'LP45'")
    assert "LPH" in refused.value.remedy


def test_a_rig_that_does_not_know_its_lamp_is_refused(settings: dict[str, Any]) -> None:
    del settings["lamp_disc"]
    with pytest.raises(InputError) as refused:
        VirtualBeam(settings, "air", SOURCE)
    assert (refused.value.source, refused.value.field) == (str(SOURCE), "lamp_disc")


def test_elements_have_identities_and_noise_of_their_own(settings: dict[str, Any]) -> None:
    del settings["hot_pixels"]
    rigs = [VirtualRig(settings, VirtualBeam(settings, element, SOURCE)) for element in IDEAL]
    other = settings | {"lamp_disc": {"radius_mm": 12.7, "radiance": 2.0}}
    rigs.append(VirtualRig(other, VirtualBeam(other, "air", SOURCE)))
    assert len({rig.identity for rig in rigs}) == len(rigs)
    darks = np.array([rig.expose_dark("r0", 0.005).ravel() for rig in rigs[:-1]], dtype=np.float64)
    correlations = np.asarray(np.corrcoef(darks))[np.triu_indices(len(darks), 1)]
    assert np.abs(correlations).max() < 5 / np.sqrt(darks.shape[1])


def _turned(axis: tuple[float, float, float], angle: float) -> NDArray[np.float64]:
    """An axis turned about the beam toward the camera, counter-clockwise for who looks into it."""
    across = np.cross(TOWARD_CAMERA, axis)
    turned: NDArray[np.float64] = np.cos(angle) * np.asarray(axis) + np.sin(angle) * across
    return turned
