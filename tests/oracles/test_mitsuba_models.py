"""Our microfacet model equals Mitsuba's: ``pplastic`` as a whole, ``roughconductor`` in its specular term."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.models import MODELS
from pbrdf.models.baek2018 import BAEK2018_BECKMANN
from pbrdf.optics.frames import angle_between, change_frames, table_axis

mi = pytest.importorskip("mitsuba", reason="Mitsuba is not installed: pip install 'pbrdf[mitsuba]'")

VARIANT = "scalar_spectral_polarized"
PAIRS = 10_000
MODEL = MODELS["baek2018"]
DISTRIBUTIONS = {"ggx": MODEL, "beckmann": BAEK2018_BECKMANN}
Float = NDArray[np.float64]


@pytest.fixture(scope="module")
def pairs() -> tuple[Float, Float]:
    """Directions over the whole upper hemisphere."""
    vectors = np.random.default_rng(30).normal(size=(2, PAIRS, 3))
    vectors[..., 2] = np.abs(vectors[..., 2])
    vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
    # Mitsuba computes in float32: both sides start from the same numbers
    vectors = vectors.astype(np.float32).astype(np.float64)
    return vectors[0], vectors[1]


def mitsuba_in_table_frames(description: dict[str, Any], light: Float, camera: Float) -> Float:
    """Mitsuba's answer without its cosine, turned from its implicit Stokes frames into ours; (N, 4, 4)."""
    mi.set_variant(VARIANT)
    plugin = mi.load_dict(description)
    context = mi.BSDFContext()
    surface = mi.SurfaceInteraction3f()
    surface.wavelengths = [550.0] * 4
    found = np.empty((len(light), 4, 4))
    x_in, x_out = np.empty_like(light), np.empty_like(light)
    for index in range(len(light)):
        # light is traced from the camera: `wi` looks to the camera and `wo` to the light
        surface.wi = mi.Vector3f(camera[index].tolist())
        to_light = mi.Vector3f(light[index].tolist())
        found[index] = np.array(plugin.eval(context, surface, to_light)).reshape(4, 4, 4)[..., 0]
        x_in[index] = np.array(mi.mueller.stokes_basis(-to_light))
        x_out[index] = np.array(mi.mueller.stokes_basis(surface.wi))
    axis = table_axis(light, camera)
    angle_in, angle_out = angle_between(x_in, axis, -light), angle_between(x_out, axis, camera)
    return change_frames(found / light[:, 2, None, None], angle_in, angle_out)


def largest_deviation(ours: Float, mitsuba: Float) -> float:
    assert np.abs(mitsuba).max() > 0
    return float(np.abs(ours - mitsuba).max() / mitsuba[:, 0, 0].max())


def pplastic(
    parameters: dict[str, float], *, distribution: str = "ggx", visible: bool = True
) -> dict[str, Any]:
    return {
        "type": "pplastic",
        "distribution": distribution,
        "sample_visible": visible,
        "alpha": parameters["alpha"],
        "int_ior": parameters["eta"],
        "ext_ior": 1.0,
        "specular_reflectance": {"type": "uniform", "value": parameters["specular"]},
        "diffuse_reflectance": {"type": "uniform", "value": parameters["albedo"]},
    }


@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
@pytest.mark.parametrize("visible", [True, False], ids=["visible normals", "all normals"])
@pytest.mark.parametrize(("alpha", "eta"), [(0.1, 1.5), (0.5, 1.3), (1.0, 2.5)])
def test_whole_model_equals_pplastic(
    pairs: tuple[Float, Float], alpha: float, eta: float, visible: bool, distribution: str
) -> None:
    """The camera is the steeper direction of each pair; reciprocity tells the other half.

    Mitsuba refracts the camera's ray into the surface and back out in float32: at a grazing camera
    its transmission has lost digits (see below), at a grazing light it has not.
    """
    swapped = pairs[0][:, 2:] > pairs[1][:, 2:]
    light, camera = np.where(swapped, pairs[1], pairs[0]), np.where(swapped, pairs[0], pairs[1])
    parameters = {"alpha": alpha, "eta": eta, "specular": 0.8, "albedo": 0.6}
    mitsuba = mitsuba_in_table_frames(
        pplastic(parameters, distribution=distribution, visible=visible), light, camera
    )
    model = DISTRIBUTIONS[distribution]
    assert largest_deviation(model.evaluate(light, camera, parameters), mitsuba) < 1e-5


@pytest.mark.parametrize("eta", [1.3, 1.5, 2.5])
def test_at_a_grazing_camera_pplastic_differs_by_its_rounding_alone(
    pairs: tuple[Float, Float], eta: float
) -> None:
    light, camera = pairs
    parameters = {"alpha": 0.5, "eta": eta, "specular": 0.8, "albedo": 0.6}
    mitsuba = mitsuba_in_table_frames(pplastic(parameters), light, camera)
    ours = MODEL.evaluate(light, camera, parameters)
    deviation = np.abs(ours - mitsuba).max(axis=(1, 2)) / mitsuba[:, 0, 0].max()
    # Snell: cos_o d(cos_o) = eta^2 cos_t d(cos_t), so that a rounding of cos_t grows by eta^2/cos_o
    rounding = np.finfo(np.float32).eps * eta**2 / camera[:, 2]
    assert np.all(deviation < 1e-6 + 4 * rounding)


@pytest.mark.parametrize(("alpha", "eta"), [(0.1, 1.5), (0.5, 1.3), (1.0, 2.5)])
def test_specular_term_equals_pplastic_without_its_diffuse_one(
    pairs: tuple[Float, Float], alpha: float, eta: float
) -> None:
    parameters = {"alpha": alpha, "eta": eta, "specular": 0.8, "albedo": 0.0}
    mitsuba = mitsuba_in_table_frames(pplastic(parameters), *pairs)
    assert largest_deviation(MODEL.evaluate(*pairs, parameters), mitsuba) < 1e-5


# index of gold at 550 nm, and of a metal of low absorption
@pytest.mark.parametrize(("eta", "kappa"), [(0.183, 3.43), (2.5, 0.4)])
@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
def test_specular_term_equals_roughconductor(
    pairs: tuple[Float, Float], eta: float, kappa: float, distribution: str
) -> None:
    light, camera = pairs
    parameters = {"alpha": 0.3, "eta": eta, "kappa": kappa, "specular": 1.0, "albedo": 0.0}
    mitsuba = mitsuba_in_table_frames(
        {
            "type": "roughconductor",
            "distribution": distribution,
            "alpha": 0.3,
            "eta": {"type": "uniform", "value": eta},
            "k": {"type": "uniform", "value": kappa},
        },
        light,
        camera,
    )
    assert largest_deviation(DISTRIBUTIONS[distribution].evaluate(light, camera, parameters), mitsuba) < 1e-5
