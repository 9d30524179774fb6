"""The tile's geometry, and what verdicts say of noise, range, lamp and flat field."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.flat_field import FlatField, measure_flat, measured_flat
from pbrdf.calibration.lamp_scale import LampScale, combined, lamp_scale, middle_window, tile_irradiance
from pbrdf.calibration.linearity import Linearity
from pbrdf.calibration.measured_radiometry import measured_radiometry
from pbrdf.calibration.photon_transfer import TransferPoint, fit_transfer
from pbrdf.calibration.radiometry import Radiometry
from pbrdf.calibration.sensor import Sensor
from pbrdf.errors import InputError
from pbrdf.formats.documents import write_document
from pbrdf.optics.arm import Arm

CAMERA = Camera((800.0, 800.0), (31.5, 31.5), 64, 64)
ARM = Arm((0.0, 0.0, 1000.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0), 800.0, (0.0, -1.0, 0.0))
WINDOW = middle_window(64, 64)
GOOD = LampScale(5e6, 1e3, 0.001, 0.0005, 0.002, 1000)
STEADY = (0.0, 0.0)
Float = NDArray[np.float64]


def point(signal: float, variance: float, band_nm: int | None = 550) -> TransferPoint:
    return TransferPoint(band_nm, 0.01, signal + 200, signal, variance, 4, 10000)


def sensor(*points: TransferPoint, **changes: Any) -> Sensor:
    """By default on the line 100 + 2 S."""
    line = points or tuple(point(s, 100 + 2 * s, 550 if s else None) for s in (0, 1e3, 1e4, 4e4))
    straight = Linearity(np.array([3e4]), np.array([0.001]), np.array([0.0001]), None, 6e4)
    made = Sensor(fit_transfer(line, "flat"), straight, 4.0, 65532.0, (line[0],), 0.0)
    return replace(made, **changes)


def verdict(measured: Sensor, scale: LampScale = GOOD) -> str:
    return str(measured_radiometry(measured, {"020.00": {550: scale}}, 0.99)["verdict"])


def document(folder: Path, measured: Sensor, scale: LampScale = GOOD) -> Path:
    path = folder / "radiometry.json"
    write_document(path, "radiometry/1", measured_radiometry(measured, {"020.00": {550: scale}}, 0.99))
    return path


def test_the_window_is_the_middle_half() -> None:
    assert middle_window(48, 64) == (slice(12, 36), slice(16, 48))


@pytest.mark.parametrize("angle_deg", [0.0, 20.0, 75.0])
def test_irradiance_falls_with_cosine_and_square_of_distance(angle_deg: float) -> None:
    """At the arm's centre it is cos(angle) / (0.8 m)²; beside it, that of the law of cosines."""
    odd = Camera((800.0, 800.0), (32.0, 32.0), 65, 65)
    irradiance = tile_irradiance(odd, ARM, angle_deg, (slice(0, 65), slice(0, 65)))
    cosine, sine = np.cos(np.deg2rad(angle_deg)), np.sin(np.deg2rad(angle_deg))
    assert irradiance[32, 32] == pytest.approx(cosine / 0.64, rel=1e-12)
    # 32 px at 800 px a metre from 1 m are 40 mm; the light is 0.8 m away, `sine` of it across
    x, _, _ = ARM.light_position(angle_deg)
    assert abs(x) == pytest.approx(800 * sine)
    square = 0.64 + 0.04**2 - 2 * 0.04 * x / 1000
    assert irradiance[32, 64] == pytest.approx(0.8 * cosine / square**1.5, rel=1e-12)


def test_a_tile_faces_the_camera_wherever_the_arm_has_its_centre() -> None:
    aside = replace(ARM, centre_mm=(100.0, -50.0, 900.0))
    column, row = CAMERA.project(aside.centre_mm)
    window = (
        slice(round(float(row)), round(float(row)) + 1),
        slice(round(float(column)), round(float(column)) + 1),
    )
    normal = -np.array(aside.centre_mm) / np.linalg.norm(aside.centre_mm)
    spoke = aside.light_position(20.0) - aside.centre_mm
    expected = 1e6 * (spoke @ normal) / 800.0**3
    assert tile_irradiance(CAMERA, aside, 20.0, window)[0, 0] == pytest.approx(expected, rel=2e-3)


