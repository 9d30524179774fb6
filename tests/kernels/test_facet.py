"""The kernel against a plain NumPy twin that is written from the textbook forms."""

import numpy as np
import pytest
from facet_twin import grooved_metal, random_directions, twin
from pbrdf._kernels import facet

from pbrdf.optics.frames import normalised


def evaluate(light, camera, *, model="baek_ggx", roughness=0.3, eta=1.5, kappa=0.0, specular=1.0, albedo=0.0):
    out = np.full((len(light), 16), np.nan)
    facet.evaluate(
        np.ascontiguousarray(light),
        np.ascontiguousarray(camera),
        model=model,
        roughness=roughness,
        eta=eta,
        kappa=kappa,
        specular=specular,
        albedo=albedo,
        out=out,
    )
    return out.reshape(-1, 4, 4)


MATERIALS = {
    "glossy dielectric": {"roughness": 0.05, "eta": 1.5, "specular": 0.8, "albedo": 0.4},
    "rough dielectric": {"roughness": 0.9, "eta": 2.4, "specular": 1.7, "albedo": 0.9},
    "gold": {"roughness": 0.2, "eta": 0.183, "kappa": 3.43},
    "weakly absorbing": {"roughness": 0.3, "eta": 1.33, "kappa": 1e-3, "albedo": 0.3},
    "lighter than air": {"roughness": 0.3, "eta": 0.8, "albedo": 0.3},
}
MODELS = ["baek_ggx", "baek_beckmann", "hyde"]


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("material", MATERIALS.values(), ids=MATERIALS)
def test_kernel_equals_its_numpy_twin(material, model):
    light, camera = random_directions(20_000)
    expected = twin(light, camera, model=model, **material)
    found = evaluate(light, camera, model=model, **material)
    # each pair in its own scale, for a narrow lobe spans ten decades; in total reflection it is rounding
    scale = np.maximum(expected[:, 0, 0], 1e-5)
    assert np.max(np.abs(found - expected).max(axis=(1, 2)) / scale) < 1e-11


def test_nothing_at_and_below_the_horizon():
    light, camera = random_directions(3)
    light[0] = [1.0, 0.0, 0.0]
    camera[1] = [0.6, 0.0, -0.8]
    values = evaluate(light, camera, albedo=0.5)
    assert np.all(values[:2] == 0.0)
    assert values[2, 0, 0] > 0.0


@pytest.mark.parametrize("near", [0.0, 1e-9, 1e-6])
def test_limits_where_a_frame_is_undefined(near):
    tilted = np.array([[np.sin(0.7), 0.0, np.cos(0.7)]])
    beside = normalised(tilted + np.array([0.0, near, 0.0]))
    upright = normalised([[near, 0.0, 1.0]])
    for light, camera in ((tilted, beside), (upright, tilted), (tilted, upright), (upright, upright)):
        value = evaluate(light, camera, albedo=0.5)[0]
        assert np.all(np.isfinite(value))
        assert value[0, 0] > 0
        # a frame along or across the plane that holds the normal: no 45° component
        assert np.max(np.abs(value[2, :2])) < 2e-5


def test_light_at_the_camera_takes_the_limit_of_phi_zero():
    tilted = np.array([[np.sin(0.7), 0.0, np.cos(0.7)]])
    steeper = np.array([[np.sin(0.7 - 1e-7), 0.0, np.cos(0.7 - 1e-7)]])
    at_limit = evaluate(tilted, tilted, albedo=0.5)
    assert np.max(np.abs(at_limit - evaluate(tilted, steeper, albedo=0.5))) < 1e-6


@pytest.mark.parametrize("sigma", [0.05, 0.2, 0.7])
@pytest.mark.parametrize("theta_deg", [5, 45, 75, 87])
def test_hydes_weight_is_what_a_metal_with_grooves_does_not_reflect(sigma, theta_deg):
    theta = np.radians(theta_deg)
    light = np.array([[np.sin(theta), 0.0, np.cos(theta)]])
    value = evaluate(light, light, model="hyde_weighted", roughness=sigma, specular=0.0, albedo=np.pi)
    assert value[0, 0, 0] == pytest.approx(1.0 - grooved_metal(theta, sigma), abs=5e-4)


@pytest.mark.parametrize(
    ("sigma", "reflected"),
    [(0.1, (1, 1, 1, 0.99, 0.94, 0.95)), (0.5, (0.69, 0.73, 0.78, 0.86, 0.93, 0.98))],
)
def test_a_metal_with_grooves_loses_most_at_normal_incidence_where_it_is_rough(sigma, reflected):
    theta = np.radians([0, 30, 45, 60, 75, 85])
    light = np.stack([np.sin(theta), 0 * theta, np.cos(theta)], axis=-1)
    value = evaluate(light, light, model="hyde_weighted", roughness=sigma, specular=0.0, albedo=np.pi)
    np.testing.assert_allclose(1.0 - value[:, 0, 0], reflected, atol=6e-3)


def test_wrong_arguments_are_refused():
    light, camera = random_directions(4)
    with pytest.raises(ValueError, match=r"to_camera has shape \(3, 3\), expected \(4, 3\)"):
        evaluate(light, camera[:3])
    with pytest.raises(ValueError, match="roughness is outside"):
        evaluate(light, camera, roughness=0.0)
    with pytest.raises(ValueError, match=r"roughness is outside \(0, 0.75\]"):
        evaluate(light, camera, model="hyde_weighted", roughness=0.8)
    with pytest.raises(ValueError, match="model 'phong' is not known"):
        evaluate(light, camera, model="phong")
