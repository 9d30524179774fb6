from __future__ import annotations

import base64
import io
import re

import numpy as np
import pytest
from PIL import Image

from pbrdf.fitting import FitResult
from pbrdf.formats.table_data import TableData
from pbrdf.models import MODELS
from pbrdf.optics.stokes import angle_of_linear_polarisation, degree_of_polarisation
from pbrdf.report.figures import Float
from pbrdf.report.lit_sphere import INCIDENT, reflected_stokes, sphere_view
from pbrdf.report.polarisation_colours import (
    chirality_colours,
    degree_colours,
    orientation_colours,
    type_colours,
)
from pbrdf.report.sphere_pictures import sphere_pictures, thumbnail

UNPOLARISED = INCIDENT["unpolarised light"]


def glossy(to_light: Float, to_camera: Float, band: int) -> Float:
    parameters = {"alpha": 0.2, "eta": 1.5, "specular": 1.0, "albedo": 0.0}
    return MODELS["baek2018"].evaluate(to_light, to_camera, parameters)


def test_pure_states_have_the_published_colours() -> None:
    right, left = np.array([1.0, 0, 0, 1]), np.array([1.0, 0, 0, -1])
    along, across, up, down = (np.array([1.0, s1, s2, 0]) for s1, s2 in ((1, 0), (-1, 0), (0, 1), (0, -1)))
    np.testing.assert_allclose(type_colours(right), [1, 1, 0])
    np.testing.assert_allclose(type_colours(along), [0, 1, 1])
    np.testing.assert_allclose(chirality_colours(right), [0, 0, 1])
    np.testing.assert_allclose(chirality_colours(left), [1, 1, 0])
    np.testing.assert_allclose(orientation_colours(along), [0, 1, 0])
    np.testing.assert_allclose(orientation_colours(across), [1, 0, 0])
    np.testing.assert_allclose(orientation_colours(up), [1, 1, 0])
    np.testing.assert_allclose(orientation_colours(down), [0, 0, 1])
    np.testing.assert_allclose(degree_colours(0.5 * along + [0.5, 0, 0, 0]), [0.5, 0, 0])


def test_unpolarised_light_is_black() -> None:
    for colours in (degree_colours, orientation_colours, chirality_colours, type_colours):
        np.testing.assert_array_equal(colours(np.array([1.0, 0, 0, 0])), [0, 0, 0])


def test_the_highlight_lies_half_way_to_the_lamp() -> None:
    view = sphere_view(201, 60.0)
    s0 = reflected_stokes(view, glossy, 0, UNPOLARISED)[..., 0]
    row, column = np.unravel_index(np.nanargmax(s0), s0.shape)
    # the facet's cosine pulls it a little toward the lamp
    assert (column + 0.5) / 201 * 2.1 - 1.05 == pytest.approx(-np.sin(np.radians(30)), abs=0.03)
    assert row == 100


def test_reflected_light_vibrates_across_the_plane_of_light_and_camera() -> None:
    """Upright in the picture: lamp and camera stand in the horizontal plane."""
    view = sphere_view(101, 100.0)
    stokes = reflected_stokes(view, glossy, 0, UNPOLARISED)
    bright = stokes[stokes[..., 0] > 0.2 * np.nanmax(stokes[..., 0])]
    np.testing.assert_allclose(np.degrees(angle_of_linear_polarisation(bright)), 90, atol=1e-6)
    # θd of 50° is near Brewster's angle of glass
    assert degree_of_polarisation(bright).min() > 0.8


def test_the_dark_side_is_dark_and_the_sky_nothing() -> None:
    view = sphere_view(101, 90.0)
    stokes = reflected_stokes(view, glossy, 0, UNPOLARISED)
    assert np.all(stokes[50, 52:98] == 0)
    assert np.isnan(stokes[0, 0]).all()


def test_pictures_show_table_and_every_fit(table: TableData, fitted: FitResult) -> None:
    drawn = sphere_pictures(table, [fitted], 1)
    assert list(drawn) == list(INCIDENT)
    for shown in drawn.values():
        assert re.search(r"Table: DoP median .* Baek 2018: DoP median", shown.alt)
    assert sphere_pictures(table, [fitted], 1) == drawn


def test_a_thumbnail_is_small_and_not_blank(table: TableData, fitted: FitResult) -> None:
    uri, alt = thumbnail(table, [fitted], 1)
    assert len(uri) < 50_000
    assert alt.startswith("Table and Baek 2018:")
    image = np.asarray(Image.open(io.BytesIO(base64.b64decode(uri.partition(",")[2]))))
    assert image.shape == (96, 4 * 96, 3)
    assert image.std() > 30
