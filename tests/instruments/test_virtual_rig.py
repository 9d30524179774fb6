from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray
from pbrdf._kernels import render
from scipy import stats

from pbrdf.errors import InputError
from pbrdf.instruments.interface import Setting
from pbrdf.instruments.virtual_beam import VirtualBeam
from pbrdf.instruments.virtual_geometry import UP, virtual_arm, virtual_flat, virtual_polarimeter
from pbrdf.instruments.virtual_rig import VirtualRig, lamp_power
from pbrdf.instruments.virtual_sphere import VirtualSphere
from pbrdf.settings.plan import Light
from pbrdf.settings.rig import read_rig

SOURCE = Path(__file__).resolve().parents[2] / "config/rig/virtual.yaml"
LIGHT = Light("041.00", 41.0)
STATE = (0.0, 25.0, 5.0, 90.0)
RADIUS_MM = 25.0
FRAMES = 400
UNLIKELY = 1e-6
"""Share of seeds that may fall outside a bound; the seed is fixed, so that a test stays as it is."""


@pytest.fixture
def settings() -> dict[str, Any]:
    """The project's virtual rig with a small camera, of which more pixels are hot."""
    rig = deepcopy(dict(read_rig(SOURCE)))
    rig["camera"] |= {"rows": 24, "columns": 28, "focal_px": 440, "principal_px": [13.6, 11.4]}
    rig["hot_pixels"] = {"share": 0.01, "electrons_per_s": 2.0e4}
    return rig


def _rig(settings: dict[str, Any], material: str = "plastic", radius_mm: float = RADIUS_MM) -> VirtualRig:
    return VirtualRig(settings, VirtualSphere(settings, material, radius_mm, SOURCE))


def _setting(exposure_s: float = 0.02, band_nm: int = 550, position: int = 0) -> Setting:
    return Setting(LIGHT, band_nm, STATE, exposure_s, position)


def _hot(settings: dict[str, Any]) -> NDArray[np.bool_]:
    """Pixels that a minute of darkness, without read noise, finds hot."""
    camera = settings["camera"] | {"read_noise_electrons": 0.0}
    frame = _rig(settings | {"camera": camera}).expose_dark("a minute", 60.0)
    return np.asarray(frame > 4 * camera["offset_dn"])


def _expected_electrons(settings: dict[str, Any], setting: Setting) -> NDArray[np.float64]:
    """Photo-electrons of a frame without noise, from the kernel's image and the instruments' places."""
    camera, sphere = settings["camera"], settings["spheres"]["plastic"]
    arm, optics = virtual_arm(settings), sphere["bands"][str(setting.band_nm)]
    angle = setting.light.angle_deg
    scene = render.SphereScene(
        centre=np.array([0.0, 0.0, settings["distance_mm"]]),
        radius=RADIUS_MM,
        light=arm.light_position(angle),
        generator_axis=arm.generator_x(angle),
        analyser_axis=np.array(UP),
    )
    pinhole = render.Pinhole(camera["focal_px"], camera["focal_px"], *camera["principal_px"])
    material = (sphere["roughness"], optics["index"], 0.0, optics["specular"], optics["albedo"])
    image = render.render_mueller(
        pinhole, scene, material, camera["rows"], camera["columns"], settings["samples"]
    )
    elements = virtual_polarimeter(settings, setting.band_nm)
    weights = elements.measurement_matrix(np.deg2rad([setting.state_deg]))[0]
    lamp = settings["lamp_electrons_per_s"][str(setting.band_nm)]
    light = image @ weights * virtual_flat(settings) * (lamp * lamp_power(settings, setting))
    dark = _hot(settings) * settings["hot_pixels"]["electrons_per_s"]
    electrons: NDArray[np.float64] = (light + dark) * setting.exposure_s
    return electrons


def test_the_same_id_gives_the_same_frame(settings: dict[str, Any]) -> None:
    one, other = _rig(settings), _rig(deepcopy(settings))
    frame = one.expose("041.00/550nm/s01/e0", _setting())
    one.expose("another", _setting(0.5))
    assert np.array_equal(frame, one.expose("041.00/550nm/s01/e0", _setting()))
    assert np.array_equal(frame, other.expose("041.00/550nm/s01/e0", _setting()))
    dark = one.expose_dark("041.00/dark/e0/r0", 0.02)
    assert np.array_equal(dark, other.expose_dark("041.00/dark/e0/r0", 0.02))


