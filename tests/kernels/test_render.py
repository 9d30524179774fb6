"""The virtual camera against a NumPy twin, against closed forms, and its noise against statistics."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from pbrdf._kernels import render

from pbrdf.models import MODELS
from pbrdf.optics.frames import angle_between, change_frames, normalised, table_axis, transverse

Float = NDArray[np.float64]

ROWS, COLUMNS = 40, 48
FX, FY, CX, CY = 700.0, 720.0, 23.2, 20.4
CENTRE, RADIUS = np.array([3.0, -2.0, 1000.0]), 25.0
GENERATOR, ANALYSER = normalised([0.1, -1.0, 0.3]), normalised([0.05, -1.0, 0.0])
LIGHTS = {
    "beside the camera": np.array([150.0, 20.0, 210.0]),
    "from the side": np.array([790.0, -60.0, 950.0]),
    "from behind": np.array([600.0, 40.0, 1400.0]),
}
PLASTIC = {"alpha": 0.3, "eta": 1.5, "kappa": 0.0, "specular": 0.9, "albedo": 0.4}
GOLD = {"alpha": 0.2, "eta": 0.35, "kappa": 2.7, "specular": 1.0, "albedo": 0.0}


def rendered(light: Float, material: dict[str, float], samples: int = 1) -> Float:
    scene = render.SphereScene(CENTRE, RADIUS, light, GENERATOR, ANALYSER)
    image = render.render_mueller(
        render.Pinhole(FX, FY, CX, CY), scene, tuple(material.values()), ROWS, COLUMNS, samples
    )
    return np.asarray(image).reshape(ROWS, COLUMNS, 4, 4)


def on_sphere(row: Float, column: Float) -> tuple[Float, Float, NDArray[np.bool_]]:
    """Points and normals that the rays through (row, column) meet first, and which rays meet any."""
    ray = normalised(np.stack([(column - CX) / FX, (row - CY) / FY, np.ones_like(row)], axis=-1))
    along = ray @ CENTRE
    square = along**2 - CENTRE @ CENTRE + RADIUS**2
    point = (along - np.sqrt(np.maximum(square, 0)))[..., None] * ray
    return point, (point - CENTRE) / RADIUS, square > 0


def local(vector: Float, normal: Float) -> Float:
    x = transverse(np.broadcast_to([0.6, 0.8, 0.0], normal.shape), normal)
    return np.stack([np.sum(vector * axis, axis=-1) for axis in (x, np.cross(normal, x), normal)], axis=-1)


def twin(light: Float, material: dict[str, float]) -> tuple[Float, NDArray[np.bool_]]:
    """Mueller image of pixel centres, and which of them see a lit surface."""
    row, column = np.meshgrid(np.arange(ROWS) * 1.0, np.arange(COLUMNS) * 1.0, indexing="ij")
    point, normal, hit = on_sphere(row, column)
    to_light, to_camera = normalised(light - point), normalised(-point)
    cosine = np.sum(normal * to_light, axis=-1)
    lit = hit & (cosine > 0)
    table = MODELS["baek2018"].evaluate(local(to_light, normal), local(to_camera, normal), material)
    s = table_axis(to_light, to_camera)
    angle_in = angle_between(s, transverse(GENERATOR, -to_light), -to_light)
    angle_out = angle_between(s, transverse(ANALYSER, to_camera), to_camera)
    metres = np.linalg.norm(light - point, axis=-1) * 1e-3
    image = change_frames(table, angle_in, angle_out) * (cosine / metres**2)[..., None, None]
    image[~lit] = 0.0
    return image, lit


@pytest.mark.parametrize("light", LIGHTS.values(), ids=LIGHTS)
@pytest.mark.parametrize("material", [PLASTIC, GOLD], ids=["plastic", "gold"])
def test_a_pixel_equals_its_twin(light: Float, material: dict[str, float]) -> None:
    found, (expected, lit) = rendered(light, material), twin(light, material)
    assert lit.sum() > 100
    assert np.abs(found - expected).max() / expected[..., 0, 0].max() < 1e-6
    # and in the scale of each pixel: the highlight must not hide the rest
    deviation = np.abs(found - expected)[lit] / expected[lit][:, :1, :1]
    assert deviation.max() < 1e-6


@pytest.mark.parametrize("light", LIGHTS.values(), ids=LIGHTS)
def test_nothing_is_seen_off_the_lit_sphere(light: Float) -> None:
    found, lit = rendered(light, PLASTIC), twin(light, PLASTIC)[1]
    assert np.all(found[~lit] == 0.0)
    assert np.all(found[lit][:, 0, 0] > 0.0)


def test_samples_are_averaged_over_the_pixel() -> None:
    """Samples at odd fractions of a pixel: the camera of a shifted principal point sees them one by one."""
    light = LIGHTS["from the side"]
    scene = render.SphereScene(CENTRE, RADIUS, light, GENERATOR, ANALYSER)
    single = [
        render.render_mueller(
            render.Pinhole(FX, FY, CX - dx, CY - dy), scene, tuple(PLASTIC.values()), ROWS, COLUMNS, 1
        )
        for dx in (-0.25, 0.25)
        for dy in (-0.25, 0.25)
    ]
    mean = np.mean(np.asarray(single, np.float64), axis=0)
    assert np.abs(rendered(light, PLASTIC, 2).reshape(mean.shape) - mean).max() / mean.max() < 1e-6


@pytest.mark.parametrize("phase_deg", [0.5, 40.0, 90.0, 130.0])
def test_a_lambertian_sphere_follows_lamberts_phase_law(phase_deg: float) -> None:
    """Far light and camera: (2/3) (sin α + (π − α) cos α) albedo/π · area, Lambert 1760.

    An index of one lets all light in and out of the diffuse term: the surface is Lambertian.
    """
    distance, radius, albedo, size = 1e5, 25.0, 0.7, 256
    phase = np.deg2rad(phase_deg)
    centre = np.array([0.0, 0.0, distance])
    light = centre + distance * np.array([np.sin(phase), 0.0, -np.cos(phase)])
    axis = np.array([0.0, -1.0, 0.0])
    focal = 120.0 * distance / radius
    image = render.render_mueller(
        render.Pinhole(focal, focal, 127.3, 127.8),
        render.SphereScene(centre, radius, light, axis, axis),
        (0.5, 1.0, 0.0, 0.0, albedo),
        size,
        size,
        3,
    )
    pixel_mm = distance / focal
    found = np.asarray(image)[..., 0].sum(dtype=np.float64) * pixel_mm**2
    law = 2 / 3 * (np.sin(phase) + (np.pi - phase) * np.cos(phase))
    expected = albedo / np.pi * radius**2 * law / (distance * 1e-3) ** 2
    assert found == pytest.approx(expected, rel=2e-3)
    assert np.abs(np.asarray(image)[..., 1:]).max() < 1e-6 * np.asarray(image).max()


def test_light_from_the_camera_itself_is_finite() -> None:
    found = rendered(np.array([0.0, 0.0, 1e-9]), PLASTIC)
    assert np.isfinite(found).all()
    # no frame is singled out: what is linear along x comes back linear along x
    row, column = round(CY - FY * 2 / 1000), round(CX + FX * 3 / 1000)
    centre = found[row, column] / found[row, column, 0, 0]
    np.testing.assert_allclose(np.abs(np.diag(centre)[1:3]), centre[1, 1], rtol=1e-3)


def test_an_empty_image_is_refused() -> None:
    scene = render.SphereScene(CENTRE, RADIUS, LIGHTS["from behind"], GENERATOR, ANALYSER)
    camera = render.Pinhole(FX, FY, CX, CY)
    for rows, columns, samples in ((0, 5, 1), (5, 0, 1), (5, 5, 0)):
        with pytest.raises(ValueError, match="at least 1"):
            render.render_mueller(camera, scene, tuple(PLASTIC.values()), rows, columns, samples)


def exposed(
    signal: float,
    sensor: render.Sensor,
    key: int = 1,
    pixels: tuple[int, int] = (300, 400),
    electrons: float = 1.0,
    dark_electrons: float = 0.0,
) -> NDArray[np.uint16]:
    """Frame of a uniform Mueller image whose M00 is `signal`."""
    mueller = np.zeros((*pixels, 16), np.float32)
    mueller[..., 0] = signal
    frame = np.empty(pixels, np.uint16)
    dark = np.full(pixels, dark_electrons, np.float32)
    render.expose(mueller, np.eye(16)[0], electrons, dark, sensor, key, frame)
    return frame


@pytest.mark.parametrize("electrons", [0.3, 4.0, 49.0, 51.0, 400.0, 20_000.0])
def test_mean_and_variance_of_a_frame(electrons: float) -> None:
    """Shot noise, read noise and the converter's step; the sampling errors of both figures at five sigma."""
    gain, read_noise, offset = 2.0, 5.0, 100.0
    frame = exposed(electrons, render.Sensor(gain, read_noise, offset, 14, 0)).astype(np.float64)
    variance = (electrons + read_noise**2) / gain**2 + 1 / 12
    assert abs(frame.mean() - offset - electrons / gain) < 5 * np.sqrt(variance / frame.size)
    assert abs(frame.var() / variance - 1) < 5 * np.sqrt(2.2 / frame.size)


