"""Costs of the facet models against their definition, their gradients against central differences."""

import numpy as np
import pytest
from facet_twin import random_directions, twin
from pbrdf._kernels import facet_fit

PARAMETERS = {"roughness": 0.27, "eta": 1.6, "kappa": 0.0, "specular": 0.8, "albedo": 0.35}
METAL = PARAMETERS | {"eta": 0.6, "kappa": 1.9}
BY = list(PARAMETERS)
MODELS = ["baek_ggx", "baek_beckmann", "hyde", "hyde_weighted"]
KINDS = ["norms", "roots", "squares"]


def problem(kind, count=3001, seed=2):
    """Directions, matrices (NaN where the weight is zero) and weights."""
    light, camera = random_directions(count, seed, lowest=0.02)
    random = np.random.default_rng(seed)
    measured = twin(light, camera, albedo=0.5).reshape(-1, 16)
    measured = (measured + random.normal(0.0, 0.02, measured.shape)).astype(np.float32)
    weight = random.integers(0, 3, (count, 16) if kind == "squares" else count).astype(np.float32)
    measured[weight == 0] = np.nan
    return light, camera, measured, weight


class Cost:
    """One band's cost, as a function of its parameters by name."""

    def __init__(self, kind, model, *, complex_index=False, dtype="float64"):
        light, camera, measured, weight = problem(kind)
        geometry = getattr(facet_fit, f"geometry_{dtype}")
        self.arguments = {
            "geometry": geometry(light, camera),
            "table": facet_fit.pack(measured[None], weight[None], kind),
            "kind": kind,
            "model": model,
            "complex": complex_index,
        }

    def __call__(self, epsilon=1e-2, **parameters):
        costs, gradients = facet_fit.cost_gradient(**self.arguments, **of_bands([parameters], [epsilon]))
        return costs[0], gradients[0]


def of_bands(parameters, epsilon):
    """Arguments of the kernel for bands with parameters by name."""
    return {
        "roughness": parameters[0]["roughness"],
        "own": np.array([[one[name] for name in BY[1:]] for one in parameters]),
        "epsilon": np.array(epsilon),
    }


def expected_cost(kind, residual, weight, epsilon):
    if kind == "norms":
        return np.sum(weight * np.sqrt(np.sum(residual**2, axis=-1) + epsilon**2))
    if kind == "roots":
        return np.sum(weight[:, None] * (residual**2 + epsilon**2) ** 0.25)
    return np.sum(weight * residual**2)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("model", ["baek_ggx", "baek_beckmann", "hyde"])
@pytest.mark.parametrize("parameters", [PARAMETERS, METAL], ids=["dielectric", "metal"])
def test_cost_is_what_its_kind_says(kind, model, parameters):
    light, camera, measured, weight = problem(kind)
    cost, _ = Cost(kind, model, complex_index=parameters is METAL)(**parameters)
    residual = twin(light, camera, model=model, **parameters).reshape(-1, 16) - measured
    known = np.where(np.isnan(residual), 0.0, residual)
    # what no model fills is kept as a float32 sum of squares
    assert cost == pytest.approx(expected_cost(kind, known, weight, 1e-2), rel=1e-9)


def slopes(cost, parameters, step=1e-4):
    """Central differences of the fourth order."""
    found = []
    for name in BY:
        h = step * max(parameters[name], 0.1)
        at = {k: cost(**parameters | {name: parameters[name] + k * h})[0] for k in (-2, -1, 1, 2)}
        found.append((8 * (at[1] - at[-1]) - (at[2] - at[-2])) / (12 * h))
    return np.array(found)


