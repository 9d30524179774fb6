"""Spheres made of a table or of Mitsuba's BSDFs, beside the same ones as facets."""

from __future__ import annotations

import sys
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.formats.pbsdf import write_pbsdf
from pbrdf.formats.table_data import TableData
from pbrdf.instruments.virtual_sphere import VirtualSphere, ambient_sphere
from pbrdf.models import MODELS
from pbrdf.models.mitsuba_bsdf import MitsubaBsdf
from pbrdf.optics.rusinkiewicz import directions
from pbrdf.settings.rig import RigSettings, read_rig
from pbrdf.tabulation.axes import table_axes

SOURCE = Path(__file__).resolve().parents[2] / "config/rig/virtual.yaml"
ANGLE_DEG, RADIUS_MM = 41.0, 25.0
WITHOUT_MITSUBA = "Mitsuba is not installed: pip install 'pbrdf[mitsuba]'"


@pytest.fixture
def settings() -> dict[str, Any]:
    rig = deepcopy(dict(read_rig(SOURCE)))
    rig["camera"] |= {"rows": 24, "columns": 28, "focal_px": 440, "principal_px": [13.6, 11.4]}
    rig["arm"]["axis_tilt_deg"] = [1.5, -2.0]
    return rig


def image(settings: dict[str, Any], sphere: dict[str, Any], band_nm: int = 550) -> NDArray[np.float32]:
    rig = settings | {"spheres": {"ball": sphere}}
    return VirtualSphere(rig, "ball", RADIUS_MM, SOURCE).mueller_image(ANGLE_DEG, band_nm)


def facets(**optics: float) -> dict[str, Any]:
    roughness = optics.pop("roughness")
    return {"model": "baek2018", "roughness": roughness, "bands": {"550": optics}}


def uniform(value: float) -> dict[str, Any]:
    return {"type": "uniform", "value": value}


PLASTIC = (
    facets(roughness=0.3, index=1.5, specular=0.8, albedo=0.6),
    {
        "type": "pplastic",
        "distribution": "ggx",
        "alpha": 0.3,
        "int_ior": 1.5,
        "ext_ior": 1.0,
        "specular_reflectance": uniform(0.8),
        "diffuse_reflectance": uniform(0.6),
    },
)
GOLD = (
    facets(roughness=0.25, index=0.347, extinction=2.696, specular=1.0, albedo=0.0),
    {
        "type": "roughconductor",
        "distribution": "ggx",
        "alpha": 0.25,
        "eta": uniform(0.347),
        "k": uniform(2.696),
    },
)


@pytest.mark.parametrize(("ours", "mitsubas"), [PLASTIC, GOLD], ids=["plastic", "gold"])
def test_mitsubas_material_is_photographed_as_the_same_facets(
    settings: dict[str, Any], ours: dict[str, Any], mitsubas: dict[str, Any]
) -> None:
    pytest.importorskip("mitsuba", reason=WITHOUT_MITSUBA)
    known = image(settings, ours)
    found = image(settings, {"mitsuba": mitsubas})
    assert np.count_nonzero(known[..., 0]) > 200
    np.testing.assert_array_equal(found[..., 0] > 0, known[..., 0] > 0)
    # Mitsuba computes in float32, and roughconductor's Smith terms are its own
    assert np.abs(found - known).max() < 2e-5 * known[..., 0].max()


def test_a_table_is_photographed_as_the_facets_it_holds(tmp_path: Path, settings: dict[str, Any]) -> None:
    """Up to the interpolation between nodes 2° apart."""
    known = facets(roughness=0.5, index=1.5, specular=0.8, albedo=0.6)
    path = write_table(tmp_path / "plastic.pbsdf", known)
    found, expected = image(settings, {"table": str(path)}), image(settings, known)
    scale = np.maximum(expected[..., :1], 1e-3 * expected[..., 0].max())
    error = (np.abs(found - expected) / scale).max(axis=-1)[expected[..., 0] > 0]
    assert np.median(error) < 2e-3


def test_mitsuba_photographs_a_table_as_we_do(tmp_path: Path, settings: dict[str, Any]) -> None:
    pytest.importorskip("mitsuba", reason=WITHOUT_MITSUBA)
    path = str(write_table(tmp_path / "plastic.pbsdf", PLASTIC[0]))
    ours = image(settings, {"table": path})
    mitsubas = image(settings, {"mitsuba": {"type": "measured_polarized", "filename": path}})
    # near the pole of θh Mitsuba's float32 angles lose digits
    assert np.abs(ours - mitsubas).max() < 1e-4 * ours[..., 0].max()


def write_table(path: Path, sphere: dict[str, Any]) -> Path:
    """The facets of 550 nm in all five bands; NaN below the horizon."""
    axes = table_axes(46, 46, 181)
    grid = np.meshgrid(axes.theta_h, np.maximum(axes.theta_d, 1e-4), axes.phi_d, indexing="ij")
    to_light, to_camera = directions(*grid)
    optics = sphere["bands"]["550"]
    parameters = {"alpha": sphere["roughness"], "eta": optics["index"]}
    parameters |= {name: optics[name] for name in ("specular", "albedo")}
    values = MODELS["baek2018"].evaluate(to_light, to_camera, parameters).astype(np.float32)
    bands = np.array([450.0, 500, 550, 600, 650])
    whole = np.broadcast_to(values, (5, *values.shape))
    write_pbsdf(path, TableData("test", bands, axes.theta_h, axes.theta_d, axes.phi_d, whole))
    return path


