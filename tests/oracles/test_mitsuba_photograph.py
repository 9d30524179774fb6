"""Mitsuba's photographs beside ours, and through our workflow back to Mitsuba's material."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pbrdf._kernels import render

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.sphere import Sphere
from pbrdf.capture.arrays import write_capture
from pbrdf.formats.capture_store import FrameStore
from pbrdf.optics.arm import Arm
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.optics.rusinkiewicz import directions
from pbrdf.reconstruction.mueller_image import reconstruct
from pbrdf.reconstruction.noise import NoiseModel
from pbrdf.reconstruction.reduction import data_reduction
from pbrdf.tabulation.axes import table_axes
from pbrdf.tabulation.sampling import make_slice
from pbrdf.tabulation.view import BandImage, Viewpoint

mi = pytest.importorskip("mitsuba", reason="Mitsuba is not installed: pip install 'pbrdf[mitsuba]'")

Float = NDArray[np.float64]

PIXELS = 120
RADIUS, DISTANCE = 25.0, 400.0
FOCAL = 0.45 * PIXELS * DISTANCE / RADIUS
UP = (0.0, -1.0, 0.0)
PARAMETERS: dict[str, dict[str, float]] = {
    "gold": {"alpha": 0.4, "eta": 0.183, "kappa": 3.43, "specular": 1.0, "albedo": 0.0},
    "plastic": {"alpha": 0.4, "eta": 1.5, "kappa": 0.0, "specular": 0.8, "albedo": 0.6},
}


def plugin(name: str) -> dict[str, Any]:
    p = PARAMETERS[name]
    facets = {"distribution": "ggx", "alpha": p["alpha"]}
    if name == "gold":
        index = {"eta": {"type": "uniform", "value": p["eta"]}, "k": {"type": "uniform", "value": p["kappa"]}}
        return {"type": "roughconductor", **facets, **index}
    weights = {
        "specular_reflectance": {"type": "uniform", "value": p["specular"]},
        "diffuse_reflectance": {"type": "uniform", "value": p["albedo"]},
    }
    return {"type": "pplastic", **facets, "int_ior": p["eta"], "ext_ior": 1.0, **weights}


def viewpoint(angle_deg: float) -> Viewpoint:
    camera = Camera((FOCAL, FOCAL), (PIXELS / 2 - 0.5, PIXELS / 2 - 0.5), PIXELS, PIXELS)
    centre = (0.0, 0.0, DISTANCE)
    arm = Arm(centre, UP, (0.0, 0.0, -1.0), 0.8 * DISTANCE, (0.0, -0.96, 0.28))
    return Viewpoint(camera, Sphere(centre, RADIUS), arm, angle_deg, UP)


def vector(values: Float) -> Any:
    return mi.Vector3f(np.asarray(values, dtype=np.float64).tolist())


def between(value: Any, beam_in: Float, axis_in: Float, beam_out: Float, axis_out: Float) -> Float:
    """Mitsuba's matrix (4, 4), turned by Mitsuba from its implicit bases to axes across the beams."""
    ends = []
    for beam, axis in ((beam_in, axis_in), (beam_out, axis_out)):
        x = axis - (axis @ beam) * beam
        ends += [vector(beam), mi.mueller.stokes_basis(vector(beam)), vector(x / np.linalg.norm(x))]
    return np.array(mi.mueller.rotate_mueller_basis(value, *ends)).reshape(4, 4, 4)[..., 0]


def photograph(view: Viewpoint, material: str) -> Float:
    """Mueller image (rows, columns, 4, 4) of pixel centres: tracing, BSDF and turned frames by Mitsuba."""
    mi.set_variant("scalar_spectral_polarized")
    ball = {
        "type": "sphere",
        "center": [1e-3 * c for c in view.sphere.centre_mm],
        "radius": 1e-3 * view.sphere.radius_mm,
        "bsdf": plugin(material),
    }
    world, context = mi.load_dict({"type": "scene", "ball": ball}), mi.BSDFContext()
    light = 1e-3 * view.arm.light_position(view.angle_deg)
    generator, analyser = view.arm.generator_x(view.angle_deg), np.array(view.analyser_axis)
    image = np.zeros((PIXELS, PIXELS, 4, 4))
    for row in range(PIXELS):
        for column in range(PIXELS):
            across = (np.array([column, row]) - view.camera.principal_px) / view.camera.focal_px
            ray = np.array([*across, 1.0]) / np.linalg.norm([*across, 1.0])
            surface = world.ray_intersect(mi.Ray3f([0, 0, 0], vector(ray), 0.0, [550.0] * 4))
            if not surface.is_valid():
                continue
            offset = light - np.array(surface.p)
            to_light = offset / np.linalg.norm(offset)
            local = surface.to_local(vector(to_light))
            value = surface.to_world_mueller(surface.bsdf().eval(context, surface, local), -local, surface.wi)
            image[row, column] = between(value, -to_light, generator, -ray, analyser) / (offset @ offset)
    return image


