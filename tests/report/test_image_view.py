from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.optics.mueller import linear_polariser
from pbrdf.report.cyclic import half_turn, hues
from pbrdf.report.image_view import MOST_DRAWN, MuellerImage, image_views
from pbrdf.report.map_pictures import (
    BELOW_ZERO_COLOUR,
    eigenvalue_scale,
    map_picture,
    range_scale,
    share_scale,
)
from pbrdf.report.map_view import NOISE_UNKNOWN
from pbrdf.report.mueller_image import block_counts
from pbrdf.report.pages import image_page
from pbrdf.report.scales import NEVER_VISIBLE_COLOUR, UNKNOWN_COLOUR, colour_bytes

Float = NDArray[np.float64]

NOISE = 0.01
MISSING_PIXELS = 60


@pytest.fixture(scope="module")
def image() -> MuellerImage:
    """A weak polariser with depolarisation: DoLP 0.4 at 30°, D 0.4; a tenth of its pixels are missing."""
    matrix = 0.4 * linear_polariser(np.radians(30.0)) * 2 + 0.6 * np.diag([1.0, 0.4, 0.4, 0.4])
    mueller = np.broadcast_to(matrix.reshape(16, 1, 1), (16, 20, 30)).copy()
    mueller[:, :2] = np.nan
    variance = np.where(np.isnan(mueller), np.nan, NOISE**2)
    summary = {"residual_rms": 0.378, "condition": 34.38, "noise": "residuals"}
    return MuellerImage(200 * mueller, "DN/s", "630 nm, light 000.00°", 200**2 * variance, summary)


def _page(*images: MuellerImage) -> str:
    return image_page("faces", iter(images), calibration_sources={}, provenance={})


def _row(image: MuellerImage, name: str) -> tuple[float, float, float]:
    rows = {row["name"]: row["quartiles"] for row in image_views([image])[0]["quantities"]}
    low, middle, high = rows[name]
    return low, middle, high


def test_figures_are_those_of_the_matrix(image: MuellerImage) -> None:
    assert _row(image, "DoLP") == pytest.approx((0.4, 0.4, 0.4))
    assert _row(image, "diattenuation D") == pytest.approx((0.4, 0.4, 0.4))
    assert _row(image, "standard error of the DoLP")[1] == pytest.approx(NOISE * np.hypot(1, 0.4))
    view = image_views([image])[0]
    assert view["physical_percent"] == 100.0
    assert view["known_percent"] == pytest.approx(90.0)


def test_page_tells_of_what_each_map_is(image: MuellerImage) -> None:
    html = _page(image)
    for words in (
        "light that comes back when unpolarised light falls in",
        "depolarisation power Δ of the matrix",
        "depolarisation index DI of the matrix",
        "here all are",
        "retardance R: by how much the matrix turns",
        "34.38",
        "from the residuals over the whole image",
    ):
        assert words in html, words
    assert html.count("<figcaption>") == 9
    assert NOISE_UNKNOWN not in html


def test_the_same_image_gives_the_same_page(image: MuellerImage) -> None:
    assert _page(image) == _page(image)


def test_share_of_unphysical_matrices_is_told(image: MuellerImage) -> None:
    mueller = np.array(image.mueller)
    mueller[5, 2:, :15] *= 3.0
    html = _page(replace(image, mueller=mueller))
    assert "as for <data" in html
    assert "50\u00a0% of the matrices are physical" in html


def test_page_says_where_the_noise_is_not_known(image: MuellerImage) -> None:
    assert NOISE_UNKNOWN in _page(replace(image, variance=None))


def test_an_image_without_light_has_a_page(image: MuellerImage) -> None:
    dark = replace(image, mueller=np.full((16, 4, 5), np.nan), variance=None)
    assert "no pixel is known" in _page(dark)


def test_shown_figures_are_those_of_the_receipt(image: MuellerImage) -> None:
    summary = {
        "residual_rms": 0.5,
        "predicted_residual_rms": 0.4,
        "condition": 20.0,
        "physical_share": 0.75,
        "missing": {"saturated": 0.125, "hot pixel": 0.0625},
    }
    shown = {
        entry["label"]: (entry["value"], entry["unit"])
        for entry in image_views([replace(image, summary=summary)])[0]["figures"]
    }
    assert shown == {
        "residual of the measured intensities, rms": (0.5, "DN/s"),
        "residual that the noise predicts, rms": (0.4, "DN/s"),
        "condition number of the measurement matrix W (no unit)": (20.0, ""),
        "physical matrices, share when reconstructed": (75.0, "%"),
        "missing pixels: saturated": (12.5, "%"),
        "missing pixels: hot pixel": (6.25, "%"),
    }