def tile(scale: float = 4e6, noise: float = 0.002) -> tuple[Float, Float, Float]:
    irradiance = tile_irradiance(CAMERA, ARM, 20.0, WINDOW)
    m00 = scale * 0.99 / np.pi * irradiance
    scatter = np.random.default_rng(3).normal(0, noise, m00.shape)
    return m00 * (1 + scatter), (noise * m00) ** 2, irradiance


def test_dust_and_missing_pixels_do_not_matter() -> None:
    m00, variance, irradiance = tile()
    m00[4:6, 7:12] *= 0.7
    m00[20, :3] = np.nan
    found = lamp_scale(m00, variance, irradiance, 0.99, STEADY, 550, "tile")
    assert found.pixels == 1024 - 13
    assert found.standard_error == pytest.approx(4e6 * 0.002 / 1011**0.5, rel=0.1)
    assert found.scale == pytest.approx(4e6, abs=4 * found.standard_error)
    drifting = lamp_scale(m00, variance, irradiance, 0.99, (0.01, 0.001), 550, "tile")
    assert drifting.standard_error == pytest.approx(np.hypot(found.standard_error, 0.001 * found.scale))
    assert abs(found.unevenness) < 4 * found.unevenness_error


def test_a_tile_that_leans_is_uneven() -> None:
    m00, variance, irradiance = tile()
    m00 *= 1 + 0.04 * np.linspace(-1, 1, 32)
    found = lamp_scale(m00, variance, irradiance, 0.99, STEADY, 550, "tile")
    # the outer quarters' middles lie at three quarters of the edge
    assert abs(found.unevenness) == pytest.approx(0.03, abs=0.002)
    words = verdict(sensor(), found)
    assert words.startswith("poor: ")
    assert "at 550 nm a part of the tile is 3" in words
    assert "check its tilt" in words


def test_light_from_behind_and_darkness_are_refused() -> None:
    m00, variance, irradiance = tile()
    with pytest.raises(InputError, match="angle_deg: puts the light behind the tile"):
        lamp_scale(m00, variance, tile_irradiance(CAMERA, ARM, 120.0, WINDOW), 0.99, STEADY, 550, "tile")
    with pytest.raises(InputError, match="550nm: shows the lit tile in 0 % of its middle"):
        lamp_scale(0.01 * m00, variance, irradiance, 0.99, STEADY, 550, "tile")


def test_several_lights_tell_the_error_by_their_scatter() -> None:
    lights = [replace(GOOD, scale=scale) for scale in (4.9e6, 5e6, 5.1e6, 5.2e6)]
    both = combined(lights)
    assert both.scale == pytest.approx(5.05e6)
    assert both.standard_error == pytest.approx(np.std([4.9e6, 5e6, 5.1e6, 5.2e6], ddof=1) / 2)
    assert combined([GOOD]) == GOOD
    assert combined([GOOD, GOOD]).standard_error == pytest.approx(1e3 / 2**0.5)


def test_a_good_radiometry_is_read_back(tmp_path: Path) -> None:
    path = document(tmp_path, sensor())
    read = Radiometry.read(path)
    assert read.dn_per_electron == pytest.approx(2.0)
    assert read.read_noise_dn == pytest.approx(10.0)
    assert (read.scale, read.saturation_dn) == ({550: 5e6}, np.inf)
    assert verdict(sensor()).startswith("good: 2 DN an electron, read noise 10 DN, linear to 0.1 %")


def test_dark_frames_from_start_and_end_are_said() -> None:
    words = "dark frames from start and end of the run only"
    assert words in verdict(replace(sensor(), darks_at_ends=True))
    assert words not in verdict(sensor())


def test_a_limit_of_the_linear_range_is_read_back(tmp_path: Path) -> None:
    straight = Linearity(np.array([3e4]), np.array([0.001]), np.array([0.0001]), 5e4, 6e4)
    bent = sensor(linearity=straight)
    assert Radiometry.read(document(tmp_path, bent)).saturation_dn == 5e4
    assert "fair: " in verdict(bent)
    assert "from 50000 DN on, 76 % of saturation" in verdict(bent)


