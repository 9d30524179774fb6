"""The supplement's way of tabulating, beside slices, and what its slips do to it."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Collection
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from pbrdf._kernels import render

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.sphere import Sphere
from pbrdf.errors import InputError
from pbrdf.formats.table_data import Origin
from pbrdf.models import MODELS
from pbrdf.optics.arm import Arm
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.optics.rusinkiewicz import cosines, directions
from pbrdf.reconstruction.noise import NoiseModel
from pbrdf.reconstruction.reduction import data_reduction
from pbrdf.tabulation.axes import table_axes
from pbrdf.tabulation.band import Band
from pbrdf.tabulation.inverse_map import Slip, paper_axes, turn_angle, turn_angles_of
from pbrdf.tabulation.paper import make_share
from pbrdf.tabulation.sampling import make_slice
from pbrdf.tabulation.shares import Share, ShareFile, merge_shares, open_shares, write_share
from pbrdf.tabulation.view import BandImage, Viewpoint

AXES = table_axes(16, 16, 37)
PLASTIC = {"alpha": 0.4, "eta": 1.5, "kappa": 0.0, "specular": 0.5, "albedo": 0.5}
PIXELS, RADIUS, GRAZING_DEG = 240, 25.0, 75.0
FAR, NEAR = 1e6, 400.0
MIDDLE = 45.0
"""Angle of an arm near which a light has bins, however close others stand."""
HIT = 7
"""A node of θd; a far light at twice its angle shows it everywhere."""

STATES_DEG = [[0.0, 25.0 * n, 5.0 * n, 90.0] for n in range(36)]
NOISE = NoiseModel(
    data_reduction(Polarimeter(1.55, 1.6), STATES_DEG, "test"), np.array([1.0]), np.inf, 0.002, 0.01, 4
)


def viewpoint(angle_deg: float, distance: float) -> Viewpoint:
    focal = 0.45 * PIXELS * distance / RADIUS
    camera = Camera((focal, focal), (PIXELS / 2 - 0.3, PIXELS / 2 + 0.2), PIXELS, PIXELS)
    centre = (0.0, 0.0, distance)
    arm = Arm(centre, (0.0, -1.0, 0.0), (0.0, 0.0, -1.0), 0.8 * distance, (0.0, -0.96, 0.28))
    return Viewpoint(camera, Sphere(centre, RADIUS), arm, angle_deg, (0.28, -0.96, 0.0))


def image(view: Viewpoint) -> BandImage:
    scene = render.SphereScene(
        np.array(view.sphere.centre_mm),
        RADIUS,
        view.light_mm,
        view.arm.generator_x(view.angle_deg),
        np.array(view.analyser_axis),
    )
    pinhole = render.Pinhole(*view.camera.focal_px, *view.camera.principal_px)
    found = render.render_mueller(pinhole, scene, tuple(PLASTIC.values()), PIXELS, PIXELS, 1)
    # as bright from afar as from a metre
    bright = np.linalg.norm(view.light_mm - view.sphere.centre_mm) ** 2 * 1e-6
    mueller = np.ascontiguousarray(np.moveaxis(np.asarray(found), -1, 0)) * np.float32(bright)
    return BandImage(mueller, np.full_like(mueller, 1e-6), (0, 0), NOISE, float(bright))


def share_of(
    angle_deg: float,
    angles_deg: Collection[float],
    distance: float,
    slips: Collection[Slip] = (),
    widest_gap: float = np.inf,
) -> Share:
    view = viewpoint(angle_deg, distance)
    return make_share(view, sorted(angles_deg), [(550, image(view))], AXES, GRAZING_DEG, widest_gap, slips)


def truth(share: Share) -> NDArray[np.float64]:
    grid = np.unravel_index(share.nodes, share.shape)
    axes = (AXES.theta_h, AXES.theta_d, AXES.phi_d)
    return MODELS["baek2018"].evaluate(
        *directions(*(axis[index] for axis, index in zip(axes, grid, strict=True))), PLASTIC
    )


def errors(share: Share) -> NDArray[np.float64]:
    known = share.count[0] > 0
    expected = truth(share)[known]
    off: NDArray[np.float64] = np.abs(share.mueller[0, known] - expected).max(axis=(1, 2)) / expected[:, 0, 0]
    return off


def merged(folder: Path, *shares: Share) -> Band:
    for share in shares:
        write_share(folder / f"{share.angle_deg:06.2f}.zarr", share)
    return merge_shares(open_shares(sorted(folder.iterdir()), AXES, "test"), 0, AXES)


def test_bins_whose_light_is_hit_agree_with_slices(tmp_path: Path) -> None:
    angle_deg = float(np.degrees(2 * AXES.theta_d[HIT]))
    share = share_of(angle_deg, [angle_deg - 12, angle_deg, angle_deg + 12], FAR)
    view = viewpoint(angle_deg, FAR)
    part = make_slice(view, [(550, image(view))], AXES, GRAZING_DEG)
    table = merged(tmp_path, share)
    mueller, variance, count = table.mueller, table.variance, table.count
    both = (count[:, HIT] > 0) & (part.count[0] > 0)
    assert both.sum() > 300
    assert (np.unravel_index(share.nodes, share.shape)[1] == HIT).all()
    off = np.abs(mueller[:, HIT] - part.mueller[0])[both].max(axis=(1, 2)) / part.mueller[0][both][:, 0, 0]
    # bilinear between pixels, against a quadratic through many
    assert np.median(off) < 5e-4
    assert np.quantile(off, 0.9) < 3e-3
    assert np.isfinite(variance[:, HIT][both]).all()
    # the mean of four pixels, where a slice may have more
    assert np.median(variance[:, HIT][both][:, 0, 0] / part.variance[0][both][:, 0, 0]) > 0.5


def test_a_share_is_the_material_where_its_light_is_near() -> None:
    """At finite distances: lights 2° apart miss a bin's θt by up to 1°."""
    share = share_of(44.0, [42.0, 44.0, 46.0], NEAR)
    assert len(share.nodes) > 100
    assert np.median(errors(share)) < 0.01


