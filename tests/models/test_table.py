from __future__ import annotations

import subprocess
import sys
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

import pbrdf
from pbrdf.errors import InputError
from pbrdf.formats.pbsdf import write_pbsdf
from pbrdf.formats.table_data import TableData
from pbrdf.formats.table_zarr import write_table
from pbrdf.models.table import Table, open_table
from pbrdf.optics.rusinkiewicz import angles, cosines, directions

UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def data() -> TableData:
    rng = np.random.default_rng(5)
    return TableData(
        source="small",
        wavelengths_nm=np.array([450.0, 500.0, 550.0, 600.0, 650.0]),
        theta_h=(np.arange(7) / 6) ** 2 * np.pi / 2,
        theta_d=np.linspace(0, np.pi / 2, 5),
        phi_d=np.linspace(-np.pi, np.pi, 9),
        mueller=rng.normal(size=(5, 7, 5, 9, 4, 4)).astype(np.float32),
    )


def upper_directions(rng: np.random.Generator, count: int) -> NDArray[np.float64]:
    vectors = rng.normal(size=(count, 3))
    vectors[:, 2] = np.abs(vectors[:, 2])
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def test_interpolation_is_multilinear_in_the_four_axes(data: TableData) -> None:
    rng = np.random.default_rng(6)
    light, camera = upper_directions(rng, 5000), upper_directions(rng, 5000)
    wavelength = rng.uniform(450, 650, 5000)
    axes = (data.wavelengths_nm, data.theta_h, data.theta_d, data.phi_d)
    reference = RegularGridInterpolator(axes, data.mueller.astype(np.float64))
    points = np.stack([wavelength, *angles(light, camera)], axis=-1)
    found = Table(data).evaluate(light, camera, wavelength)
    assert found.dtype == np.float64
    assert np.allclose(found, reference(points), rtol=0, atol=1e-12)


def test_nodes_above_the_horizon_are_returned_as_stored(data: TableData) -> None:
    theta_h, theta_d, phi_d = np.meshgrid(data.theta_h, data.theta_d, data.phi_d, indexing="ij")
    light, camera = directions(theta_h, theta_d, phi_d)
    # at the poles of θh and θd the azimuth φd is not a function of the directions
    inner = (np.minimum(*cosines(theta_h, theta_d, phi_d)) > 1e-9) & (theta_h > 0) & (theta_d > 0)
    inner &= np.abs(phi_d) < 3.1
    found = Table(data).evaluate(light[inner], camera[inner], 550.0)
    assert inner.sum() > 50
    assert np.allclose(found, data.mueller[2][inner], rtol=0, atol=1e-12)


def test_only_the_half_and_difference_angles_matter(data: TableData) -> None:
    rng = np.random.default_rng(7)
    light, camera = upper_directions(rng, 200), upper_directions(rng, 200)
    c, s = np.cos(1.1), np.sin(1.1)
    about_normal = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    table = Table(data)
    turned = table.evaluate(3.0 * light @ about_normal, camera @ about_normal, 500.0)
    assert np.allclose(turned, table.evaluate(light, camera, 500.0), rtol=0, atol=1e-12)


def test_axes_are_held_constant_beyond_their_ends(data: TableData) -> None:
    cut = replace(
        data,
        theta_h=data.theta_h[1:4],
        theta_d=data.theta_d[1:3],
        phi_d=data.phi_d[3:6],
        mueller=data.mueller[:, 1:4, 1:3, 3:6],
    )
    table = Table(cut)
    rng = np.random.default_rng(8)
    light, camera = upper_directions(rng, 2000), upper_directions(rng, 2000)
    held = [
        np.clip(values, axis[0], axis[-1])
        for values, axis in zip(angles(light, camera), (cut.theta_h, cut.theta_d, cut.phi_d), strict=True)
    ]
    axes = (cut.wavelengths_nm, cut.theta_h, cut.theta_d, cut.phi_d)
    reference = RegularGridInterpolator(axes, cut.mueller.astype(np.float64))
    for beyond, held_nm in ((300.0, 450.0), (900.0, 650.0)):
        expected = reference(np.stack([np.full(2000, held_nm), *held], axis=-1))
        assert np.allclose(table.evaluate(light, camera, beyond), expected, rtol=0, atol=1e-12)


def test_an_axis_of_one_node_is_constant(data: TableData) -> None:
    single = replace(data, wavelengths_nm=data.wavelengths_nm[2:3], mueller=data.mueller[2:3])
    light, camera = upper_directions(np.random.default_rng(9), 2)
    found = Table(single).evaluate(light, camera, [450.0, 550.0, 700.0])
    assert np.allclose(found, Table(data).evaluate(light, camera, 550.0), rtol=0, atol=1e-15)


def test_first_element_may_be_negative(data: TableData) -> None:
    negative = replace(data, mueller=-np.abs(data.mueller))
    light, camera = upper_directions(np.random.default_rng(10), 2)
    assert Table(negative).evaluate(light, camera, 500.0)[0, 0] < 0


def test_below_the_horizon_nothing_is_known(data: TableData) -> None:
    below = np.array([0.6, 0.0, -0.8])
    table = Table(data)
    for light, camera in ((below, UP), (UP, below), (below, below), (np.full(3, np.nan), UP), (0 * UP, UP)):
        assert np.isnan(table.evaluate(light, camera, 500.0)).all()
    assert np.isfinite(table.evaluate([1.0, 0.0, 0.0], UP, 500.0)).all()
    assert np.isnan(table.evaluate(UP, [0.6, 0.0, 0.8], np.nan)).all()


