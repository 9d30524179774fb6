"""The kernel against a plain NumPy twin that is written from the textbook forms."""

import numpy as np
import pytest
from pbrdf._kernels import facet

from pbrdf.optics.frames import angle_between, normalised, table_axis
from pbrdf.optics.mueller import rotator

NORMAL = np.array([0.0, 0.0, 1.0])


def random_directions(count, seed=1, lowest=1e-3):
    random = np.random.default_rng(seed)

    def upward():
        z = random.uniform(lowest, 1.0, count)
        azimuth = random.uniform(0.0, 2.0 * np.pi, count)
        radius = np.sqrt(1.0 - z * z)
        return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), z], axis=-1)

    return upward(), upward()


def evaluate(light, camera, *, alpha=0.3, eta=1.5, kappa=0.0, specular=1.0, albedo=0.0):
    out = np.full((len(light), 16), np.nan)
    facet.evaluate(
        np.ascontiguousarray(light),
        np.ascontiguousarray(camera),
        alpha=alpha,
        eta=eta,
        kappa=kappa,
        specular=specular,
        albedo=albedo,
        out=out,
    )
    return out.reshape(-1, 4, 4)


def fresnel_amplitudes(cosine, index):
    cos_t = np.sqrt(1.0 - (1.0 - cosine**2) / index**2 + 0j)
    cos_t = np.where(cos_t.imag > 0, cos_t.conj(), cos_t)
    r_s = (cosine - index * cos_t) / (cosine + index * cos_t)
    r_p = (index * cosine - cos_t) / (index * cosine + cos_t)
    return r_s, r_p


def reflection(cosine, index):
    r_s, r_p = fresnel_amplitudes(cosine, index)
    s, p, cross = abs(r_s) ** 2, abs(r_p) ** 2, r_s.conj() * r_p
    m = np.zeros((*cosine.shape, 4, 4))
    m[..., 0, 0] = m[..., 1, 1] = (s + p) / 2
    m[..., 0, 1] = m[..., 1, 0] = (s - p) / 2
    m[..., 2, 2] = m[..., 3, 3] = cross.real
    m[..., 2, 3], m[..., 3, 2] = -cross.imag, cross.imag
    return m


def transmission(cosine, index):
    r_s, r_p = fresnel_amplitudes(cosine, index)
    s, p = 1 - abs(r_s) ** 2, 1 - abs(r_p) ** 2
    m = np.zeros((*cosine.shape, 4, 4))
    m[..., 0, 0] = m[..., 1, 1] = (s + p) / 2
    m[..., 0, 1] = m[..., 1, 0] = (s - p) / 2
    m[..., 2, 2] = m[..., 3, 3] = np.sqrt(s * p)
    return m


def twin(light, camera, *, alpha=0.3, eta=1.5, kappa=0.0, specular=1.0, albedo=0.0):
    cos_i, cos_o = light[:, 2], camera[:, 2]
    half = normalised(light + camera)
    tan2_h = (1 - half[:, 2] ** 2) / half[:, 2] ** 2
    distribution = alpha**2 / (np.pi * half[:, 2] ** 4 * (alpha**2 + tan2_h) ** 2)
    masking = np.ones(len(light))
    for cosine in (cos_i, cos_o):
        masking *= 2 / (1 + np.sqrt(1 + alpha**2 * (1 - cosine**2) / cosine**2))
    lobe = specular * distribution * masking / (4 * cos_i * cos_o)
    mirrored = lobe[:, None, None] * reflection(np.sum(half * light, axis=-1), eta - 1j * kappa)
    if albedo == 0:
        return mirrored

    s = table_axis(light, camera)
    turn_i = rotator(angle_between(normalised(np.cross(NORMAL, -light)), s, -light))
    turn_o = rotator(angle_between(normalised(np.cross(NORMAL, camera)), s, camera))
    depolariser = np.diag([1.0, 0.0, 0.0, 0.0])
    scattered = transmission(cos_o, complex(eta)) @ depolariser @ transmission(cos_i, complex(eta))
    diffuse = albedo / np.pi * turn_o @ scattered @ np.swapaxes(turn_i, -1, -2)
    return mirrored + diffuse


