"""A slice of noiseless photographs equals the model they were rendered from, at the θd of each node."""

from __future__ import annotations

import weakref
from dataclasses import replace

import numpy as np
import pytest
from noise_twin import covariance
from numpy.typing import NDArray
from pbrdf._kernels import render

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.sphere import Sphere
from pbrdf.models import MODELS
from pbrdf.optics.arm import Arm
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.optics.rusinkiewicz import cosines, directions
from pbrdf.reconstruction.noise import NoiseModel
from pbrdf.reconstruction.reduction import data_reduction
from pbrdf.tabulation.axes import Axes, table_axes
from pbrdf.tabulation.sampling import make_slice
from pbrdf.tabulation.slices import Slice
from pbrdf.tabulation.surface import node_points
from pbrdf.tabulation.view import BandImage, Viewpoint

Float = NDArray[np.float64]

AXES = table_axes(23, 23, 61)
SMOOTH = {"alpha": 0.5, "eta": 1.5, "kappa": 0.0, "specular": 0.5, "albedo": 0.5}
METAL = {"alpha": 0.5, "eta": 0.4, "kappa": 2.7, "specular": 1.0, "albedo": 0.0}
GRAZING_DEG = 75.0


STATES_DEG = [[0.0, 25.0 * n, 5.0 * n, 90.0] for n in range(36)]
NOISE = NoiseModel(
    data_reduction(Polarimeter(1.55, 1.6, (0.0, 0.02, -0.01, 0.005)), STATES_DEG, "test"),
    exposures_s=np.array([1.0]),
    saturation=np.inf,
    dn_per_electron=0.002,
    read_noise_dn=0.01,
    darks=4,
)
"""Shot noise as large as read noise where the sphere is a grey of 0.05."""


def viewpoint(angle_deg: float, pixels: int) -> Viewpoint:
    """Near instruments, the sphere across nine tenths of the frame, nothing aligned with anything."""
    distance, radius = 500.0, 25.0
    focal = 0.45 * pixels * distance / radius
    camera = Camera((focal, focal), (pixels / 2 - 0.3, pixels / 2 + 0.2), pixels, pixels)
    start = (0.0, 0.0, -1.0)
    arm = Arm((0.5, 0.0, distance), (0.0, -1.0, 0.0), start, 0.8 * distance, (0.0, -0.96, 0.28))
    return Viewpoint(camera, Sphere((1.0, -0.5, distance), radius), arm, angle_deg, (0.28, -0.96, 0.0))


def photograph(view: Viewpoint, material: dict[str, float]) -> NDArray[np.float32]:
    """Mueller image (16, rows, columns) at pixel centres."""
    scene = render.SphereScene(
        np.array(view.sphere.centre_mm),
        view.sphere.radius_mm,
        view.arm.light_position(view.angle_deg),
        view.arm.generator_x(view.angle_deg),
        np.array(view.analyser_axis),
    )
    camera = render.Pinhole(*view.camera.focal_px, *view.camera.principal_px)
    image = render.render_mueller(
        camera, scene, tuple(material.values()), view.camera.rows, view.camera.columns, 1
    )
    return np.ascontiguousarray(np.moveaxis(np.asarray(image), -1, 0))


def shown(image: NDArray[np.float32], first: tuple[int, int] = (0, 0)) -> BandImage:
    return BandImage(image, np.ones_like(image), first, NOISE, 1.0)


def sliced(view: Viewpoint, *materials: dict[str, float], scale: float = 1.0) -> Slice:
    images = {}
    for index, material in enumerate(materials):
        image = scale * photograph(view, material)
        noise = replace(
            NOISE, dn_per_electron=scale * NOISE.dn_per_electron, read_noise_dn=scale * NOISE.read_noise_dn
        )
        images[450 + 100 * index] = BandImage(image, np.ones_like(image), (0, 0), noise, scale)
    return make_slice(view, images.items(), AXES, GRAZING_DEG)


def model(part: Slice, material: dict[str, float], axes: Axes = AXES) -> Float:
    """The model at the θd at which each node is seen; (H, P, 4, 4)."""
    nodes = np.broadcast_arrays(axes.theta_h[:, None], part.theta_d, axes.phi_d)
    return MODELS["baek2018"].evaluate(*directions(*nodes), material)


def deviation(part: Slice, band: int, material: dict[str, float]) -> Float:
    """Largest error of the seen nodes' elements in units of M00."""
    truth = model(part, material)
    seen = part.count[band] > 0
    relative = np.abs(part.mueller[band] - truth)[seen] / truth[seen][:, :1, :1]
    return relative.max(axis=(1, 2))