def test_an_unknown_node_is_felt_only_where_it_takes_part(data: TableData) -> None:
    mueller = data.mueller.copy()
    mueller[2, 3, 2, 4] = np.nan
    table = Table(replace(data, mueller=mueller))

    def unknown(wavelength: float, theta_h: float, theta_d: float, phi_d: float) -> bool:
        light, camera = directions(theta_h, theta_d, phi_d)
        return bool(np.isnan(table.evaluate(light, camera, wavelength)).all())

    node_h, node_d, node_p = data.theta_h[3], data.theta_d[2], data.phi_d[4]
    assert unknown(550.0, node_h, node_d, node_p)
    assert unknown(549.0, node_h - 1e-3, node_d + 1e-3, node_p - 1e-3)
    # on a neighbouring node the weight of this one is exactly 0
    assert not unknown(500.0, node_h - 1e-3, node_d + 1e-3, node_p - 1e-3)
    assert not unknown(600.0, node_h - 1e-3, node_d + 1e-3, node_p - 1e-3)


def test_retro_reflection_takes_the_frames_of_zero_azimuth(data: TableData) -> None:
    direction = np.array([0.0, 0.6, 0.8])
    light, camera = directions(np.arccos(0.8), 0.0, 0.0)
    table = Table(data)
    expected = table.evaluate(light, camera, 500.0)
    assert np.allclose(table.evaluate(direction, direction, 500.0), expected, rtol=0, atol=1e-9)


@given(
    st.sampled_from([(), (3,), (2, 1), (1, 4)]),
    st.sampled_from([(), (1,), (2, 4)]),
    st.sampled_from([(), (4,), (5, 1, 1)]),
)
def test_arguments_broadcast(
    data: TableData, light: tuple[int, ...], camera: tuple[int, ...], wavelength: tuple[int, ...]
) -> None:
    def call() -> NDArray[np.float64]:
        return Table(data).evaluate(np.ones((*light, 3)), np.ones((*camera, 3)), np.full(wavelength, 500.0))

    try:
        shape = np.broadcast_shapes(light, camera, wavelength)
    except ValueError:
        with pytest.raises(InputError, match="broadcast"):
            call()
    else:
        assert call().shape == (*shape, 4, 4)


def test_no_directions_give_no_matrices(data: TableData) -> None:
    assert Table(data).evaluate(np.empty((0, 3)), UP, 500.0).shape == (0, 4, 4)


def test_directions_without_three_components_are_refused(data: TableData) -> None:
    with pytest.raises(InputError, match="to_camera"):
        Table(data).evaluate(UP, [0.0, 1.0], 500.0)


def test_memory_grows_with_the_answer_only(data: TableData) -> None:
    light = upper_directions(np.random.default_rng(11), 200_000)
    tracemalloc.start()
    try:
        found = Table(data).evaluate(light, UP, 500.0)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 1.5 * found.nbytes + (16 << 20)


def test_every_kind_of_file_opens_as_the_same_table(tmp_path: Path, data: TableData) -> None:
    names = ("theta_h", "theta_d", "phi_d")
    axes = {name: getattr(data, name).astype(np.float32)[None] for name in names}
    whole = replace(data, **{name: axis[0].astype(np.float64) for name, axis in axes.items()})
    write_table(tmp_path / "t.zarr", whole, {})
    write_pbsdf(tmp_path / "t.pbsdf", data)
    matrices = np.einsum("bhdpij->pdhbij", data.mueller)
    scipy.io.savemat(tmp_path / "t.mat", {"pbrdf_T_f": matrices})
    scipy.io.savemat(tmp_path / "axes.mat", {**axes, "wvls": data.wavelengths_nm[None]})
    rng = np.random.default_rng(12)
    light, camera = upper_directions(rng, 100), upper_directions(rng, 100)
    expected = Table(whole).evaluate(light, camera, 512.0)
    for table in (
        open_table(tmp_path / "t.zarr"),
        open_table(str(tmp_path / "t.pbsdf")),
        open_table(tmp_path / "t.pbsdf", {"theta_h": data.theta_h}),
        open_table(tmp_path / "t.mat", tmp_path / "axes.mat"),
    ):
        assert np.array_equal(table.evaluate(light, camera, 512.0), expected)


def test_axes_of_the_wrong_kind_are_refused(tmp_path: Path, data: TableData) -> None:
    write_table(tmp_path / "t.zarr", data, {})
    write_pbsdf(tmp_path / "t.pbsdf", data)
    (tmp_path / "t.mat").touch()
    for name, axes in (("t.zarr", {}), ("t.mat", {"theta_h": [0.0]})):
        with pytest.raises(InputError) as caught:
            open_table(tmp_path / name, axes)
        assert caught.value.field == "axes"


def test_axes_may_come_from_a_file(tmp_path: Path, data: TableData) -> None:
    write_pbsdf(tmp_path / "t.pbsdf", data)
    lines = [f"{name}_deg: {np.degrees(getattr(data, name)).tolist()}" for name in ("theta_h", "phi_d")]
    (tmp_path / "axes.yaml").write_text("\n".join(lines), encoding="utf-8")
    table = open_table(tmp_path / "t.pbsdf", tmp_path / "axes.yaml")
    np.testing.assert_array_equal(table.data.mueller, data.mueller)
    with pytest.raises(InputError, match=r"absent.yaml: file"):
        open_table(tmp_path / "t.pbsdf", tmp_path / "absent.yaml")


def test_missing_files_and_unknown_kinds_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is not there"):
        open_table(tmp_path / "absent.pbsdf")
    (tmp_path / "a.brdf").touch()
    with pytest.raises(InputError, match=r"'\.brdf'"):
        open_table(tmp_path / "a.brdf")


def test_the_package_opens_tables_and_loads_only_what_it_needs() -> None:
    assert pbrdf.open_table is open_table
    code = "import sys, pbrdf; print({'zarr', 'scipy', 'cv2', 'matplotlib'} & sys.modules.keys())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