@pytest.mark.parametrize("mean", [0.5, 3.0, 30.0])
def test_few_electrons_are_counted_as_poisson_says(mean: float) -> None:
    frame = exposed(mean, render.Sensor(1.0, 0.0, 0.0, 14, 0))
    count = np.arange(80)
    log_factorial = np.concatenate([[0.0], np.cumsum(np.log(count[1:]))])
    expected = np.exp(count * np.log(mean) - mean - log_factorial)
    found = np.bincount(frame.ravel(), minlength=80)[:80] / frame.size
    assert np.abs(found - expected).max() < 5 * np.sqrt(0.25 / frame.size)


def test_the_state_weighs_the_elements() -> None:
    random = np.random.default_rng(4)
    mueller = random.uniform(0, 1, (6, 7, 16)).astype(np.float32)
    state = random.uniform(0, 1, 16)
    frame = np.empty((6, 7), np.uint16)
    dark = np.zeros((6, 7), np.float32)
    render.expose(mueller, state, 1e9, dark, render.Sensor(1e6, 0.0, 0.0, 16, 0), 1, frame)
    np.testing.assert_allclose(frame, 1e3 * (mueller @ state), rtol=2e-3)


@pytest.mark.parametrize("dark_electrons", [0.7, 30.0, 900.0])
def test_electrons_without_light_are_counted_as_those_of_light(dark_electrons: float) -> None:
    """Independent Poisson numbers add up to one of the summed mean; with no light at all they stay."""
    sensor = render.Sensor(2.0, 5.0, 100.0, 14, 0)
    lit = exposed(0.25, sensor, electrons=200.0, dark_electrons=dark_electrons)
    mean = 50.0 + float(np.float32(dark_electrons))
    np.testing.assert_array_equal(lit, exposed(1.0, sensor, electrons=mean))
    unlit = exposed(-3.0, sensor, dark_electrons=dark_electrons).astype(np.float64)
    variance = (dark_electrons + 25.0) / 4.0 + 1 / 12
    assert abs(unlit.mean() - 100.0 - dark_electrons / 2) < 5 * np.sqrt(variance / unlit.size)
    assert abs(unlit.var() / variance - 1) < 5 * np.sqrt(2.2 / unlit.size)