@pytest.mark.parametrize("angle_deg", [12.0, 60.0, 110.0])
@pytest.mark.parametrize("material", [SMOOTH, METAL], ids=["plastic", "metal"])
def test_a_slice_equals_the_model(angle_deg: float, material: dict[str, float]) -> None:
    """What is left is the bilinear interpolation between pixels, of second order in their size."""
    coarse, fine = (
        deviation(sliced(viewpoint(angle_deg, pixels), material), 0, material) for pixels in (240, 480)
    )
    assert len(coarse) > 300
    assert np.median(coarse) < 5e-4
    assert coarse.max() < 1e-2
    assert np.median(fine) < 0.3 * np.median(coarse)
    assert fine.max() < 0.4 * coarse.max()


def test_difference_angles_vary_as_near_instruments_make_them() -> None:
    part = sliced(viewpoint(60.0, 120), SMOOTH)
    seen = np.rad2deg(part.theta_d[part.count[0] > 0])
    assert 1.0 < np.ptp(seen) < 3.0
    assert abs(np.median(seen) - 31.0) < 1.0


def test_bands_are_kept_apart_and_in_order() -> None:
    view = viewpoint(60.0, 120)
    together = sliced(view, SMOOTH, METAL)
    assert together.bands_nm == (450, 550)
    assert together.mueller.shape == (2, 23, 61, 4, 4)
    for band, material in enumerate((SMOOTH, METAL)):
        np.testing.assert_array_equal(together.mueller[band], sliced(view, material).mueller[0])


def test_grazing_light_and_view_are_left_out() -> None:
    view = viewpoint(60.0, 240)
    part = sliced(view, SMOOTH)
    cosine = np.minimum(*cosines(AXES.theta_h[:, None], part.theta_d, AXES.phi_d))
    limit = np.cos(np.deg2rad(GRAZING_DEG))
    np.testing.assert_array_equal(part.count[0] > 0, cosine > limit)
    unseen = cosine <= limit
    assert unseen.any()
    assert np.isnan(part.mueller[0][unseen]).all()
    assert np.isnan(part.variance[0][unseen]).all()


