"""Mitsuba's ``measured_polarized`` reads our files and finds in them what `Table.evaluate` finds."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.formats.pbsdf import write_pbsdf
from pbrdf.formats.table_data import TableData
from pbrdf.models.table import Table, open_table
from pbrdf.optics.frames import angle_between, change_frames, table_axis
from pbrdf.optics.rusinkiewicz import angles

mi = pytest.importorskip("mitsuba", reason="Mitsuba is not installed: pip install 'pbrdf[mitsuba]'")

VARIANT = "scalar_spectral_polarized"
PAIRS = 10_000
Float = NDArray[np.float64]


def smooth_table() -> TableData:
    """Sixteen different smooth functions of all four axes; M00 is 0.3 to 1.7."""
    wavelength = np.arange(450.0, 651.0, 50.0)
    theta_h = (np.arange(46) / 45) ** 2 * np.pi / 2
    theta_d = np.linspace(0, np.pi / 2, 46)
    phi_d = np.linspace(-np.pi, np.pi, 181)
    w, h, d, p = np.meshgrid((wavelength - 550) / 100, theta_h, theta_d, phi_d, indexing="ij", sparse=True)
    mueller = np.empty((5, 46, 46, 181, 4, 4), np.float32)
    for row in range(4):
        for column in range(4):
            k = 4 * row + column
            wave = np.cos((0.5 + 0.1 * k) * h + 0.3 * k) * np.sin((1.3 - 0.05 * k) * d + 0.2 * k + 0.4 * w)
            mueller[..., row, column] = 0.4 * wave + 0.2 * np.sin(p * (1 + k % 3) + k) * np.cos(d + k)
    mueller[..., 0, 0] += 1.0
    return TableData("smooth", wavelength, theta_h, theta_d, phi_d, mueller)


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("mitsuba") / "smooth.pbsdf"
    write_pbsdf(path, smooth_table())
    return path


@pytest.fixture(scope="module")
def plugin(file: Path) -> Any:
    mi.set_variant(VARIANT)
    return mi.load_dict({"type": "measured_polarized", "filename": str(file)})


@pytest.fixture(scope="module")
def table(file: Path) -> Table:
    return open_table(file)


def direction_pairs(count: int) -> tuple[Float, Float, Float]:
    """Directions above the horizon and four wavelengths a pair, some of them beyond the table."""
    rng = np.random.default_rng(20)
    vectors = rng.normal(size=(2, count, 3))
    vectors[..., 2] = np.abs(vectors[..., 2])
    vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
    # Mitsuba computes in float32: both sides start from the same numbers
    vectors = vectors.astype(np.float32).astype(np.float64)
    return vectors[0], vectors[1], rng.uniform(430, 670, (count, 4)).astype(np.float32).astype(np.float64)


def mitsuba_in_table_frames(plugin: Any, light: Float, camera: Float, wavelength: Float) -> Float:
    """Mitsuba's answer without its cosine, turned from its implicit Stokes frames into ours; (N, 4, 4, 4)."""
    context = mi.BSDFContext()
    surface = mi.SurfaceInteraction3f()
    found = np.empty((len(light), 4, 4, 4))
    x_in, x_out = np.empty_like(light), np.empty_like(light)
    for index in range(len(light)):
        # light is traced from the camera: `wi` looks to the camera and `wo` to the light
        surface.wi = mi.Vector3f(camera[index].tolist())
        surface.wavelengths = wavelength[index].tolist()
        to_light = mi.Vector3f(light[index].tolist())
        found[index] = np.moveaxis(np.array(plugin.eval(context, surface, to_light)).reshape(4, 4, 4), -1, 0)
        x_in[index] = np.array(mi.mueller.stokes_basis(-to_light))
        x_out[index] = np.array(mi.mueller.stokes_basis(surface.wi))
    axis = table_axis(light, camera)
    angle_in, angle_out = angle_between(x_in, axis, -light), angle_between(x_out, axis, camera)
    return change_frames(found / light[:, 2, None, None, None], angle_in[:, None], angle_out[:, None])


def test_all_sixteen_elements_agree_in_table_frames(plugin: Any, table: Table) -> None:
    light, camera, wavelength = direction_pairs(PAIRS)
    mitsuba = mitsuba_in_table_frames(plugin, light, camera, wavelength)
    ours = table.evaluate(light[:, None], camera[:, None], wavelength)
    deviation = np.abs(mitsuba - ours).max(axis=(1, 2, 3)) / table.data.mueller[..., 0, 0].max()
    assert deviation.max() < 1e-5
    # near the poles of θh and θd, differences of nearly equal float32 vectors lose digits
    theta_h, theta_d, _ = angles(light, camera)
    inner = np.minimum(theta_h, theta_d) > np.radians(5)
    assert inner.sum() > 0.9 * PAIRS
    assert deviation[inner].max() < 2e-6


def test_unknown_nodes_are_nan_here_and_black_in_mitsuba(tmp_path: Path) -> None:
    mi.set_variant(VARIANT)
    whole = smooth_table()
    mueller = whole.mueller[:, ::5, ::5, ::10].copy()
    mueller[2, 4, 4] = np.nan
    holed = TableData(
        "holed", whole.wavelengths_nm, whole.theta_h[::5], whole.theta_d[::5], whole.phi_d[::10], mueller
    )
    write_pbsdf(tmp_path / "holed.pbsdf", holed)
    holed_plugin = mi.load_dict({"type": "measured_polarized", "filename": str(tmp_path / "holed.pbsdf")})
    light, camera, wavelength = direction_pairs(300)
    mitsuba = mitsuba_in_table_frames(holed_plugin, light, camera, wavelength)
    ours = Table(holed).evaluate(light[:, None], camera[:, None], wavelength)
    unknown = np.isnan(ours).any(axis=(-1, -2))
    assert 20 < unknown.sum() < 1000
    assert not mitsuba[unknown].any()