def at_nodes(material: str, light: Float, camera: Float) -> Float:
    """Mitsuba's BSDF in table frames, without the cosine; (n, 4, 4)."""
    mi.set_variant("scalar_spectral_polarized")
    bsdf, context, surface = mi.load_dict(plugin(material)), mi.BSDFContext(), mi.SurfaceInteraction3f()
    surface.wavelengths = [550.0] * 4
    values = np.empty((len(light), 4, 4))
    for index, (to_light, to_camera) in enumerate(zip(light, camera, strict=True)):
        surface.wi = vector(to_camera)
        value = bsdf.eval(context, surface, vector(to_light))
        s = np.cross(to_light, to_camera)
        values[index] = between(value, -to_light, s, to_camera, s) / to_light[2]
    return values


def ours(view: Viewpoint, material: str) -> Float:
    image = render.render_mueller(
        render.Pinhole(*view.camera.focal_px, *view.camera.principal_px),
        render.SphereScene(
            np.array(view.sphere.centre_mm),
            view.sphere.radius_mm,
            view.arm.light_position(view.angle_deg),
            view.arm.generator_x(view.angle_deg),
            np.array(view.analyser_axis),
        ),
        tuple(PARAMETERS[material].values()),
        PIXELS,
        PIXELS,
        1,
    )
    return np.asarray(image, dtype=np.float64).reshape(PIXELS, PIXELS, 4, 4)


@pytest.fixture(scope="module", params=list(PARAMETERS))
def material(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def view() -> Viewpoint:
    return viewpoint(70.0)


@pytest.fixture(scope="module")
def mitsubas(view: Viewpoint, material: str) -> Float:
    return photograph(view, material)


def test_the_virtual_camera_sees_what_mitsuba_sees(view: Viewpoint, material: str, mitsubas: Float) -> None:
    found = ours(view, material)
    assert np.count_nonzero(mitsubas[..., 0, 0]) > 5600
    assert np.abs(found - mitsubas).max() < 1e-4 * mitsubas[..., 0, 0].max()


def test_mitsubas_photograph_becomes_mitsubas_material(
    tmp_path: Path, view: Viewpoint, material: str, mitsubas: Float
) -> None:
    """Frames of all states of imperfect retarders, reconstructed, and sliced into the table's nodes."""
    polarimeter = Polarimeter(np.deg2rad(91.0), np.deg2rad(88.0), (0.0, 0.02, -0.01, 0.005))
    slow = 5.0 * np.arange(36)
    states = np.stack([0 * slow, slow, 5 * slow, 0 * slow], axis=-1)
    w = polarimeter.measurement_matrix(np.deg2rad(states))
    frames = np.tensordot(w, mitsubas.reshape(PIXELS, PIXELS, 16), axes=(1, 2)).astype(np.float32)
    manifest = write_capture(
        tmp_path,
        material=material,
        angle_deg=view.angle_deg,
        frames={550: frames[:, None]},
        states_deg=states,
        exposures_s=[1.0],
        saturation=1e9,
    )
    store = FrameStore.open(manifest.parent / "frames.zarr")
    whole = (slice(0, PIXELS), slice(0, PIXELS))
    image = reconstruct(store, 550, polarimeter, None, whole)
    axes = table_axes(12, 2, 25)
    noise = NoiseModel(data_reduction(polarimeter, states, material), np.ones(1), np.inf, 0.0, 1.0, 0)
    part = make_slice(view, [(550, BandImage(image.mueller, image.variance, (0, 0), noise, 1.0))], axes, 60.0)

    nodes = np.broadcast_arrays(axes.theta_h[:, None], part.theta_d, axes.phi_d)
    seen = part.count[0] > 0
    assert seen.sum() > 80
    truth = at_nodes(material, *directions(*(node[seen] for node in nodes)))
    error = np.abs(part.mueller[0][seen] - truth) / truth[:, :1, :1]
    # the interpolation between coarse pixels, of second order in their size
    assert np.median(error.max(axis=(1, 2))) < 2e-3
    assert error.max() < 5e-3
