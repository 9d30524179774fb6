"""Hyde's model as physics knows it: reciprocity, a depolariser, the weight that keeps energy."""

from importlib import import_module

import numpy as np
import pytest

from pbrdf.models import FAMILIES, MODELS
from pbrdf.optics.rusinkiewicz import directions

GOLD = {"sigma": 0.2, "eta": 0.35, "kappa": 2.7, "specular": 1.0, "albedo": 0.3}
GRID = np.meshgrid(
    np.linspace(0.01, 1.4, 9), np.linspace(0.01, 1.4, 10), np.linspace(-np.pi, np.pi, 17), indexing="ij"
)


def test_light_and_camera_may_change_places_without_the_weight():
    theta_h, theta_d, phi_d = GRID
    p = np.diag([1.0, 1.0, -1.0, 1.0])
    model = MODELS["hyde2009_complex"]
    here = model.evaluate(*directions(theta_h, theta_d, phi_d), GOLD)
    there = model.evaluate(*directions(theta_h, theta_d, phi_d + np.pi), GOLD)
    assert np.max(np.abs(there - p @ np.swapaxes(here, -1, -2) @ p)) < 1e-12 * np.max(np.abs(here))


@pytest.mark.parametrize("name", ["hyde2009", "hyde2009_dhr"])
def test_the_diffuse_term_fills_m00_alone(name):
    value = MODELS[name].evaluate(*directions(*GRID), GOLD | {"specular": 0.0})
    assert np.any(value[..., 0, 0] > 0)
    value[..., 0, 0] = 0.0
    assert np.all(value == 0.0)


def test_the_weighted_forms_differ_by_the_weight_of_the_diffuse_term_alone():
    light, camera = directions(*GRID)
    seen = (light[..., 2] > 0) & (camera[..., 2] > 0)
    plain, weighted = (
        MODELS[name].evaluate(light, camera, GOLD) for name in ("hyde2009_complex", "hyde2009_dhr_complex")
    )
    lost = (plain - weighted)[seen]
    assert np.all(lost[:, 0, 0] > 0)
    assert np.all(lost[:, 0, 0] < GOLD["albedo"] / np.pi * 1.001)
    lost[:, 0, 0] = 0.0
    assert np.all(lost == 0.0)


@pytest.mark.parametrize("name", MODELS)
def test_every_model_tells_parameters_units_bounds_and_m00(name):
    model = MODELS[name]
    names = [p.name for p in model.parameters]
    counted = sum(1 if p.shared else 5 for p in model.parameters)
    assert counted == (21 if "complex" in name else 16)
    assert names[1:] == [*(("eta", "kappa") if "complex" in name else ("eta",)), "specular", "albedo"]
    assert all(p.unit == "1" and p.lower < p.upper and p.meaning for p in model.parameters)
    assert all(p.name in model.m00 for p in model.parameters if p.linear)


@pytest.mark.parametrize("family", FAMILIES)
def test_a_family_lies_in_the_module_of_its_name(family):
    there = vars(import_module(f"pbrdf.models.{family}")).values()
    assert all(any(model is value for value in there) for model in FAMILIES[family])