def test_only_the_first_images_have_pictures(image: MuellerImage) -> None:
    small = replace(image, mueller=np.array(image.mueller)[:, :4, :4], variance=None)
    views = image_views([small] * (MOST_DRAWN + 2))
    assert [view["pictures"] is not None for view in views] == [True] * MOST_DRAWN + [False] * 2
    html = _page(*[small] * (MOST_DRAWN + 1))
    assert html.count("Not drawn") == 1
    assert html.count("<img") == 9 * MOST_DRAWN


def test_noise_of_a_block_falls_with_its_known_pixels() -> None:
    mueller = np.ones((3, 4, 4, 4))
    mueller[0, 0] = np.nan
    assert block_counts(mueller, 2).tolist() == [[3, 4], [2, 2]]


def test_maps_grey_out_what_is_weak_and_what_is_missing() -> None:
    scale = half_turn("AoLP, °")
    weak = np.array([False, True, False])
    rgba = scale.paint(np.array([10.0, np.nan, np.nan]), ~weak)
    assert np.array_equal(rgba[1], colour_bytes(NEVER_VISIBLE_COLOUR))
    assert np.array_equal(rgba[2], colour_bytes(UNKNOWN_COLOUR))
    assert np.ptp(rgba[0, :3].astype(int)) > 30


def test_words_of_a_map_name_its_range() -> None:
    values = np.linspace(0.0, 1.0, 101)[None]
    drawn = map_picture("DoLP", values, share_scale(values, "DoLP, no unit"))
    assert "from 0.01 to 0.99, half of them above 0.5" in drawn.alt
    assert ElementTree.fromstring(drawn.svg).tag.endswith("svg")


def test_a_map_of_nothing_says_so() -> None:
    nothing = np.full((3, 4), np.nan)
    assert "nothing is known" in map_picture("DoLP", nothing, share_scale(nothing, "DoLP, no unit")).alt


@pytest.mark.parametrize(
    ("values", "ticks"),
    [
        ([164.0, 171.0, 178.0], (160.0, 170.0, 180.0)),
        ([0.0, 90.0, 180.0], (0.0, 30.0, 60.0, 90.0, 120.0, 150.0, 180.0)),
        ([180.0, 180.0], (170.0, 180.0)),
        ([0.0, 0.0], (0.0, 10.0)),
    ],
)
def test_ranges_are_round_and_within_their_ends(values: list[float], ticks: tuple[float, ...]) -> None:
    assert range_scale(np.array(values), 10.0, 180.0, "").ticks == pytest.approx(ticks)


def test_an_eigenvalue_below_zero_has_a_colour_of_its_own() -> None:
    rgba = eigenvalue_scale("").paint(np.array([-1e-3, 0.0]), np.array([True, True]))
    assert np.array_equal(rgba[0], colour_bytes(BELOW_ZERO_COLOUR))
    assert not np.array_equal(rgba[1], colour_bytes(BELOW_ZERO_COLOUR))


def test_axes_that_are_the_same_have_the_same_colour() -> None:
    ring = hues(64)
    assert np.abs(ring[0] - ring[-1]).max() < 0.05
    assert np.abs(np.diff(ring, axis=0)).max() < 0.05
    assert ring.min() > 0.0
    assert ring.max() < 1.0


def test_axes_stay_apart_without_red_or_green_cones() -> None:
    # Viénot, Brettel & Mollon 1999: linear RGB as protanopes and deuteranopes see it
    eight = hues(8)
    linear = np.where(eight <= 0.04045, eight / 12.92, ((eight + 0.055) / 1.055) ** 2.4)
    for matrix in (
        [[0.11238, 0.88762, 0.0], [0.11238, 0.88762, 0.0], [0.00401, -0.00401, 1.0]],
        [[0.29275, 0.70725, 0.0], [0.29275, 0.70725, 0.0], [-0.02234, 0.02234, 1.0]],
    ):
        seen = linear @ np.array(matrix).T
        apart = np.abs(seen[:, None] - seen[None]).max(axis=-1)
        assert apart[~np.eye(8, dtype=np.bool_)].min() > 0.05