def test_every_bin_goes_to_one_light(tmp_path: Path) -> None:
    angles = [40.0, 46.0, 52.0, 58.0]
    shares = [share_of(angle, angles, NEAR) for angle in angles]
    taken = np.concatenate([share.nodes for share in shares])
    assert len(np.unique(taken)) == len(taken)
    table = merged(tmp_path, *shares)
    count = table.count
    np.testing.assert_array_equal(np.isfinite(table.mueller[..., 0, 0]), count > 0)
    np.testing.assert_array_equal(table.origin == Origin.MEASURED, count > 0)
    grid = np.meshgrid(AXES.theta_h, AXES.theta_d, AXES.phi_d, indexing="ij")
    limit = np.cos(np.deg2rad(GRAZING_DEG))
    possible = np.logical_and(*(cosine > limit for cosine in cosines(*grid)))
    assert not (count[~possible] > 0).any()
    # 48° and 54° are twice a node of θd: there about all bins are seen
    seen = (count > 0)[:, 4:5][possible[:, 4:5]]
    assert 0.5 < seen.mean() < 1


def test_bins_too_far_from_every_light_are_left_out() -> None:
    wide = share_of(44.0, [44.0], NEAR)
    narrow = share_of(44.0, [44.0], NEAR, widest_gap=np.radians(3.0))
    assert 0 < len(narrow.nodes) < 0.3 * len(wide.nodes)
    assert set(narrow.nodes) <= set(wide.nodes)


@pytest.mark.parametrize(("slip", "step_deg"), [("camera", 2.0), ("light", 0.2)])
def test_a_slip_sends_bins_to_the_wrong_light(slip: Slip, step_deg: float) -> None:
    """Rightly, none need be more than half a step of the lights from what a bin asks for."""
    angles = [MIDDLE + step_deg * n for n in range(-3, 4)]
    inner = off_deg(share_of(MIDDLE, angles, NEAR))
    assert inner.max() <= step_deg / 2 + 1e-9
    assert off_deg(share_of(MIDDLE, angles, NEAR, [slip])).max() > 1.2 * step_deg / 2


def off_deg(share: Share) -> NDArray[np.float64]:
    """How far the light's θt is from that of each bin of its share, degrees."""
    view = viewpoint(share.angle_deg, NEAR)
    (theirs,), (distance,) = turn_angles_of(view.sphere, view.light_mm[None])
    grid = np.unravel_index(share.nodes, share.shape)
    bins = AXES.theta_h[grid[0]], AXES.theta_d[grid[1]], AXES.phi_d[grid[2]]
    off: NDArray[np.float64] = np.degrees(np.abs(turn_angle(view.sphere, distance, bins) - theirs))
    return off