def check_slopes(gradient, expected):
    # one that nearly vanishes is a difference of large terms
    np.testing.assert_allclose(gradient, expected, rtol=1e-6, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("model", MODELS)
def test_gradient_with_a_real_index_is_the_slope(kind, model):
    cost = Cost(kind, model)
    _, gradient = cost(**PARAMETERS)
    # kappa is not looked at: neither is its slope
    assert gradient[2] == 0.0
    check_slopes(gradient, slopes(cost, PARAMETERS | {"kappa": 1.0}))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("index", [(0.6, 1.9), (1.6, 0.4), (4.0, 8.0)])
def test_gradient_with_a_complex_index_is_the_slope(kind, model, index):
    parameters = METAL | dict(zip(("eta", "kappa"), index, strict=True))
    cost = Cost(kind, model, complex_index=True)
    check_slopes(cost(**parameters)[1], slopes(cost, parameters))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("model", MODELS)
def test_a_complex_index_without_absorption_is_a_real_one(kind, model):
    real, complex_index = (Cost(kind, model, complex_index=c)(**PARAMETERS) for c in (False, True))
    assert complex_index[0] == pytest.approx(real[0], rel=1e-12)
    np.testing.assert_allclose(np.delete(complex_index[1], 2), np.delete(real[1], 2), rtol=1e-10)


def test_nothing_breaks_where_a_lossless_index_is_below_one():
    cost, gradient = Cost("norms", "baek_ggx", complex_index=True)(**PARAMETERS | {"eta": 0.5})
    assert np.isfinite(cost)
    assert np.all(np.isfinite(gradient))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("parameters", [PARAMETERS, METAL], ids=["dielectric", "metal"])
def test_single_precision_costs_few_digits(kind, model, parameters):
    single, double = (
        Cost(kind, model, complex_index=parameters is METAL, dtype=dtype)(**parameters)
        for dtype in ("float32", "float64")
    )
    assert single[0] == pytest.approx(double[0], rel=1e-6)
    np.testing.assert_allclose(single[1], double[1], rtol=3e-5, atol=1e-5 * np.abs(double[1]).max())


def test_single_precision_is_no_staircase():
    cost = Cost("norms", "baek_ggx", dtype="float32")
    start, gradient = cost(**PARAMETERS)
    # float32 does not know these two roughnesses apart
    moved, _ = cost(**PARAMETERS | {"roughness": PARAMETERS["roughness"] + 3e-9})
    assert moved - start == pytest.approx(3e-9 * gradient[0], rel=1e-3)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("model", MODELS)
def test_bands_in_one_pass_are_those_bands_alone(kind, model):
    light, camera, *first = problem(kind)
    _, _, *second = problem(kind, seed=3)
    table = facet_fit.pack(*(np.stack(both) for both in zip(first, second, strict=True)), kind)
    bands = [METAL, METAL | {"eta": 1.2, "kappa": 0.7, "specular": 0.4, "albedo": 0.6}]
    arguments = {"geometry": facet_fit.geometry_float64(light, camera), "kind": kind, "model": model}
    arguments |= {"complex": True}
    costs, gradients = facet_fit.cost_gradient(table=table, **arguments, **of_bands(bands, [1e-2, 1e-3]))
    for band, (parameters, epsilon) in enumerate(zip(bands, (1e-2, 1e-3), strict=True)):
        alone = facet_fit.cost_gradient(
            table=table[band : band + 1], **arguments, **of_bands([parameters], [epsilon])
        )
        assert (costs[band], *gradients[band]) == (alone[0][0], *alone[1][0])


BYTES_OF_COSTS = """
import hashlib, numpy as np
from pbrdf._kernels import facet_fit
random = np.random.default_rng(5)
z = random.uniform(0.1, 1.0, (2, 150_000))
light, camera = (np.stack([np.sqrt(1 - c * c), 0 * c, c], axis=-1) for c in z)
measured = random.normal(0.3, 0.1, (2, 150_000, 16)).astype(np.float32)
digest = hashlib.sha256()
for kind in ("norms", "roots", "squares"):
    shape = measured.shape if kind == "squares" else measured.shape[:2]
    table = facet_fit.pack(measured, np.ones(shape, np.float32), kind)
    for geometry in (facet_fit.geometry_float32(light, camera), facet_fit.geometry_float64(light, camera)):
        cost, slope = facet_fit.cost_gradient(
            geometry, table, kind=kind, model="hyde_weighted", complex=True, roughness=0.2,
            own=np.array([[1.6, 0.5, 1.0, 0.5], [1.5, 0.6, 0.9, 0.4]]), epsilon=np.full(2, 1e-3))
        digest.update(geometry.tobytes() + cost.tobytes() + slope.tobytes())
print(digest.hexdigest())
"""


def test_same_bytes_for_any_number_of_threads(printed_by_threads):
    assert len(printed_by_threads(BYTES_OF_COSTS)) == 1


def test_wrong_arrays_are_refused():
    light, camera = random_directions(4)
    geometry = facet_fit.geometry_float32(light, camera)
    matrices, weight = np.zeros((1, 4, 16), np.float32), np.ones((1, 4), np.float32)
    table = facet_fit.pack(matrices, weight, "norms")
    arguments = {"kind": "norms", "model": "hyde", "complex": False, **of_bands([PARAMETERS], [0.1])}
    with pytest.raises(ValueError, match=r"to_camera has shape \(3, 3\), expected \(4, 3\)"):
        facet_fit.geometry_float64(light, np.ascontiguousarray(camera[:3]))
    with pytest.raises(TypeError):
        facet_fit.geometry_float32(light.astype(np.float32), camera)
    with pytest.raises(ValueError, match=r"weight has shape \(1, 4\), expected \(1, 4, 16\)"):
        facet_fit.pack(matrices, weight, "squares")
    with pytest.raises(ValueError, match="kind 'cubes' is not known"):
        facet_fit.pack(matrices, weight, "cubes")
    with pytest.raises(ValueError, match=r"table has shape \(1, 1, 14, 16\), expected \(1, 1, 17, 16\)"):
        facet_fit.cost_gradient(geometry, table, **arguments | {"kind": "roots"})
    with pytest.raises(ValueError, match=r"table has shape \(1, 1, 14, 16\), expected \(2, 1, 14, 16\)"):
        facet_fit.cost_gradient(geometry, table, **arguments | of_bands([PARAMETERS] * 2, [0.1] * 2))
    with pytest.raises(ValueError, match=r"epsilon has shape \(2\), expected \(1\)"):
        facet_fit.cost_gradient(geometry, table, **arguments | {"epsilon": np.full(2, 0.1)})
    with pytest.raises(ValueError, match=r"eta is outside \(1, inf\)"):
        facet_fit.cost_gradient(geometry, table, **arguments | of_bands([PARAMETERS | {"eta": 0.9}], [0.1]))
