"""Filling: the two symmetries copy exactly, the rest is inpainted, and what was measured stays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from pbrdf.errors import InputError
from pbrdf.formats.table_data import Origin, TableData
from pbrdf.models import MODELS
from pbrdf.optics.frames import angle_between, change_frames, table_axis
from pbrdf.optics.rusinkiewicz import cosines, directions
from pbrdf.tabulation.axes import table_axes
from pbrdf.tabulation.band import possible_nodes
from pbrdf.tabulation.fill import fill, measured_only

Float = NDArray[np.float64]
Mask = NDArray[np.bool_]

NODES = (16, 16, 37)
AXES = table_axes(*NODES)
PLASTIC = {"alpha": 0.3, "eta": 1.5, "specular": 0.8, "albedo": 0.5}
METAL = {"alpha": 0.2, "eta": 0.35, "kappa": 2.7, "specular": 1.0, "albedo": 0.0}
POSSIBLE = possible_nodes(AXES)


def model_table(material: dict[str, float], nodes: tuple[int, int, int] = NODES) -> TableData:
    """A complete table of one band, with a variance that differs from element to element."""
    axes = table_axes(*nodes)
    # at θd = 0 the frames are those of the limit, which turn with φd
    grid = np.meshgrid(axes.theta_h, np.maximum(axes.theta_d, 1e-6), axes.phi_d, indexing="ij")
    possible = possible_nodes(axes)
    mueller = MODELS["baek2018"].evaluate(*directions(*grid), material)[None].astype(np.float32)
    mueller[:, ~possible] = np.nan
    mueller[:, :, :, -1] = mueller[:, :, :, 0]
    variance = 1.0 + np.arange(mueller.size, dtype=np.float32).reshape(mueller.shape)
    variance[:, ~possible] = np.nan
    origin = np.where(possible, Origin.MEASURED, Origin.NEVER_VISIBLE).astype(np.uint8)[None]
    wavelengths = np.array([550.0])
    return TableData(
        "model",
        wavelengths,
        axes.theta_h,
        axes.theta_d,
        axes.phi_d,
        mueller,
        variance=variance,
        origin=origin,
    )


def hidden(table: TableData, hide: Mask) -> TableData:
    """The same table as if the nodes `hide` (H, D, P) had not been photographed.

    At θh = 0, which one photograph shows for all φd, all are hidden or none; so are φd = −π and π.
    """
    hide = hide.copy()
    hide[0] = hide[0].all(axis=-1, keepdims=True)
    hide[..., 0] = hide[..., -1] = hide[..., 0] & hide[..., -1]
    assert table.variance is not None and table.origin is not None
    mueller, variance, origin = table.mueller.copy(), table.variance.copy(), table.origin.copy()
    take = hide & (origin[0] == Origin.MEASURED)
    mueller[0, take] = variance[0, take] = np.nan
    origin[0, take] = Origin.UNSEEN
    return replace(table, mueller=mueller, variance=variance, origin=origin)


def everywhere(condition: Mask) -> Mask:
    return np.broadcast_to(condition, NODES)


def relative_error(found: NDArray[np.float32], truth: NDArray[np.float32]) -> Float:
    """Largest error of the elements of (n, 4, 4) in units of M00."""
    error: Float = (np.abs(found - truth) / truth[:, :1, :1]).max(axis=(1, 2)).astype(np.float64)
    return error


@pytest.mark.parametrize("material", [PLASTIC, METAL], ids=["plastic", "metal"])
def test_the_mirror_image_is_copied_exactly(material: dict[str, float]) -> None:
    whole = model_table(material)
    filled = fill(hidden(whole, everywhere(AXES.phi_d < 0)), 1.0)
    assert filled.origin is not None and filled.variance is not None and whole.variance is not None
    copied = filled.origin[0] == Origin.MIRRORED
    np.testing.assert_array_equal(copied[1:], (POSSIBLE & (AXES.phi_d < 0) & (AXES.phi_d > -np.pi))[1:])
    assert relative_error(filled.mueller[0][copied], whole.mueller[0][copied]).max() < 1e-6
    np.testing.assert_array_equal(filled.variance[0][copied], whole.variance[0][..., ::-1, :, :][copied])


@pytest.mark.parametrize("material", [PLASTIC, METAL], ids=["plastic", "metal"])
def test_light_and_camera_exchanged_are_copied_exactly(material: dict[str, float]) -> None:
    """Half of the azimuths hidden together with their mirror images: exchange alone can tell them."""
    whole = model_table(material)
    half = everywhere(np.abs(AXES.phi_d) > np.pi / 2 + 1e-6)
    filled = fill(hidden(whole, half), 1.0)
    assert filled.origin is not None and filled.variance is not None and whole.variance is not None
    copied = filled.origin[0] == Origin.RECIPROCAL
    np.testing.assert_array_equal(copied[1:], (POSSIBLE & half)[1:])
    assert relative_error(filled.mueller[0][copied], whole.mueller[0][copied]).max() < 1e-6
    opposite = (np.arange(37) + 18) % 36
    transposed = np.swapaxes(whole.variance[0][:, :, opposite], -1, -2)
    np.testing.assert_array_equal(filled.variance[0][copied], transposed[copied])


def test_three_quarters_of_the_azimuths_follow_from_one() -> None:
    whole = model_table(METAL)
    quarter = (AXES.phi_d >= -1e-9) & (AXES.phi_d <= np.pi / 2 + 1e-9)
    filled = fill(hidden(whole, everywhere(~quarter)), 1.0)
    assert filled.origin is not None
    assert not np.isin(filled.origin, (Origin.UNSEEN, Origin.INPAINTED)).any()
    assert relative_error(filled.mueller[0][POSSIBLE], whole.mueller[0][POSSIBLE]).max() < 1e-6


def test_without_opposite_nodes_nothing_is_exchanged() -> None:
    nodes = (8, 8, 36)
    whole = model_table(PLASTIC, nodes)
    azimuth = table_axes(*nodes).phi_d
    filled = fill(hidden(whole, np.broadcast_to(np.abs(azimuth) > np.pi / 2, nodes)), 1.0)
    assert filled.origin is not None
    assert not (filled.origin == Origin.RECIPROCAL).any()


def scattered_gaps(share: float) -> Mask:
    return np.random.default_rng(1).uniform(size=NODES) < share


@pytest.mark.parametrize("share", [0.1, 0.9])
def test_what_was_measured_stays_and_everything_possible_is_filled(share: float) -> None:
    table = hidden(model_table(PLASTIC), scattered_gaps(share))
    before = table.mueller.copy()
    filled = fill(table, 1.0)
    assert table.origin is not None and filled.origin is not None
    measured = table.origin == Origin.MEASURED
    measured[:, 0] = False  # where rounding differs between azimuths that are one measurement
    np.testing.assert_array_equal(filled.mueller[measured], table.mueller[measured])
    np.testing.assert_allclose(filled.mueller[0, 0], table.mueller[0, 0], atol=1e-7)
    np.testing.assert_array_equal(filled.origin[measured], table.origin[measured])
    np.testing.assert_array_equal(np.isfinite(filled.mueller[0]).all(axis=(-1, -2)), POSSIBLE)
    np.testing.assert_array_equal(filled.origin[0] == Origin.NEVER_VISIBLE, ~POSSIBLE)
    assert not (filled.origin == Origin.UNSEEN).any()
    # and the table that was given is left as it was
    np.testing.assert_array_equal(table.mueller, before)


def test_a_handful_of_nodes_fills_a_table() -> None:
    """However far the nearest known node is, some Gaussian reaches it."""
    keep = np.zeros(NODES, dtype=bool)
    keep[2, 3, 20] = keep[8, 3, 1] = True
    filled = fill(hidden(model_table(PLASTIC), ~keep), 1.0)
    np.testing.assert_array_equal(np.isfinite(filled.mueller[0]).all(axis=(-1, -2)), POSSIBLE)


def test_nothing_known_stays_nothing_known() -> None:
    filled = fill(hidden(model_table(PLASTIC), np.ones(NODES, dtype=bool)), 1.0)
    assert filled.origin is not None
    np.testing.assert_array_equal(filled.origin[0] == Origin.UNSEEN, POSSIBLE)
    assert np.isnan(filled.mueller).all()


def test_inpainted_nodes_have_no_variance() -> None:
    filled = fill(hidden(model_table(PLASTIC), everywhere((AXES.theta_d < 0.2)[:, None])), 1.0)
    assert filled.origin is not None and filled.variance is not None
    inpainted = filled.origin == Origin.INPAINTED
    assert inpainted.any()
    assert np.isnan(filled.variance[inpainted]).all()


def test_a_constant_table_stays_constant() -> None:
    table = hidden(model_table(PLASTIC), everywhere((AXES.theta_d < 0.3)[:, None]))
    # the only kind of matrix that frames at θd = 0, which turn with φd, leave constant
    matrix = np.diag([0.25, 0.1, -0.1, 0.2]).astype(np.float32)
    constant = np.where(np.isfinite(table.mueller), matrix, np.float32(np.nan))
    filled = fill(replace(table, mueller=constant), 1.0)
    expected = np.broadcast_to(matrix, (POSSIBLE.sum(), 4, 4))
    np.testing.assert_allclose(filled.mueller[0][POSSIBLE], expected, atol=1e-6)


def test_filling_knows_no_first_azimuth() -> None:
    """All azimuths of some θd are hidden: symmetries tell nothing, and a turn may come before or after."""
    table = hidden(model_table(PLASTIC), everywhere((AXES.theta_d < 0.3)[:, None]))
    filled = fill(table, 1.5)
    np.testing.assert_allclose(filled.mueller[:, :, :, 0], filled.mueller[:, :, :, -1], rtol=1e-5, atol=1e-7)

    def turned(array: NDArray[np.float32]) -> NDArray[np.float32]:
        around = np.roll(array[:, :, :, :-1], 7, axis=3)
        return np.concatenate([around, around[:, :, :, :1]], axis=3)

    # turned azimuths mean other angles: make the horizon and the gaps the same for all of them
    low = everywhere(((AXES.theta_h[:, None] + AXES.theta_d) < np.pi / 2 - 1e-6)[..., None])
    origin = np.where(low, table.origin, Origin.NEVER_VISIBLE).astype(np.uint8)
    mueller = np.where(low[None, ..., None, None], table.mueller, np.float32(np.nan))
    start = replace(table, mueller=mueller, origin=origin)
    first = fill(start, 1.5).mueller
    second = fill(replace(start, mueller=turned(mueller)), 1.5).mueller
    np.testing.assert_allclose(second, turned(first), rtol=1e-4, atol=1e-6)


def test_bands_are_filled_each_from_itself() -> None:
    one, other = (hidden(model_table(m), everywhere((AXES.theta_d < 0.3)[:, None])) for m in (PLASTIC, METAL))
    assert one.variance is not None and one.origin is not None
    both = replace(
        one,
        wavelengths_nm=np.array([450.0, 550.0]),
        mueller=np.concatenate([one.mueller, other.mueller]),
        variance=np.concatenate([one.variance, one.variance]),
        origin=np.concatenate([one.origin, one.origin]),
    )
    filled = fill(both, 1.0)
    np.testing.assert_array_equal(filled.mueller[0], fill(one, 1.0).mueller[0])
    np.testing.assert_array_equal(filled.mueller[1], fill(other, 1.0).mueller[0])


GOLD = {"alpha": 0.15, "eta": 0.183, "kappa": 3.43, "specular": 1.0, "albedo": 0.0}
FINE = (23, 91, 181)
"""Steps of θd as in the published tables, of φd twice as wide, and every fourth θh."""


def judged(material: dict[str, float], noise: float) -> tuple[Float, Float]:
    """Errors at hidden nodes with θd below 10° of a table that is known: of the fill, of the nearest node."""
    whole = model_table(material, FINE)
    low = np.broadcast_to((whole.theta_d < np.deg2rad(9.9))[:, None], FINE)
    drawn = np.random.default_rng(2).normal(size=whole.mueller.shape)
    drawn[:, :, :, -1] = drawn[:, :, :, 0]
    seen = (whole.mueller + noise * drawn * whole.mueller[..., :1, :1]).astype(np.float32)
    gaps = hidden(replace(whole, mueller=seen), low)
    nearest = distance_transform_edt(
        ~np.isfinite(gaps.mueller[0, ..., 0, 0]), return_distances=False, return_indices=True
    )
    take = low & np.isfinite(whole.mueller[0, ..., 0, 0])
    truth = whole.mueller[0][take]
    filled, copied = fill(gaps, 1.5).mueller[0][take], gaps.mueller[0][tuple(nearest)][take]
    return relative_error(filled, truth), relative_error(copied, truth)


@pytest.mark.parametrize(
    ("material", "median", "ninth"), [(PLASTIC, 0.0005, 0.01), (GOLD, 0.002, 0.02)], ids=["plastic", "gold"]
)
def test_hidden_retro_reflection_is_found_again(
    material: dict[str, float], median: float, ninth: float
) -> None:
    """Without noise, where to copy the nearest node is no bad idea: beaten five times over."""
    filled, copied = judged(material, 0.0)
    assert np.median(filled) < median
    assert np.quantile(filled, 0.9) < ninth
    assert np.median(filled) < 0.2 * np.median(copied)
    assert np.quantile(filled, 0.9) < 0.5 * np.quantile(copied, 0.9)


@pytest.mark.parametrize("material", [PLASTIC, GOLD], ids=["plastic", "gold"])
def test_the_fill_averages_noise(material: dict[str, float]) -> None:
    filled, copied = judged(material, 0.02)
    assert np.median(filled) < 0.6 * np.median(copied)
    assert np.quantile(filled, 0.9) < 0.6 * np.quantile(copied, 0.9)


def test_grazing_angles_are_extrapolated_better_than_copied() -> None:
    """All that no table of photographs holds: light or camera lower than 80° from the normal."""
    for material in (PLASTIC, GOLD):
        whole = model_table(material, FINE)
        cos_light, cos_camera = cosines(whole.theta_h[:, None, None], whole.theta_d[:, None], whole.phi_d)
        grazing = np.minimum(cos_light, cos_camera) < np.cos(np.deg2rad(80))
        gaps = hidden(whole, grazing)
        nearest = distance_transform_edt(
            ~np.isfinite(gaps.mueller[0, ..., 0, 0]), return_distances=False, return_indices=True
        )
        take = grazing & np.isfinite(whole.mueller[0, ..., 0, 0])
        truth = whole.mueller[0][take]
        filled = relative_error(fill(gaps, 1.5).mueller[0][take], truth)
        copied = relative_error(gaps.mueller[0][tuple(nearest)][take], truth)
        assert np.median(filled) < 0.7 * np.median(copied)
        assert np.quantile(filled, 0.9) < np.quantile(copied, 0.9)


def test_filled_retro_reflection_is_one_matrix_in_turning_frames() -> None:
    """θd = 0: light and camera coincide, so that φd only turns the frames (their limit, L × V)."""
    filled = fill(hidden(model_table(METAL), everywhere((AXES.theta_d < 0.2)[:, None])), 1.0).mueller[0, :, 0]
    light, camera = directions(0.3, 1e-7, AXES.phi_d)
    first, s = table_axis(light[18], camera[18]), table_axis(light, camera)
    angle_in, angle_out = angle_between(first, s, -light), angle_between(first, s, camera)
    for h in range(NODES[0] - 1):
        expected = change_frames(filled[h, 18], angle_in, angle_out)
        np.testing.assert_allclose(filled[h], expected, atol=2e-6 * filled[h, 18, 0, 0] + 1e-7)


def test_filled_nodes_of_theta_h_zero_are_one_matrix() -> None:
    hide = scattered_gaps(0.5)
    hide[0] = True
    filled = fill(hidden(model_table(METAL), hide), 1.0).mueller[0, 0]
    np.testing.assert_allclose(filled[:-1], np.broadcast_to(filled[:-1, :1], filled[:-1].shape), rtol=1e-6)


def test_azimuths_that_do_not_close_are_refused() -> None:
    whole = model_table(PLASTIC)
    open_table = replace(
        whole,
        phi_d=whole.phi_d[:-1],
        mueller=whole.mueller[:, :, :, :-1],
        variance=None,
        origin=whole.origin[:, :, :, :-1],  # type: ignore[index]
    )
    with pytest.raises(InputError, match="phi_d: does not run evenly around"):
        fill(open_table, 1.0)


def test_the_raw_table_holds_measured_nodes_alone() -> None:
    table = hidden(model_table(PLASTIC), everywhere(AXES.phi_d < 0) | scattered_gaps(0.3))
    raw = measured_only(fill(table, 1.0))
    np.testing.assert_array_equal(raw.mueller[:, 1:], table.mueller[:, 1:])
    np.testing.assert_allclose(raw.mueller[:, 0], table.mueller[:, 0], atol=1e-7)
    np.testing.assert_array_equal(raw.origin, table.origin)


def test_a_table_that_does_not_tell_origins_is_raw_already() -> None:
    table = replace(model_table(PLASTIC), origin=None)
    assert measured_only(table) is table