def test_the_printed_law_of_theta_h_ends_below_a_right_angle() -> None:
    printed = paper_axes((91, 91, 361), ["theta_h"])
    assert np.degrees(printed.theta_h[-1]) == pytest.approx((90 / 91) ** 2 * 90)
    assert np.degrees(printed.theta_h[45]) == pytest.approx((45 / 91) ** 2 * 90)
    np.testing.assert_array_equal(printed.phi_d, table_axes(91, 91, 361).phi_d)


def test_what_is_written_is_read(tmp_path: Path) -> None:
    share = share_of(44.0, [42.0, 44.0, 46.0], NEAR)
    write_share(tmp_path / "a.zarr", share)
    found = ShareFile(tmp_path / "a.zarr")
    assert (found.angle_deg, found.bands_nm, found.shape) == (44.0, (550,), AXES.shape)
    assert len(found.nodes) > 100
    np.testing.assert_array_equal(found.nodes, share.nodes)
    for array, name in zip(found.band(0), ("mueller", "variance", "count"), strict=True):
        np.testing.assert_array_equal(array, getattr(share, name)[0])


def test_a_light_that_is_nowhere_nearest_has_an_empty_share(tmp_path: Path) -> None:
    empty = share_of(120.0, [50.0, 120.0, 120.1], NEAR)
    empty = replace(
        empty, nodes=empty.nodes[:0], mueller=empty.mueller[:, :0], variance=empty.variance[:, :0]
    )
    empty = replace(empty, count=empty.count[:, :0])
    write_share(tmp_path / "a.zarr", empty)
    found = ShareFile(tmp_path / "a.zarr")
    assert len(found.nodes) == len(found.band(0)[0]) == 0


def flip_a_bit(chunk: Path) -> None:
    content = bytearray(chunk.read_bytes())
    content[len(content) // 2] ^= 1
    chunk.write_bytes(content)


@pytest.mark.parametrize("name", ["nodes", "shape", "mueller", "variance", "count"])
@pytest.mark.parametrize("harm", [Path.unlink, flip_a_bit], ids=["lost", "flipped"])
def test_a_share_of_which_a_chunk_is_lost_or_changed_is_refused(
    tmp_path: Path, name: str, harm: Callable[[Path], None]
) -> None:
    """And never read as the zeros that Zarr puts in the place of a chunk that is not there."""
    write_share(tmp_path / "a.zarr", share_of(44.0, [42.0, 44.0, 46.0], NEAR))
    harm(next(path for path in (tmp_path / "a.zarr" / name / "c").rglob("*") if path.is_file()))
    with pytest.raises(InputError) as refused:
        ShareFile(tmp_path / "a.zarr").band(0)
    assert refused.value.field == name


def test_a_share_without_an_array_is_refused(tmp_path: Path) -> None:
    write_share(tmp_path / "a.zarr", share_of(44.0, [42.0, 44.0, 46.0], NEAR))
    shutil.rmtree(tmp_path / "a.zarr/variance")
    with pytest.raises(InputError) as refused:
        ShareFile(tmp_path / "a.zarr").band(0)
    assert refused.value.field == "variance"


def test_nodes_beyond_the_table_are_refused(tmp_path: Path) -> None:
    share = share_of(44.0, [42.0, 44.0, 46.0], NEAR)
    write_share(tmp_path / "a.zarr", replace(share, nodes=share.nodes + int(np.prod(AXES.shape))))
    with pytest.raises(InputError) as refused:
        ShareFile(tmp_path / "a.zarr")
    assert refused.value.field == "nodes"


def test_shares_of_another_table_are_refused(tmp_path: Path) -> None:
    write_share(tmp_path / "a.zarr", share_of(44.0, [44.0], NEAR, widest_gap=0.05))
    with pytest.raises(InputError) as refused:
        open_shares([tmp_path / "a.zarr"], table_axes(16, 16, 19), "jade")
    assert refused.value.source == str(tmp_path / "a.zarr")
    with pytest.raises(InputError) as refused:
        open_shares([], AXES, "jade")
    assert (refused.value.source, refused.value.field) == ("jade", "shares")
