"""Slices become a table: polynomials between lights, whatever the order, and nothing beyond them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.formats.table_data import Origin
from pbrdf.tabulation.axes import Axes, table_axes
from pbrdf.tabulation.band import possible_nodes
from pbrdf.tabulation.merge import merge_band, open_slices
from pbrdf.tabulation.slices import Slice, write_slice

Float = NDArray[np.float64]

AXES = table_axes(9, 10, 13)
BANDS = (450, 550)
RANDOM = np.random.default_rng(1)
OFFSET, SLOPE = RANDOM.normal(size=(2, len(BANDS), 9, 13, 4, 4))


def linear(theta_d: Float) -> Float:
    """Sixteen functions of each band and node, linear in θd; (B, H, …, 4, 4) for θd (H, …, P)."""
    return OFFSET + SLOPE * theta_d[..., None, None]


def slice_at(angle_deg: float, *, waviness_deg: float = 0.4) -> Slice:
    """A slice whose θd is about half the arm's angle, a little different at each node."""
    h, p = np.meshgrid(np.arange(9), np.arange(13), indexing="ij")
    theta_d = np.deg2rad(angle_deg / 2 + waviness_deg * np.sin(h + 2.0 * p))
    mueller = linear(theta_d).astype(np.float32)
    variance = np.full_like(mueller, 0.01 * (1 + angle_deg))
    return Slice(angle_deg, BANDS, mueller, variance, np.ones(mueller.shape[:3], np.uint16), theta_d)


def unseen(part: Slice, band: int, h: int, p: int) -> Slice:
    """The same with one node that the light does not show."""
    mueller, variance, count = part.mueller.copy(), part.variance.copy(), part.count.copy()
    mueller[band, h, p] = variance[band, h, p] = np.nan
    count[band, h, p] = 0
    return replace(part, mueller=mueller, variance=variance, count=count)


def written(folder: Path, *parts: Slice) -> list[Path]:
    paths = [folder / f"{index}.zarr" for index in range(len(parts))]
    for path, part in zip(paths, parts, strict=True):
        write_slice(path, part)
    return paths


@dataclass(frozen=True)
class Merged:
    """Bands together, (B, H, D, P, …)."""

    mueller: NDArray[np.float32]
    variance: NDArray[np.float32]
    count: NDArray[np.uint16]
    origin: NDArray[np.uint8]


def merge_slices(paths: Sequence[str | Path], axes: Axes, source: str, widest_gap: float = np.inf) -> Merged:
    slices = open_slices(paths, axes, source)
    bands = [merge_band(slices, index, axes, widest_gap) for index in range(len(slices[0].bands_nm))]
    names = ("mueller", "variance", "count", "origin")
    return Merged(*(np.stack([getattr(band, name) for band in bands]) for name in names))


def test_between_two_lights_the_table_is_linear(tmp_path: Path) -> None:
    low, high = slice_at(30.0), slice_at(130.0)
    table = merge_slices(written(tmp_path, low, high), AXES, "jade")
    expected = linear(
        np.broadcast_to(AXES.theta_d[:, None, None], (10, 9, 13))[:, None]
    )  # (D, B, H, P, 4, 4)
    inside = (AXES.theta_d > np.deg2rad(15.5)) & (AXES.theta_d < np.deg2rad(64.5))
    assert inside.sum() == 5
    for d in np.flatnonzero(inside):
        np.testing.assert_allclose(table.mueller[:, :, d], expected[d], atol=1e-5)
    outside = (AXES.theta_d < np.deg2rad(14.5)) | (AXES.theta_d > np.deg2rad(65.5))
    assert np.isnan(table.mueller[:, :, outside]).all()
    assert not table.count[:, :, outside].any()


def test_variance_is_that_of_a_weighted_mean(tmp_path: Path) -> None:
    low, high = slice_at(30.0, waviness_deg=0.0), slice_at(130.0, waviness_deg=0.0)
    table = merge_slices(written(tmp_path, low, high), AXES, "jade")
    weight = (40.0 - 15.0) / (65.0 - 15.0)
    expected = (1 - weight) ** 2 * 0.01 * 31 + weight**2 * 0.01 * 131
    np.testing.assert_allclose(table.variance[:, :, 4], expected, rtol=1e-6)