def test_the_scale_of_the_photographs_cancels() -> None:
    view = viewpoint(60.0, 120)
    part, scaled = sliced(view, SMOOTH), sliced(view, SMOOTH, scale=3e4)
    np.testing.assert_allclose(scaled.mueller, part.mueller, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(scaled.variance * 9e8, part.variance, rtol=1e-5)


def repeated(view: Viewpoint, axes: Axes, number: int) -> list[Slice]:
    """Slices of one photograph with `NOISE`, whose elements hang together, each time anew."""
    random = np.random.default_rng(1)
    clean = photograph(view, SMOOTH)
    lit = clean[0] > 0
    elements = covariance(NOISE, clean[:, lit].T.astype(np.float64))
    root = np.linalg.cholesky(elements)
    spread = np.zeros_like(clean)
    spread[:, lit] = np.einsum("pkk->kp", elements)
    slices = []
    for _ in range(number):
        noisy = clean.copy()
        noisy[:, lit] += np.einsum("pkl,pl->kp", root, random.normal(size=(lit.sum(), 16)))
        image = BandImage(noisy, spread, (0, 0), NOISE, 1.0)
        slices.append(make_slice(view, [(450, image)], axes, GRAZING_DEG))
    return slices


def test_variance_is_that_of_repeated_noise() -> None:
    """Of all sixteen elements, though the noise of an image's elements is correlated and frames turn."""
    view = viewpoint(60.0, 60)
    axes = table_axes(8, 2, 9)
    repeats = repeated(view, axes, 300)
    seen = repeats[0].count[0] > 0
    values = np.stack([part.mueller[0][seen] for part in repeats]).astype(np.float64)
    assert seen.sum() > 40
    stored = np.mean([part.variance[0][seen] for part in repeats], axis=0)
    ratio = values.var(axis=0, ddof=1) / stored
    np.testing.assert_allclose(ratio, 1.0, atol=5.5 * np.sqrt(2 / 299))
    # over all nodes, each element
    np.testing.assert_allclose(np.sqrt(ratio.mean(axis=0)), 1.0, atol=0.03)


def test_a_window_of_the_frame_gives_the_same_slice() -> None:
    view = viewpoint(60.0, 120)
    image = photograph(view, SMOOTH)
    whole = make_slice(view, [(450, shown(image))], AXES, GRAZING_DEG)
    part = np.ascontiguousarray(image[:, 4:-3, 5:-2])
    window = make_slice(view, [(450, shown(part, (4, 5)))], AXES, GRAZING_DEG)
    np.testing.assert_array_equal(window.mueller, whole.mueller)


def test_one_band_is_in_memory_at_a_time() -> None:
    view = viewpoint(60.0, 40)
    gone: list[weakref.ref[NDArray[np.float32]]] = []

    def made(band_nm: int) -> tuple[int, BandImage]:
        assert all(image() is None for image in gone)
        image = photograph(view, SMOOTH)
        gone.append(weakref.ref(image))
        return band_nm, shown(image)

    make_slice(view, map(made, (450, 550, 650)), AXES, GRAZING_DEG)
    assert len(gone) == 3


def test_nodes_beyond_the_window_are_unseen() -> None:
    view = viewpoint(60.0, 120)
    image = photograph(view, SMOOTH)
    whole = make_slice(view, [(450, shown(image))], AXES, GRAZING_DEG)
    half = np.ascontiguousarray(image[:, :60])
    upper = make_slice(view, [(450, shown(half))], AXES, GRAZING_DEG)
    kept = upper.count[0] > 0
    assert 0.2 < kept.sum() / (whole.count[0] > 0).sum() < 0.8
    np.testing.assert_array_equal(upper.mueller[0][kept], whole.mueller[0][kept])
    assert np.isnan(upper.mueller[0][~kept]).all()


def test_a_missing_pixel_takes_its_nodes_with_it() -> None:
    view = viewpoint(60.0, 120)
    image = photograph(view, SMOOTH)
    image[:, 60:63, 55:58] = np.nan
    part = make_slice(view, [(450, shown(image))], AXES, GRAZING_DEG)
    lost = sliced(view, SMOOTH).count[0].astype(int) - part.count[0]
    assert lost.min() == 0
    assert lost.sum() > 0


DENSE_AXES = table_axes(46, 2, 91)


@pytest.fixture(scope="module", params=[SMOOTH, METAL], ids=["plastic", "metal"])
def dense(request: pytest.FixtureRequest) -> tuple[Viewpoint, NDArray[np.float32], Slice, dict[str, float]]:
    """A picture in which many pixels share a node, and its slice."""
    view = viewpoint(40.0, 900)
    image = photograph(view, request.param)
    part = make_slice(view, [(450, shown(image))], DENSE_AXES, GRAZING_DEG)
    return view, image, part, request.param


def test_nodes_that_many_pixels_share_are_told_by_all_of_them(
    dense: tuple[Viewpoint, NDArray[np.float32], Slice, dict[str, float]],
) -> None:
    """And nearer to the truth than between four pixels, for all that they are spread over nine cells."""
    view, image, part, material = dense
    many = part.count[0] > 50
    assert many.sum() > 0.5 * (part.count[0] > 0).sum()
    points = node_points(view.sphere, view.light_mm, DENSE_AXES.theta_h[:, None], DENSE_AXES.phi_d)
    column, row = view.camera.project(points.position_mm[many])
    gain = (points.light_distance_mm[many] * 1e-3) ** 2 / points.cos_light[many]
    corners = image[:, row.astype(int), column.astype(int)], image[:, row.astype(int), column.astype(int) + 1]
    between = corners[0] + (column % 1) * (corners[1] - corners[0])
    lower = (
        image[:, row.astype(int) + 1, column.astype(int)],
        image[:, row.astype(int) + 1, column.astype(int) + 1],
    )
    between = between + (row % 1) * (lower[0] + (column % 1) * (lower[1] - lower[0]) - between)
    truth = model(part, material, DENSE_AXES)[many]
    error = np.abs(part.mueller[0][many] - truth).max(axis=(1, 2)) / truth[:, 0, 0]
    between_error = np.abs(between[0] * gain / truth[:, 0, 0] - 1)
    assert np.median(error) < 2e-5
    assert np.percentile(error, 99) < 3e-4
    m00_error = np.abs(part.mueller[0][many][:, 0, 0] / truth[:, 0, 0] - 1)
    assert np.median(m00_error) < 0.5 * np.median(between_error)
    # a tenth of what four pixels would leave of each one's unit variance
    assert np.median(part.variance[0][many][:, 0, 0] / gain**2) < 0.1 * 4 / 9


def test_a_missing_pixel_among_many_takes_no_node_with_it(
    dense: tuple[Viewpoint, NDArray[np.float32], Slice, dict[str, float]],
) -> None:
    view, image, part, _ = dense
    holed = image.copy()
    holed[:, 440:443, 430:433] = np.nan
    found = make_slice(view, [(450, shown(holed))], DENSE_AXES, GRAZING_DEG)
    many = part.count[0] > 50
    assert np.all(found.count[0][many] > 0)
    lost = part.count[0].astype(int) - found.count[0]
    assert lost[many].min() == 0
    assert lost[many].sum() > 0


def test_variance_of_many_pixels_is_that_of_repeated_noise() -> None:
    view = viewpoint(40.0, 300)
    axes = table_axes(91, 2, 91)
    repeats = repeated(view, axes, 60)
    many = repeats[0].count[0] > 4
    assert many.sum() > 500
    values = np.stack([part.mueller[0][many] for part in repeats]).astype(np.float64)
    ratio = values.var(axis=0, ddof=1) / repeats[0].variance[0][many]
    np.testing.assert_allclose(np.sqrt(ratio.mean(axis=0)), 1.0, atol=0.03)


def test_axes_of_another_law_are_refused() -> None:
    view = viewpoint(60.0, 60)
    other = replace(AXES, theta_h=np.linspace(0, np.pi / 2, 23))
    with pytest.raises(ValueError, match="table_axes"):
        make_slice(view, [(450, shown(photograph(view, SMOOTH)))], other, GRAZING_DEG)
