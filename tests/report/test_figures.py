from __future__ import annotations

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from pbrdf.formats.table_data import Origin, TableData
from pbrdf.report.coverage_maps import coverage_maps
from pbrdf.report.curves import Curve, against_theta_d
from pbrdf.report.figures import Picture, number, raster
from pbrdf.report.mueller_image import block_means, image_panels, median_diagonal
from pbrdf.report.mueller_panels import compared, normalised_by_first, slice_at
from pbrdf.report.scales import NEVER_VISIBLE_COLOUR, UNKNOWN_COLOUR, colour_bytes, round_up, signed
from pbrdf.report.visibility import coverage, visible_nodes


def _all_pictures(table: TableData) -> list[Picture]:
    shown = slice_at(table, 1, 3)
    filled = np.arange(len(table.theta_d)) > 3
    curve = Curve(0.0, 0.0, table.theta_d, table.mueller[1, 0, :, 12], filled)
    image = np.random.default_rng(0).uniform(0.5, 1.0, (30, 40, 4, 4))
    return [
        *compared(shown, np.asarray(shown.mueller) * 1.1),
        against_theta_d([curve], 550.0, ""),
        coverage_maps(table, 1),
        image_panels(image, "DN", "630 nm"),
    ]


@pytest.fixture(scope="module")
def pictures(table: TableData) -> list[Picture]:
    return _all_pictures(table)


def test_pictures_are_the_same_bytes_again(table: TableData, pictures: list[Picture]) -> None:
    assert [p.svg for p in pictures] == [p.svg for p in _all_pictures(table)]


def test_pictures_do_not_depend_on_the_style_of_the_caller(table: TableData) -> None:
    import matplotlib

    plain = coverage_maps(table, 0).svg
    with matplotlib.rc_context({"font.size": 20, "svg.hashsalt": None, "axes.grid": True}):
        assert coverage_maps(table, 0).svg == plain


def test_pictures_are_well_formed_and_tell_no_time(pictures: list[Picture]) -> None:
    for p in pictures:
        root = ElementTree.fromstring(p.svg)
        assert root.tag.endswith("svg")
        assert b"<dc:date>" not in p.svg
        assert b"Matplotlib" not in p.svg


def test_pictures_have_words_with_figures(pictures: list[Picture]) -> None:
    for p in pictures:
        assert len(p.alt) > 60
        assert re.search(r"\d", p.alt)


def test_words_of_a_slice_name_the_extremes_of_m00(table: TableData) -> None:
    shown = slice_at(table, 1, 3)
    first = shown.known[..., 0, 0]
    alt = compared(shown, None)[0].alt
    assert f"from {number(np.nanmin(first))} to {number(np.nanmax(first))} 1/sr" in alt


def test_difference_of_a_model_with_itself_is_nothing(table: TableData) -> None:
    shown = slice_at(table, 1, 3)
    assert "M00: median 0 %, from 0 to 0 %" in compared(shown, shown.mueller)[2].alt


def test_elements_are_divided_by_m00_which_stays() -> None:
    m = np.arange(1.0, 17.0).reshape(4, 4) * 2
    normalised = normalised_by_first(m)
    assert normalised[0, 0] == 2
    assert normalised[3, 3] == 16


def test_two_greys_tell_invisible_from_unknown() -> None:
    values = np.array([0.0, np.nan, np.nan])
    rgba = signed(1.0, "").paint(values, np.array([True, True, False]))
    assert np.array_equal(rgba[1], colour_bytes(UNKNOWN_COLOUR))
    assert np.array_equal(rgba[2], colour_bytes(NEVER_VISIBLE_COLOUR))
    assert rgba[0, :3].min() > 240