def test_four_lights_tell_a_cubic(tmp_path: Path) -> None:
    """At the ends, where only one stands beyond the two, a quadratic."""
    angles_deg = (20.0, 50.0, 80.0, 110.0, 140.0)
    cubic, square = [], []
    for part in map(slice_at, angles_deg):
        theta_d = part.theta_d[None, :, :, None, None]
        cubic.append(replace(part, mueller=(linear(part.theta_d) + theta_d**3).astype(np.float32)))
        square.append(replace(part, mueller=(linear(part.theta_d) + theta_d**2).astype(np.float32)))
    tables = [
        merge_slices(written(tmp_path / str(power), *parts), AXES, "jade")
        for power, parts in ((3, cubic), (2, square))
    ]
    for power, table, lowest, highest in ((3, tables[0], 25.5, 54.5), (2, tables[1], 10.5, 69.5)):
        inside = (AXES.theta_d > np.deg2rad(lowest)) & (AXES.theta_d < np.deg2rad(highest))
        assert inside.any()
        for d in np.flatnonzero(inside):
            theta_d = np.full((9, 13), AXES.theta_d[d])
            expected = linear(theta_d) + theta_d[..., None, None] ** power
            np.testing.assert_allclose(table.mueller[:, :, d], expected, atol=2e-5)


def test_a_light_that_does_not_see_a_node_is_no_help_for_it(tmp_path: Path) -> None:
    parts = [slice_at(angle_deg) for angle_deg in (20.0, 50.0, 80.0, 110.0)]
    parts[3] = unseen(parts[3], 1, 2, 6)
    table = merge_slices(written(tmp_path, *parts), AXES, "jade")
    between = (AXES.theta_d > np.deg2rad(25.5)) & (AXES.theta_d < np.deg2rad(39.5))
    assert (table.count[0, 2, between, 6] == 4).all()
    assert (table.count[1, 2, between, 6] == 3).all()


def test_the_order_of_the_slices_does_not_matter(tmp_path: Path) -> None:
    paths = written(tmp_path, slice_at(30.0), slice_at(60.0), slice_at(95.0), slice_at(130.0))
    here, there = (
        merge_slices(paths, AXES, "jade"),
        merge_slices([paths[i] for i in (2, 0, 3, 1)], AXES, "jade"),
    )
    for name in ("mueller", "variance", "count", "origin"):
        np.testing.assert_array_equal(getattr(here, name), getattr(there, name))


def test_count_and_origin_tell_what_was_measured(tmp_path: Path) -> None:
    low = unseen(slice_at(30.0), 1, 2, 6)
    table = merge_slices(written(tmp_path, low, slice_at(130.0)), AXES, "jade")
    measured = np.isfinite(table.mueller[..., 0, 0])
    np.testing.assert_array_equal(table.origin == Origin.MEASURED, measured)
    np.testing.assert_array_equal(table.count, np.where(measured, 2, 0))
    # both lights must show a node, each band for itself
    assert measured[0, 2, 4, 6]
    assert not measured[1, 2, 4, 6]
    assert table.origin[1, 2, 4, 6] == Origin.UNSEEN
    assert set(np.unique(table.origin)) == {Origin.NEVER_VISIBLE, Origin.UNSEEN, Origin.MEASURED}


def test_never_visible_is_what_lies_at_and_below_the_horizon() -> None:
    """In whole degrees, nodes in the plane of incidence, across it and at the pole are told exactly."""
    axes = table_axes()
    possible = possible_nodes(axes)
    degrees = np.arange(91)
    # θh = 0: both cosines are cos θd
    np.testing.assert_array_equal(possible[0], np.broadcast_to((degrees < 90)[:, None], (91, 361)))
    # φd = 0 and ±180°: the lower direction stands at θh + θd; θh = j²/90 degrees, exact in ninetieths
    sum_in_90ths = np.arange(91)[:, None] ** 2 + 90 * degrees
    for p in (0, 180, 360):
        np.testing.assert_array_equal(possible[:, :, p], sum_in_90ths < 90 * 90)
    # φd = ±90°: both cosines are cos θh cos θd
    for p in (90, 270):
        np.testing.assert_array_equal(possible[:, :, p], (np.arange(91) < 90)[:, None] & (degrees < 90))


def test_three_quarters_of_the_published_grid_are_possible() -> None:
    assert possible_nodes(table_axes()).mean() == pytest.approx(0.7454, abs=5e-5)