def test_every_pixel_has_electrons_of_its_own() -> None:
    mueller, frame = np.zeros((3, 4, 16), np.float32), np.empty((3, 4), np.uint16)
    dark = np.zeros((3, 4), np.float32)
    dark[1, 2] = 4e6
    render.expose(mueller, np.eye(16)[0], 1.0, dark, render.Sensor(1e3, 0.0, 7.0, 16, 0), 1, frame)
    assert abs(int(frame[1, 2]) - 4007) < 5 * 2
    assert np.all(np.delete(frame.ravel(), 6) == 7)


def test_values_are_clipped_to_the_converters_range_and_shifted_left() -> None:
    bright = exposed(1e9, render.Sensor(2.0, 5.0, 100.0, 14, 2))
    assert np.all(bright == 16383 << 2)
    dark = exposed(0.0, render.Sensor(2.0, 50.0, 0.0, 14, 2))
    assert dark.min() == 0
    assert np.all(dark % 4 == 0)
    assert np.mean(dark == 0) == pytest.approx(0.5, abs=0.02)
    assert np.all(exposed(-5.0, render.Sensor(2.0, 0.0, 100.0, 12, 4)) == 100 << 4)


def test_noise_depends_on_key_and_pixel_alone() -> None:
    sensor = render.Sensor(2.0, 5.0, 100.0, 14, 0)
    first, again, other = (exposed(900.0, sensor, key) for key in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert abs(np.corrcoef(first.ravel(), other.ravel())[0, 1]) < 5 / np.sqrt(first.size)
    neighbours = np.corrcoef(first.ravel()[1:], first.ravel()[:-1])[0, 1]
    assert abs(neighbours) < 5 / np.sqrt(first.size)
    np.testing.assert_array_equal(exposed(900.0, sensor, 1, pixels=(10, 400)), first[:10])


BYTES_OF_A_FRAME = """
import hashlib, numpy as np
from pbrdf._kernels import render
axis = np.array([0.0, -1.0, 0.0])
scene = render.SphereScene(np.array([0.0, 0.0, 1000.0]), 25.0, np.array([700.0, 0.0, 600.0]), axis, axis)
image = render.render_mueller(render.Pinhole(900, 900, 30, 31), scene, (0.2, 1.5, 0.0, 1.0, 0.3), 61, 63, 2)
frame = np.empty((61, 63), np.uint16)
dark = np.full((61, 63), 7.0, np.float32)
render.expose(image, np.eye(16)[0], 3e5, dark, render.Sensor(2.0, 5.0, 50.0, 14, 2), 7, frame)
print(hashlib.sha256(np.asarray(image).tobytes() + frame.tobytes()).hexdigest())
"""


def test_same_bytes_for_any_number_of_threads(printed_by_threads: Callable[[str], set[str]]) -> None:
    assert len(printed_by_threads(BYTES_OF_A_FRAME)) == 1


def test_wrong_shapes_are_refused() -> None:
    sensor = render.Sensor(2.0, 5.0, 100.0, 14, 0)
    image, state, frame = np.zeros((4, 5, 16), np.float32), np.eye(16)[0], np.zeros((4, 5), np.uint16)
    dark = np.zeros((4, 5), np.float32)
    with pytest.raises(ValueError, match=r"state has shape \(15\), expected \(16\)"):
        render.expose(image, state[:15], 1.0, dark, sensor, 1, frame)
    with pytest.raises(ValueError, match=r"out has shape \(3, 5\), expected \(4, 5\)"):
        render.expose(image, state, 1.0, dark, sensor, 1, frame[:3])
    with pytest.raises(ValueError, match="mueller"):
        render.expose(image[..., :15].copy(), state, 1.0, dark, sensor, 1, frame)
    with pytest.raises(ValueError, match=r"dark_electrons has shape \(5, 4\), expected \(4, 5\)"):
        render.expose(image, state, 1.0, dark.T.copy(), sensor, 1, frame)
    with pytest.raises(TypeError):
        render.expose(image, state, 1.0, dark.astype(np.float64), sensor, 1, frame)
    with pytest.raises(TypeError):
        render.expose(image, state, 1.0, dark, sensor, 1, frame.astype(np.int16))
