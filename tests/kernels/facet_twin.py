"""The facet models in plain NumPy, written from the textbook forms."""

from __future__ import annotations

import numpy as np

from pbrdf.optics.frames import angle_between, normalised, table_axis
from pbrdf.optics.mueller import rotator

NORMAL = np.array([0.0, 0.0, 1.0])


def random_directions(count, seed=1, lowest=1e-3):
    """Two arrays (count, 3) of unit vectors above the horizon."""
    random = np.random.default_rng(seed)

    def upward():
        z = random.uniform(lowest, 1.0, count)
        azimuth = random.uniform(0.0, 2.0 * np.pi, count)
        radius = np.sqrt(1.0 - z * z)
        return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), z], axis=-1)

    return upward(), upward()


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
    m[..., 2, 2] = m[..., 3, 3] = np.sqrt(np.maximum(s, 0.0) * np.maximum(p, 0.0))
    return m


def ggx(cos_h, alpha):
    tan2 = (1 - cos_h**2) / cos_h**2
    return alpha**2 / (np.pi * cos_h**4 * (alpha**2 + tan2) ** 2)


def beckmann(cos_h, alpha):
    tan2 = (1 - cos_h**2) / cos_h**2
    return np.exp(-tan2 / alpha**2) / (np.pi * alpha**2 * cos_h**4)


def ggx_masking(cosine, alpha):
    return 2 / (1 + np.sqrt(1 + alpha**2 * (1 - cosine**2) / cosine**2))


def beckmann_masking(cosine, alpha):
    a = cosine / (alpha * np.sqrt(1 - cosine**2))
    return np.where(a < 1.6, (3.535 * a + 2.181 * a**2) / (1 + 2.276 * a + 2.577 * a**2), 1.0)


def blinn(cos_i, cos_o, cos_h, cos_d):
    return np.minimum(1.0, 2 * cos_h * np.minimum(cos_i, cos_o) / cos_d)


def lobe(model, light, camera, roughness):
    """D G / (4 cosθi cosθo)."""
    cos_i, cos_o = light[:, 2], camera[:, 2]
    half = normalised(light + camera)
    cos_h, cos_d = half[:, 2], np.sum(half * light, axis=-1)
    if model == "baek_ggx":
        value = ggx(cos_h, roughness) * ggx_masking(cos_i, roughness) * ggx_masking(cos_o, roughness)
    elif model == "baek_beckmann":
        value = beckmann(cos_h, roughness)
        value *= beckmann_masking(cos_i, roughness) * beckmann_masking(cos_o, roughness)
    else:
        value = beckmann(cos_h, np.sqrt(2) * roughness) * blinn(cos_i, cos_o, cos_h, cos_d)
    return value / (4 * cos_i * cos_o)


def refracted(light, camera, index):
    """Baek's diffuse term for the albedo π."""
    s = table_axis(light, camera)
    turn_i = rotator(angle_between(normalised(np.cross(NORMAL, -light)), s, -light))
    turn_o = rotator(angle_between(normalised(np.cross(NORMAL, camera)), s, camera))
    depolariser = np.diag([1.0, 0.0, 0.0, 0.0])
    scattered = transmission(camera[:, 2], index) @ depolariser @ transmission(light[:, 2], index)
    return turn_o @ scattered @ np.swapaxes(turn_i, -1, -2)


def grooved_metal(theta, sigma, count=600, reach=7.0):
    """Directional-hemispherical reflectance of Hyde's lobe without Fresnel, by midpoints of slopes."""
    step = 2 * reach * sigma / count
    slope = (np.arange(count) + 0.5) * step - reach * sigma
    p, q = (a.ravel() for a in np.meshgrid(slope, slope[count // 2 :]))
    half = normalised(np.stack([-p, -q, np.ones_like(p)], axis=-1))
    light = np.broadcast_to([np.sin(theta), 0.0, np.cos(theta)], half.shape)
    cos_d = np.sum(half * light, axis=-1)
    camera = 2 * cos_d[:, None] * half - light
    seen = (cos_d > 0) & (camera[:, 2] > 0)
    light, camera, cos_d, cos_h = light[seen], camera[seen], cos_d[seen], half[seen, 2]
    # dωo = 4 cosθd dωh, dωh = cos³θh dp dq; the other half of q is the same
    sent = lobe("hyde", light, camera, sigma) * camera[:, 2] * 4 * cos_d * cos_h**3
    return 2 * np.sum(sent) * step**2


def twin(light, camera, *, model="baek_ggx", roughness=0.3, eta=1.5, kappa=0.0, specular=1.0, albedo=0.0):
    """Mueller matrices (n, 4, 4); Hyde's without its weight."""
    half = normalised(light + camera)
    index = eta - 1j * kappa
    mirrored = reflection(np.sum(half * light, axis=-1), index)
    value = specular * lobe(model, light, camera, roughness)[:, None, None] * mirrored
    if model.startswith("baek"):
        return value + albedo / np.pi * refracted(light, camera, index)
    value[:, 0, 0] += albedo / np.pi
    return value