def test_signed_colours_stay_apart_without_red_or_green_cones() -> None:
    # Viénot, Brettel & Mollon 1999: linear RGB as protanopes and deuteranopes see it
    ends = signed(1.0, "").mappable.to_rgba([-1.0, 1.0])[:, :3]
    linear = np.where(ends <= 0.04045, ends / 12.92, ((ends + 0.055) / 1.055) ** 2.4)
    for matrix in (
        [[0.11238, 0.88762, 0.0], [0.11238, 0.88762, 0.0], [0.00401, -0.00401, 1.0]],
        [[0.29275, 0.70725, 0.0], [0.29275, 0.70725, 0.0], [-0.02234, 0.02234, 1.0]],
    ):
        seen = linear @ np.array(matrix).T
        assert np.abs(seen[0] - seen[1]).max() > 0.1


@pytest.mark.parametrize(("value", "limit"), [(0.011, 0.02), (1.0, 1.0), (3.0, 5.0), (51.0, 100.0)])
def test_limits_are_round(value: float, limit: float) -> None:
    assert round_up(value) == pytest.approx(limit)


@pytest.mark.parametrize(
    ("value", "text"),
    [(-0.5, "−0.5"), (100.0, "100"), (1e-9, "1·10⁻⁹"), (float("nan"), "not known"), (1234.5, "1234")],
)
def test_numbers_are_written_for_people(value: float, text: str) -> None:
    assert number(value, 3 if value < 1000 else 4) == text


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (90.35, 5, "90.350"),
        (0.00997, 2, "0.010"),
        (2600.0, 2, "2600"),
        (1234.0, 4, "1234"),
        (3e7, 1, "3·10⁷"),
    ],
)
def test_zeros_that_are_known_are_written(value: float, digits: int, text: str) -> None:
    assert number(value, digits, zeros=True) == text


def test_raster_of_an_even_axis_has_a_pixel_a_node() -> None:
    laid = raster(np.arange(5.0), 91)
    assert laid.nodes.tolist() == [0, 1, 2, 3, 4]
    assert (laid.low, laid.high) == (-0.5, 4.5)


def test_raster_of_an_uneven_axis_shows_the_nearest_node() -> None:
    coordinate = np.array([0.0, 1.0, 10.0])
    laid = raster(coordinate, 11)
    assert laid.nodes.tolist() == [0, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2]


def test_shares_of_origins_add_up_to_the_visible_nodes(table: TableData) -> None:
    covered = coverage(table)
    assert table.origin is not None
    assert sum(covered.origins.values()) == pytest.approx(1.0)
    assert covered.visible == np.count_nonzero(table.origin != Origin.NEVER_VISIBLE)
    assert covered.headline == (covered.origins[Origin.MEASURED], "measured")
    assert covered.origins[Origin.MEASURED] == pytest.approx(
        np.count_nonzero(table.origin == Origin.MEASURED) / covered.visible
    )


def test_geometry_tells_the_visible_nodes_where_no_origin_does(table: TableData) -> None:
    bare = replace(table, origin=None, count=None)
    assert np.array_equal(visible_nodes(bare, 0), visible_nodes(table, 0))
    assert coverage(bare).headline[1] == "known"


def test_three_quarters_of_the_published_grid_are_visible() -> None:
    quadratic = (np.arange(91) / 90) ** 2 * np.pi / 2
    grid = (1, 91, 91, 361)
    table = TableData(
        "published",
        np.array([550.0]),
        quadratic,
        np.radians(np.arange(91.0)),
        np.radians(np.arange(-180.0, 181.0)),
        np.broadcast_to(np.float32(0), (*grid, 4, 4)),
    )
    share = coverage(table).visible / np.prod(grid)
    assert share == pytest.approx(0.7454, abs=0.002)


def test_blocks_average_known_pixels_only() -> None:
    image = np.ones((3, 2, 4, 4))
    image[0, 0] = np.nan
    image[0, 1] = 5.0
    image[2] = np.nan
    means = block_means(image, 2)
    assert means.shape == (2, 1, 4, 4)
    assert means[0, 0, 0, 0] == pytest.approx(7 / 3)
    assert np.isnan(means[1, 0]).all()


def test_median_diagonal_is_that_of_the_ratios() -> None:
    image = np.zeros((2, 3, 4, 4))
    image[...] = np.diag([2.0, 1.0, -0.5, -0.25])
    assert median_diagonal(image) == (1.0, 0.5, -0.25, -0.125)