def test_every_frame_is_of_the_format_told(settings: dict[str, Any]) -> None:
    form = _rig(settings).frame_format
    assert (form.rows, form.columns, form.dtype, form.adc_bits, form.shift) == (24, 28, "uint16", 14, 2)
    for frame in (_rig(settings).expose("a", _setting()), _rig(settings).expose_dark("b", 0.02)):
        assert (frame.shape, frame.dtype) == ((24, 28), np.dtype(form.dtype))
        assert not np.any(frame & 0b11)


def test_noise_of_another_id_seed_or_material_is_independent(settings: dict[str, Any]) -> None:
    """Dark frames without hot pixels are noise: correlations stay within their sampling error."""
    del settings["hot_pixels"]
    frames = [_rig(settings).expose_dark(name, 0.02) for name in ("r0", "r1", "r10", "0r")]
    frames.append(_rig(settings, "gold").expose_dark("r0", 0.02))
    frames.append(_rig(settings | {"seed": 2021}).expose_dark("r0", 0.02))
    correlations = np.asarray(np.corrcoef(np.reshape(frames, (len(frames), -1)).astype(np.float64)))
    off_diagonal = correlations[np.triu_indices(len(frames), 1)]
    bound = stats.norm.isf(UNLIKELY / 2) / np.sqrt(frames[0].size)
    assert np.abs(off_diagonal).max() < bound


@pytest.mark.parametrize("exposure_s", [0.002, 0.02])
def test_frames_scatter_as_shot_and_read_noise_about_the_expectation(
    settings: dict[str, Any], exposure_s: float
) -> None:
    """Mean and variance of many frames: chi-square over the pixels, which are independent.

    Variance in steps of the converter: (electrons + read noise²) / gain² + 1/12 for the rounding.
    """
    camera, setting, rig = settings["camera"], _setting(exposure_s, position=40), _rig(settings)
    assert abs(lamp_power(settings, setting) - 1) > 0.005
    assert _hot(settings).any()
    electrons = _expected_electrons(settings, setting)
    gain = camera["electrons_per_dn"]
    mean = electrons / gain + camera["offset_dn"]
    variance = (electrons + camera["read_noise_electrons"] ** 2) / gain**2 + 1 / 12
    assert electrons.max() > 100
    assert np.sum(electrons == 0) > 50
    assert (mean + 6 * np.sqrt(variance)).max() < 2**14
    assert (mean - 6 * np.sqrt(variance)).min() > 0

    frames = np.stack([rig.expose(f"frame {n}", setting) for n in range(FRAMES)]) / 4.0
    pixels = electrons.size
    low, high = stats.chi2.interval(1 - UNLIKELY, pixels)
    assert low < np.sum((frames.mean(axis=0) - mean) ** 2 / (variance / FRAMES)) < high
    # a fourth moment above the Gaussian's widens the scatter of s²: Poisson's excess is 1 / electrons
    low, high = stats.chi2.interval(1 - UNLIKELY, pixels * (FRAMES - 1))
    widened = np.sqrt(1 + 0.5 * (electrons / gain**4 / variance**2).mean())
    middle = pixels * (FRAMES - 1)
    scatter = np.sum((FRAMES - 1) * frames.var(axis=0, ddof=1) / variance)
    assert middle - widened * (middle - low) < scatter < middle + widened * (high - middle)


def test_dark_frames_scatter_as_read_noise_about_the_offset(settings: dict[str, Any]) -> None:
    del settings["hot_pixels"]
    rig = _rig(settings)
    frames = np.stack([rig.expose_dark(f"dark {n}", 0.02) for n in range(100)]) / 4.0
    variance = (5.0 / 2.0) ** 2 + 1 / 12
    bound = stats.norm.isf(UNLIKELY / 2) * np.sqrt(variance / frames.size)
    assert frames.mean() == pytest.approx(48, abs=bound)
    low, high = stats.chi2.interval(1 - UNLIKELY, frames.size - 1)
    assert low < (frames.size - 1) * frames.var(ddof=1) / variance < high