@pytest.mark.parametrize(
    ("measured", "level", "words"),
    [
        (sensor(dark_clipped_share=0.2), "poor", "20 % of the dark values are zero"),
        (
            sensor(linearity=Linearity(np.array([]), np.array([]), np.array([]), 900.0, 6e4)),
            "unusable",
            "check dark frames and exposure times",
        ),
        (
            sensor(linearity=Linearity(np.array([9e3]), np.array([0.0]), np.array([1e-4]), None, 1e4)),
            "fair",
            "linearity is known up to 15 % of saturation",
        ),
        (
            sensor(point(0, 100, None), point(1e3, 101), point(1e4, 99), point(4e4, 100)),
            "unusable",
            "the noise does not grow with the signal",
        ),
        (
            sensor(point(0, 100, None), point(1e3, 2100), point(1e4, 20100), point(4e4, 100100)),
            "poor",
            "off its line: keep the light the same",
        ),
    ],
)
def test_what_is_wrong_with_the_camera_is_said(measured: Sensor, level: str, words: str) -> None:
    assert verdict(measured).startswith(f"{level}: ")
    assert words in verdict(measured)


def test_a_lamp_that_changes_or_is_hardly_seen_is_said() -> None:
    assert "fair: " in verdict(sensor(), replace(GOOD, lamp_range=0.014))
    assert "the lamp changed by 1.4 %" in verdict(sensor(), replace(GOOD, lamp_range=0.014))
    assert "power is uncertain by 2 %: expose the tile longer" in verdict(
        sensor(), replace(GOOD, standard_error=1e5)
    )


def test_what_concerns_several_bands_is_said_once() -> None:
    uneven = {nm: replace(GOOD, unevenness=nm / 1e4) for nm in (450, 550, 650)}
    scales = uneven | {500: GOOD, 600: replace(GOOD, lamp_range=0.02), 700: replace(GOOD, unevenness=0.3)}
    words = measured_radiometry(sensor(), {"020.00": scales}, 0.99)["verdict"]
    assert words.startswith("unusable: ")
    assert words.endswith("; at 700 nm a part of the tile is 30 % off: check its tilt, lights and flat field")
    del scales[700]
    words = measured_radiometry(sensor(), {"020.00": scales}, 0.99)["verdict"]
    assert words.startswith("poor: ")
    assert words.endswith(
        "; at 450, 550 and 650 nm a part of the tile is up to 6.5 % off: "
        "check its tilt, lights and flat field"
    )
    steady = {nm: replace(GOOD, lamp_range=0.02) for nm in (450, 550)}
    words = measured_radiometry(sensor(), {"020.00": steady}, 0.99)["verdict"]
    assert words.count("meanwhile: let it warm up") == 1
    assert "at 450 and 550 nm the lamp changed by up to 2 %" in words


def test_an_unusable_radiometry_is_refused_by_its_reader(tmp_path: Path) -> None:
    path = document(tmp_path, sensor(), replace(GOOD, unevenness=0.3))
    with pytest.raises(InputError, match=r"verdict: is `unusable: .*part of the tile is 30 % off"):
        Radiometry.read(path)


def test_read_noise_is_not_below_that_of_the_converters_steps() -> None:
    """Dark values that never leave one step."""
    quiet = sensor(point(0, 0.0, None), point(1e3, 2e3), point(1e4, 2e4), point(4e4, 8e4))
    assert quiet.read_noise_dn == pytest.approx(4 / 12**0.5)


def noisy_flat(error: float) -> NDArray[np.float32]:
    """Four repeats whose mean has that relative error."""
    scatter = np.random.default_rng(5).normal(0, 2 * error, (4, 40, 40))
    return (100 * (1 + scatter)).astype(np.float32)


@pytest.mark.parametrize(("error", "level"), [(0.002, "good"), (0.02, "poor"), (0.08, "unusable")])
def test_the_flat_fields_noise_decides_its_verdict(tmp_path: Path, error: float, level: str) -> None:
    flat = measure_flat(noisy_flat(error), 550, "flat")
    assert flat.relative_error == pytest.approx(error, rel=0.05)
    path = tmp_path / "flat.json"
    content = measured_flat(path, {550: flat})
    assert content["verdict"].startswith(f"{level}: ")
    write_document(path, "flat/1", content)
    if level == "unusable":
        with pytest.raises(InputError, match="verdict: is `unusable"):
            FlatField.read(path)
    else:
        assert FlatField.read(path).bands_nm == (550,)


def test_a_flat_field_without_light_or_middle_is_refused() -> None:
    with pytest.raises(InputError, match="550nm: shows no light in any pixel"):
        measure_flat(np.full((4, 40, 40), np.nan, np.float32), 550, "flat")
    hollow = noisy_flat(0.002)
    hollow[:, 15:25, 15:25] = np.nan
    with pytest.raises(InputError, match="550nm: has no usable pixel in the middle"):
        measure_flat(hollow, 550, "flat")
