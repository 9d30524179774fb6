"""Which nodes stand for a table: thinned or averaged, weighed, some held out."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from made_tables import TRUTH, largest_error, made_table
from numpy.typing import NDArray

import pbrdf
from pbrdf.errors import InputError
from pbrdf.fitting.nodes import hold_out, select_nodes
from pbrdf.fitting.solid_angle import cell_weights
from pbrdf.formats.table_data import Origin
from pbrdf.optics.rusinkiewicz import directions
from pbrdf.tabulation.axes import table_axes

Float = NDArray[np.float64]


def test_every_nth_node_of_each_direction_axis_is_looked_at() -> None:
    table = made_table()
    nodes = select_nodes(table, 4)
    assert set(np.unique(nodes.indices % 4)) == {0}
    h, d, p = nodes.indices.T
    np.testing.assert_array_equal(nodes.mueller, table.mueller[:, h, d, p])
    light, camera = directions(table.theta_h[h], table.theta_d[d], table.phi_d[p])
    np.testing.assert_array_equal(nodes.to_light, light)
    np.testing.assert_array_equal(nodes.to_camera, camera)
    assert pbrdf.fit(table).residuals.nodes == (len(h),) * 3
    assert len(h) < len(select_nodes(table, 1).indices) / 30


def test_only_measured_nodes_above_the_horizon_count() -> None:
    table = made_table()
    origin = np.full(table.mueller.shape[:4], Origin.MEASURED, np.uint8)
    origin[:, :, 8:] = Origin.INPAINTED
    origin[1, 4:] = Origin.MIRRORED
    table.mueller[2, :, :, 20, 3, 3] = np.nan
    nodes = select_nodes(dataclasses.replace(table, origin=origin), 1)
    h, d, p = nodes.indices.T
    assert d.min() == 1
    assert d.max() == 7
    assert nodes.to_light[:, 2].min() > 0
    assert nodes.to_camera[:, 2].min() > 0
    np.testing.assert_array_equal(nodes.weight, [np.ones(len(h)), h < 4, p != 20])


@pytest.mark.parametrize("sizes", [(91, 91, 361), (12, 16, 25), (7, 5, 9)])
@pytest.mark.parametrize("step", [1, 4])
def test_solid_angle_weights_sum_to_all_pairs_of_directions(sizes: tuple[int, int, int], step: int) -> None:
    axes = table_axes(*sizes)
    every = (axes.theta_h, axes.theta_d, axes.phi_d)
    weights = cell_weights(every, tuple(np.arange(0, len(axis), step) for axis in every))
    assert weights.sum() == pytest.approx(4 * np.pi, rel=1e-12)
    assert weights.min() > 0


def test_solid_angle_weights_integrate_like_a_fine_grid() -> None:
    """The share of pairs of directions with both above the horizon: known from random directions."""
    random = np.random.default_rng(5)
    theta_h, theta_d = (
        np.arccos(random.uniform(size=200_000)),
        np.arcsin(np.sqrt(random.uniform(size=200_000))),
    )
    light, camera = directions(theta_h, theta_d, random.uniform(-np.pi, np.pi, 200_000))
    expected = np.mean((light[:, 2] > 0) & (camera[:, 2] > 0))
    axes = table_axes()
    every = (axes.theta_h, axes.theta_d, axes.phi_d)
    weights = cell_weights(every, tuple(np.arange(len(axis)) for axis in every))
    light, camera = directions(*np.meshgrid(*every, indexing="ij"))
    found = weights[(light[..., 2] > 0) & (camera[..., 2] > 0)].sum() / weights.sum()
    assert found == pytest.approx(expected, abs=0.005)


def test_solid_angle_weights_turn_the_fit_toward_large_angles() -> None:
    nodes = select_nodes(made_table(), 1, solid_angle=True)
    assert nodes.weight[0].mean() == pytest.approx(1.0)
    highlight = nodes.indices[:, 0] < 4
    assert nodes.weight[0, highlight].mean() < 0.2
    assert largest_error(pbrdf.fit(made_table(), downsample=1, solid_angle=True)) < 1e-4


def test_a_block_is_the_mean_of_its_measured_nodes_by_their_variance() -> None:
    table = made_table(noise=0.1)
    assert table.variance is not None
    random = np.random.default_rng(2)
    table.variance[:] = random.uniform(0.5, 2.0, table.variance.shape)
    table.mueller[:, 5, 6, 9] = np.nan
    table.mueller[2, 4, 4, 8] = np.nan
    nodes = select_nodes(table, 4, blocks=True)
    one = np.flatnonzero((nodes.indices == (4, 4, 8)).all(axis=1)).item()
    assert nodes.variance is not None

    block = np.ix_(range(3), range(4, 8), range(4, 8), range(8, 12))
    mueller, variance = table.mueller[block].astype(float), table.variance[block].astype(float)
    weight = 1 / variance.mean(axis=(0, 4, 5))
    weight[np.isnan(mueller).any(axis=(0, 4, 5))] = 0.0
    assert np.count_nonzero(weight == 0) >= 2
    weight /= weight.sum()
    mueller[:, weight == 0] = 0.0
    np.testing.assert_allclose(
        nodes.mueller[:, one], np.einsum("hdp,bhdpij->bij", weight, mueller), rtol=1e-5, atol=1e-7
    )
    np.testing.assert_allclose(
        nodes.variance[:, one], np.einsum("hdp,bhdpij->bij", weight**2, variance), rtol=1e-5
    )
    angles = np.meshgrid(table.theta_h[4:8], table.theta_d[4:8], table.phi_d[8:12], indexing="ij")
    light, camera = directions(*((weight * angle).sum() for angle in angles))
    np.testing.assert_allclose(nodes.to_light[one], light, atol=1e-12)
    np.testing.assert_allclose(nodes.to_camera[one], camera, atol=1e-12)


def test_a_band_that_a_block_lacks_altogether_does_not_touch_the_others() -> None:
    table = made_table()
    table.mueller[1, 4:8, 4:8, 8:12] = np.nan
    nodes = select_nodes(table, 4, blocks=True)
    one = np.flatnonzero((nodes.indices == (4, 4, 8)).all(axis=1)).item()
    np.testing.assert_array_equal(nodes.weight[:, one], [1, 0, 1])


def test_block_means_use_all_nodes_where_thinning_uses_few() -> None:
    """Where noise is what is left over, 27 nodes for one pull five times less."""
    matt = [{"alpha": 0.8, "eta": 1.5, "specular": 0.1, "albedo": 0.8}]
    table = made_table(matt, noise=1.0, shape=(31, 31, 61))
    errors = {}
    for thinning in ("nodes", "blocks"):
        albedo = pbrdf.fit(table, downsample=3, thinning=thinning).parameters[3]
        (errors[thinning],) = albedo.standard_errors
    assert errors["blocks"] / errors["nodes"] == pytest.approx(27**-0.5, rel=0.25)


def test_blocks_bend_a_surface_and_nodes_do_not() -> None:
    """Blocks of 6°: a known price, to be weighed against the noise of single nodes."""
    table = made_table(shape=(31, 31, 61))
    assert largest_error(pbrdf.fit(table, downsample=2)) < 1e-4
    found = pbrdf.fit(table, downsample=2, thinning="blocks").band(1)
    assert found["alpha"] == pytest.approx(TRUTH[1]["alpha"], rel=0.01)
    assert 0.01 < abs(found["eta"] - TRUTH[1]["eta"]) < 0.06


def test_every_tenth_slab_is_held_out_whole() -> None:
    nodes = select_nodes(made_table(shape=(16, 31, 33)), 1)
    parts = hold_out(nodes)
    assert parts is not None
    kept, held = parts
    # θd = 0 is never looked at: the first slab is the second node of the axis
    assert set(held.indices[:, 1]) == {6, 16, 26}
    assert set(kept.indices[:, 1]) == set(range(1, 31)) - {6, 16, 26, 30}
    assert len(kept.indices) + len(held.indices) == len(nodes.indices)


def test_variances_are_demanded_where_they_are_needed() -> None:
    with pytest.raises(InputError, match="made: variance: is not in the table"):
        select_nodes(made_table(), 1, with_variance=True)
    table = made_table(noise=0.1)
    assert table.variance is not None
    table.variance[:, :8] = 0.0
    assert select_nodes(table, 1, with_variance=True).indices[:, 0].min() == 8