def test_a_long_exposure_reaches_the_saturation_that_is_told(settings: dict[str, Any]) -> None:
    rig = _rig(settings)
    saturation = rig.frame_format.saturation
    assert saturation == (2**14 - 1) * 4
    frame = rig.expose("bright", _setting(20.0))
    saturated = frame >= saturation
    assert frame.max() == saturation
    assert 0.2 < saturated.mean() < 0.9
    expected = _expected_electrons(settings, _setting(20.0)) / 2.0 + 48
    assert np.all(saturated[expected > 17_000])
    assert not np.any(saturated[expected < 15_800])
    assert not np.any(rig.expose("short", _setting(0.002)) >= saturation)


@pytest.mark.parametrize("threads", ["1", "2", "3"])
def test_the_number_of_threads_does_not_change_a_byte(settings: dict[str, Any], threads: str) -> None:
    code = (
        "import hashlib, sys, yaml\n"
        "from pbrdf.instruments.interface import Setting\n"
        "from pbrdf.instruments.virtual_rig import VirtualRig\n"
        "from pbrdf.instruments.virtual_sphere import VirtualSphere\n"
        "from pbrdf.settings.plan import Light\n"
        "settings = yaml.safe_load(sys.stdin)\n"
        "rig = VirtualRig(settings, VirtualSphere(settings, 'plastic', 25.0, 'rig.yaml'))\n"
        "setting = Setting(Light('041.00', 41.0), 550, (0.0, 25.0, 5.0, 90.0), 0.02, 3)\n"
        "frames = rig.expose('a', setting).tobytes() + rig.expose_dark('b', 0.02).tobytes()\n"
        "print(rig.identity, hashlib.sha256(frames).hexdigest())\n"
    )
    run = subprocess.run(
        [sys.executable, "-c", code],
        input=yaml.safe_dump(settings),
        env=os.environ | {"OMP_NUM_THREADS": threads},
        capture_output=True,
        text=True,
        check=True,
    )
    rig = _rig(settings)
    frames = rig.expose("a", _setting(position=3)).tobytes() + rig.expose_dark("b", 0.02).tobytes()
    assert run.stdout.strip() == f"{rig.identity} {hashlib.sha256(frames).hexdigest()}"


def test_an_unknown_sphere_is_refused(settings: dict[str, Any]) -> None:
    with pytest.raises(InputError) as refused:
        _rig(settings, "jade")
    assert (refused.value.source, refused.value.field) == (str(SOURCE), "spheres")
    assert "`jade`" in refused.value.problem
    assert "plastic, gold" in refused.value.remedy


def test_the_identity_is_of_all_that_frames_depend_on(settings: dict[str, Any]) -> None:
    before = _rig(settings).identity
    assert _rig(deepcopy(settings)).identity == before
    changed = [settings | {"seed": 7}, settings | {"distance_mm": 999}, settings | {"vignetting": 0.07}]
    changed.append(settings | {"lamp_drift": {"amplitude": 0.01, "period_states": 151}})
    changed.append(settings | {"hot_pixels": {"share": 0.01, "electrons_per_s": 2.1e4}})
    for part, value in (("camera", {"offset_dn": 49}), ("arm", {"radius_mm": 801})):
        changed.append(settings | {part: settings[part] | value})
    spheres = deepcopy(settings["spheres"])
    spheres["plastic"]["bands"]["550"]["albedo"] = 0.2
    changed.append(settings | {"spheres": spheres})
    identities = {_rig(rig).identity for rig in changed}
    identities |= {_rig(settings, "gold").identity, _rig(settings, radius_mm=26.0).identity}
    assert len(identities | {before}) == len(changed) + 3


def test_the_identity_leaves_out_what_no_frame_of_the_subject_shows(settings: dict[str, Any]) -> None:
    spheres = deepcopy(settings["spheres"])
    spheres["gold"]["roughness"] = 0.5
    other = settings | {"spheres": spheres, "lamp_disc": {"radius_mm": 3.0, "radiance": 1.0}}
    assert _rig(other).identity == _rig(settings).identity
    beam = VirtualBeam(settings, "air", SOURCE)
    assert VirtualRig(other | {"lamp_disc": settings["lamp_disc"]}, beam).identity == (
        VirtualRig(settings, beam).identity
    )