def test_light_and_camera_have_the_same_horizon() -> None:
    possible = possible_nodes(table_axes(31, 31, 73))
    np.testing.assert_array_equal(possible, possible[..., ::-1])
    np.testing.assert_array_equal(possible[..., :-1], np.roll(possible[..., :-1], 36, axis=-1))


def test_a_gap_wider_than_allowed_stays_unseen(tmp_path: Path) -> None:
    paths = written(tmp_path, slice_at(30.0), slice_at(90.0), slice_at(130.0))
    table = merge_slices(paths, AXES, "jade", np.deg2rad(25))
    seen = table.count[0, 0, :, 0] > 0
    np.testing.assert_array_equal(seen, (AXES.theta_d > np.deg2rad(45)) & (AXES.theta_d < np.deg2rad(64.5)))
    assert (table.origin[:, :, 2:4] == Origin.UNSEEN)[:, 1:7].all()


def test_lights_that_do_not_reach_leave_nodes_that_say_so(tmp_path: Path) -> None:
    """Arms from 60° to 100° show θd from 30° to 50°; the rest is possible, and unseen."""
    table = merge_slices(written(tmp_path, slice_at(60.0), slice_at(100.0)), AXES, "jade")
    beyond = (AXES.theta_d < np.deg2rad(29)) | (AXES.theta_d > np.deg2rad(51))
    possible = possible_nodes(AXES)[:, beyond]
    assert (table.origin[:, :, beyond][:, possible] == Origin.UNSEEN).all()
    assert np.isnan(table.mueller[:, :, beyond]).all()


def test_a_node_on_the_last_light_is_measured(tmp_path: Path) -> None:
    low, high = slice_at(60.0, waviness_deg=0.0), slice_at(100.0, waviness_deg=0.0)
    table = merge_slices(
        written(tmp_path, low, replace(high, theta_d=np.full((9, 13), AXES.theta_d[5]))), AXES, "x"
    )
    np.testing.assert_array_equal(table.mueller[:, :, 5], high.mueller)
    assert (table.count[:, :, 5] == 1).all()


def refused(paths: list[Path], axes: Axes = AXES) -> InputError:
    with pytest.raises(InputError) as caught:
        merge_slices(paths, axes, "jade")
    return caught.value


def test_one_light_is_no_table(tmp_path: Path) -> None:
    error = refused(written(tmp_path, slice_at(30.0)))
    assert str(error) == "jade: slices: there are 1; photograph at least two lights"
    assert "there are 0" in str(refused([]))


def test_two_lights_at_one_angle_are_refused(tmp_path: Path) -> None:
    error = refused(written(tmp_path, slice_at(30.0), slice_at(60.0), slice_at(30.0)))
    assert "two have the arm at 30°" in str(error)


def test_lights_of_the_other_side_are_refused(tmp_path: Path) -> None:
    error = refused(written(tmp_path, slice_at(30.0), slice_at(190.0)))
    assert "beyond 180°" in str(error)


def test_a_grid_that_does_not_ascend_is_refused() -> None:
    with pytest.raises(InputError, match="theta_d: does not ascend"):
        Axes(AXES.theta_h, AXES.theta_d[::-1].copy(), AXES.phi_d)


def test_slices_of_other_bands_are_refused(tmp_path: Path) -> None:
    error = refused(written(tmp_path, slice_at(30.0), replace(slice_at(60.0), bands_nm=(450, 600))))
    assert "(450, 600)" in str(error)


@pytest.mark.parametrize("which", [0, 1])
def test_slices_of_other_nodes_are_refused(tmp_path: Path, which: int) -> None:
    """The first one too, which has no other to differ from."""
    parts = [slice_at(30.0), slice_at(60.0)]
    whole = parts[which]
    parts[which] = replace(
        whole,
        mueller=whole.mueller[:, ::2],
        variance=whole.variance[:, ::2],
        count=whole.count[:, ::2],
        theta_d=whole.theta_d[::2],
    )
    paths = written(tmp_path, *parts)
    error = refused(paths)
    assert error.source == str(paths[which])
    assert "(5, 13)" in str(error) and "(9, 13)" in str(error)


def test_a_missing_slice_is_refused(tmp_path: Path) -> None:
    error = refused([*written(tmp_path, slice_at(30.0)), tmp_path / "absent.zarr"])
    assert error.source == str(tmp_path / "absent.zarr")