MATERIALS = {
    "glossy dielectric": {"alpha": 0.05, "eta": 1.5, "specular": 0.8, "albedo": 0.4},
    "rough dielectric": {"alpha": 0.9, "eta": 2.4, "specular": 1.7, "albedo": 0.9},
    "gold": {"alpha": 0.2, "eta": 0.183, "kappa": 3.43},
    "weakly absorbing": {"alpha": 0.3, "eta": 1.33, "kappa": 1e-3},
}


@pytest.mark.parametrize("material", MATERIALS.values(), ids=MATERIALS)
def test_kernel_equals_its_numpy_twin(material):
    light, camera = random_directions(20_000)
    expected = twin(light, camera, **material)
    # each pair in its own scale: a narrow lobe spans ten decades
    scale = expected[:, :1, :1]
    assert np.max(np.abs(evaluate(light, camera, **material) - expected) / scale) < 1e-12


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


def packed(count=3001, seed=2, **truth):
    light, camera = random_directions(count, seed, lowest=0.02)
    measured = evaluate(light, camera, **truth).reshape(-1, 16)
    measured += np.random.default_rng(seed).normal(0.0, 0.02, measured.shape)
    weight = np.random.default_rng(seed).integers(0, 2, count).astype(np.float32)
    measured = measured.astype(np.float32)
    measured[weight == 0] = np.nan
    return light, camera, measured, weight


PARAMETERS = {"alpha": 0.27, "eta": 1.6, "specular": 0.8, "albedo": 0.35}


def test_cost_is_the_weighted_sum_of_norms():
    light, camera, measured, weight = packed(albedo=0.5)
    cost, _ = facet.cost_gradient(
        facet.geometry(light, camera), facet.pack(measured, weight), epsilon=0.01, **PARAMETERS
    )
    used = weight > 0
    residual = twin(light[used], camera[used], **PARAMETERS).reshape(-1, 16) - measured[used]
    expected = np.sum(np.sqrt(np.sum(residual**2, axis=-1) + 0.01**2))
    assert cost == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("name", PARAMETERS)
@pytest.mark.parametrize("epsilon", [1e-1, 1e-4])
def test_gradient_is_the_slope_of_the_cost(name, epsilon):
    light, camera, measured, weight = packed(albedo=0.5)
    geometry, table = facet.geometry(light, camera), facet.pack(measured, weight)
    _, gradient = facet.cost_gradient(geometry, table, epsilon=epsilon, **PARAMETERS)
    step = 1e-5
    ends = [
        facet.cost_gradient(geometry, table, epsilon=epsilon, **PARAMETERS | {name: PARAMETERS[name] + h})[0]
        for h in (-step, step)
    ]
    slope = (ends[1] - ends[0]) / (2 * step)
    assert gradient[list(PARAMETERS).index(name)] == pytest.approx(slope, rel=1e-6)


BYTES_OF_A_COST = """
import hashlib, numpy as np
from pbrdf._kernels import facet
random = np.random.default_rng(5)
z = random.uniform(0.1, 1.0, (2, 150_000))
light, camera = (np.stack([np.sqrt(1 - c * c), 0 * c, c], axis=-1) for c in z)
out = np.empty((150_000, 16))
facet.evaluate(light, camera, alpha=0.3, eta=1.5, kappa=0.0, specular=1.0, albedo=0.5, out=out)
table = facet.pack(out.astype(np.float32), np.ones(150_000, np.float32))
geometry = facet.geometry(light, camera)
cost, slope = facet.cost_gradient(geometry, table, alpha=0.2, eta=1.6, specular=1.0, albedo=0.5, epsilon=1e-3)
digest = hashlib.sha256(out.tobytes() + geometry.tobytes() + np.float64(cost).tobytes() + slope.tobytes())
print(digest.hexdigest())
"""


def test_same_bytes_for_any_number_of_threads(printed_by_threads):
    assert len(printed_by_threads(BYTES_OF_A_COST)) == 1


def test_wrong_arrays_are_refused():
    light, camera = random_directions(4)
    with pytest.raises(ValueError, match=r"to_camera has shape \(3, 3\), expected \(4, 3\)"):
        facet.geometry(light, np.ascontiguousarray(camera[:3]))
    with pytest.raises(TypeError):
        facet.geometry(light.astype(np.float32), camera)
    with pytest.raises(ValueError, match="alpha is outside"):
        evaluate(light, camera, alpha=0.0)