def test_vignetting_dims_the_light_by_the_square_of_the_distance(settings: dict[str, Any]) -> None:
    flat = virtual_flat(settings)
    assert (flat.shape, flat.dtype) == ((24, 28), np.dtype(np.float32))
    row, column = np.indices(flat.shape)
    square = (column - 13.6) ** 2 + (row - 11.4) ** 2
    corner = 13.6**2 + 11.6**2
    np.testing.assert_allclose(flat, 1 - 0.08 * square / corner, rtol=1e-6)
    assert flat.min() == flat[23, 0] == np.float32(0.92)


def test_vignetting_leaves_the_dark_as_it_is(settings: dict[str, Any]) -> None:
    other = _rig(settings | {"vignetting": 0.5})
    np.testing.assert_array_equal(other.expose_dark("b", 0.02), _rig(settings).expose_dark("b", 0.02))


def test_without_vignetting_the_field_is_flat(settings: dict[str, Any]) -> None:
    del settings["vignetting"]
    assert np.all(virtual_flat(settings) == 1.0)


def test_the_share_of_hot_pixels_is_the_one_told(settings: dict[str, Any]) -> None:
    settings["camera"] |= {"rows": 300, "columns": 400}
    hot = _hot(settings)
    bound = stats.norm.isf(UNLIKELY / 2) * np.sqrt(0.01 * 0.99 / hot.size)
    assert hot.mean() == pytest.approx(0.01, abs=bound)
    neighbours = np.asarray(np.corrcoef(hot[:, 1:].ravel(), hot[:, :-1].ravel()))[0, 1]
    assert abs(neighbours) < 5 / np.sqrt(hot.size)


def test_hot_pixels_stay_where_they_are_until_the_seed_changes(settings: dict[str, Any]) -> None:
    settings["camera"] |= {"rows": 100, "columns": 100}
    hot = _hot(settings)
    gold = VirtualRig(settings, VirtualSphere(settings, "gold", RADIUS_MM, SOURCE))
    for frame in (gold.expose_dark("other", 1.0), gold.expose("lit", _setting(0.5, 650, 9))):
        np.testing.assert_array_equal(frame[0] > 4 * 1000, hot[0])
    assert not np.array_equal(hot, _hot(settings | {"seed": 2021}))


def test_hot_pixels_collect_electrons_as_the_time_says(settings: dict[str, Any]) -> None:
    """Mean and variance over many frames: Poisson's, at five sigma."""
    settings["camera"] |= {"rows": 100, "columns": 100}
    rig, hot = _rig(settings), _hot(settings)
    for exposure_s in (0.02, 0.2):
        frames = np.stack([rig.expose_dark(f"dark {n}", exposure_s) for n in range(40)])[:, hot] / 4.0
        electrons = 2.0e4 * exposure_s
        variance = (electrons + 5.0**2) / 2.0**2 + 1 / 12
        assert abs(frames.mean() - 48 - electrons / 2) < 5 * np.sqrt(variance / frames.size)
        assert abs(frames.var() / variance - 1) < 5 * np.sqrt(2 / frames.size)


def test_the_lamp_drifts_with_the_states_taken(settings: dict[str, Any]) -> None:
    """A sine of the told amplitude and period; its mean over a period is one."""
    power = np.array([lamp_power(settings, _setting(position=n)) for n in range(300)])
    np.testing.assert_allclose(power[:150], power[150:], rtol=1e-12)
    assert power[:150].mean() == pytest.approx(1.0, abs=1e-12)
    assert power.max() == pytest.approx(1.01, abs=0.01 * (1 - np.cos(np.pi / 150)))
    np.testing.assert_allclose(power[:75] + power[75:150], 2.0, atol=1e-12)


def test_the_phase_of_the_drift_is_of_seed_light_and_band(settings: dict[str, Any]) -> None:
    here = lamp_power(settings, _setting())
    other = Setting(Light("042.00", 42.0), 550, STATE, 0.02, 0)
    elsewhere = {lamp_power(settings, _setting(band_nm=450)), lamp_power(settings, other)}
    elsewhere.add(lamp_power(settings | {"seed": 7}, _setting()))
    assert len(elsewhere | {here}) == 4
    assert lamp_power(settings, Setting(LIGHT, 550, (0.0, 1.0, 2.0, 90.0), 3.0, 0)) == here
    del settings["lamp_drift"]
    assert lamp_power(settings, _setting(position=7)) == 1.0