def test_bsdfs_may_differ_by_band(settings: dict[str, Any]) -> None:
    pytest.importorskip("mitsuba", reason=WITHOUT_MITSUBA)
    by_band = {"mitsuba": {"450": GOLD[1], "550": PLASTIC[1]}}
    for band_nm, one in ((450, GOLD[1]), (550, PLASTIC[1])):
        np.testing.assert_array_equal(
            image(settings, by_band, band_nm), image(settings, {"mitsuba": one}, band_nm)
        )


def test_one_bsdf_is_evaluated_at_each_bands_wavelength(settings: dict[str, Any]) -> None:
    """Gold is yellow: its measured index makes it darker in the blue."""
    pytest.importorskip("mitsuba", reason=WITHOUT_MITSUBA)
    gold = {"mitsuba": {"type": "roughconductor", "material": "Au", "alpha": 0.3}}
    blue, red = (image(settings, gold, nm)[..., 0].sum() for nm in (450, 650))
    assert blue < 0.6 * red


def test_the_callers_variant_stays(settings: dict[str, Any]) -> None:
    mi = pytest.importorskip("mitsuba", reason=WITHOUT_MITSUBA)
    mi.set_variant("scalar_rgb")
    image(settings, {"mitsuba": PLASTIC[1]})
    assert mi.variant() == "scalar_rgb"


def test_light_along_the_view_has_the_frames_of_phi_d_zero() -> None:
    pytest.importorskip("mitsuba", reason=WITHOUT_MITSUBA)
    bsdf = MitsubaBsdf(PLASTIC[1], "here", "mitsuba")
    normal = np.array([0.0, 0.0, 1.0])
    tilted = np.array([0.6, 0.0, 0.8])
    found = bsdf.evaluate(np.stack([normal, tilted]), np.stack([normal, tilted]), 550)
    near = [directions(theta_h, 1e-4, 0.0) for theta_h in (0.0, np.arccos(0.8))]
    beside = bsdf.evaluate(*(np.stack(side) for side in zip(*near, strict=True)), 550)
    np.testing.assert_allclose(found, beside, atol=1e-3 * beside[0, 0, 0])


def test_a_sphere_in_the_rooms_light_is_as_bright_as_it_reflects(settings: dict[str, Any]) -> None:
    pytest.importorskip("mitsuba", reason=WITHOUT_MITSUBA)
    white = {"mitsuba": {"type": "diffuse", "reflectance": uniform(0.4)}}
    ball = ambient_sphere(settings | {"spheres": {"ball": white}}, "ball", RADIUS_MM, SOURCE)
    assert ball.truth["reflectance"][550] == (pytest.approx(0.4, rel=1e-3), 0.0)


def test_the_truth_is_a_files_content_not_its_place(tmp_path: Path, settings: dict[str, Any]) -> None:
    paths = [tmp_path / "a/plastic.pbsdf", tmp_path / "b/plastic.pbsdf", tmp_path / "c/plastic.pbsdf"]
    for path in paths:
        path.parent.mkdir()
    for path, sphere in zip(paths, (PLASTIC[0], PLASTIC[0], GOLD[0]), strict=True):
        write_table(path, sphere)
    truths = []
    for path in paths:
        rig = settings | {"spheres": {"ball": {"table": str(path)}}}
        truths.append(VirtualSphere(rig, "ball", RADIUS_MM, SOURCE).truth)
    assert truths[0] == truths[1] != truths[2]


def test_paths_are_looked_up_wherever_the_rig_names_them(settings: dict[str, Any]) -> None:
    spheres = {
        "a": {"table": "a.pbsdf"},
        "b": {"mitsuba": {"450": {"type": "measured_polarized", "filename": "b.pbsdf"}}},
    }
    placed = RigSettings(settings | {"spheres": spheres}).with_files_at(lambda path: f"there/{path}")
    assert placed["spheres"]["a"]["table"] == "there/a.pbsdf"
    assert placed["spheres"]["b"]["mitsuba"]["450"]["filename"] == "there/b.pbsdf"
    assert placed["camera"] == settings["camera"]


def refusal(settings: dict[str, Any], sphere: dict[str, Any]) -> InputError:
    with pytest.raises(InputError) as refused:
        image(settings, sphere)
    assert "\n" not in str(refused.value)
    return refused.value


def test_mitsuba_that_is_not_installed_is_told_in_a_line(
    settings: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "mitsuba", None)
    refused = refusal(settings, {"mitsuba": PLASTIC[1]})
    assert (refused.source, refused.field) == (str(SOURCE), "spheres.ball.mitsuba")
    assert refused.remedy == "pip install 'pbrdf[mitsuba]'"


@pytest.mark.parametrize(
    ("description", "word"),
    [
        ({"type": "pplastik"}, "pplastik"),
        ({"type": "pplastic", "alfa": 0.1}, "alfa"),
        ({"type": "measured_polarized", "filename": "nowhere.pbsdf"}, "nowhere.pbsdf"),
        ({"type": "sphere"}, "no BSDF"),
    ],
)
def test_what_mitsuba_refuses_is_told_in_a_line(
    settings: dict[str, Any], description: dict[str, Any], word: str
) -> None:
    pytest.importorskip("mitsuba", reason=WITHOUT_MITSUBA)
    refused = refusal(settings, {"mitsuba": {"550": description}})
    assert refused.field == "spheres.ball.mitsuba.550"
    assert word in refused.problem


def test_a_table_that_is_not_there_is_told(settings: dict[str, Any]) -> None:
    assert refusal(settings, {"table": "nowhere.pbsdf"}).source == "nowhere.pbsdf"
