"""Noise, range and flat field of a virtual camera, and its lamp's power, held against the rig's truth."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from rig_truth import write_truth

from pbrdf.calibration.flat_field import FlatField
from pbrdf.calibration.radiometry import Radiometry
from pbrdf.calibration.sensor import Sensor
from pbrdf.capture.run import capture
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FrameStore
from pbrdf.instruments.emulators.scene import Renderer
from pbrdf.instruments.interface import Setting, Taken
from pbrdf.instruments.virtual_geometry import virtual_flat, virtual_polarimeter
from pbrdf.instruments.virtual_plane import VirtualField, VirtualTile
from pbrdf.instruments.virtual_rig import VirtualRig
from pbrdf.reconstruction.mueller_image import reconstruct
from pbrdf.reconstruction.session_radiometry import calibrate_flat, calibrate_radiometry, measure_sensor
from pbrdf.settings.plan import CapturePlan, Light
from pbrdf.settings.rig import read_rig

SOURCE = Path(__file__).resolve().parents[2] / "config/rig/virtual.yaml"
BANDS = (450, 550, 650)
SECONDS = (0.002, 0.004, 0.008, 0.016, 0.026, 0.036)
STATES = tuple((0.0, 25.0 * n % 360, 5.0 * n, 90.0) for n in range(36))
FIELD = CapturePlan((Light("000.00", 0.0),), BANDS, ((0.0, 0.0, 0.0, 0.0),) * 4, SECONDS, 8)
TILE = CapturePlan((Light("020.00", 20.0),), BANDS, STATES, (0.06,), 4, (0, 12, 24, 36))
REFLECTANCE = 0.99
GIVEN = ("camera", "polarimeter", "lights")
Float = NDArray[np.float64]


class RenderedRig:
    """A rig without instruments."""

    def __init__(self, renderer: Renderer) -> None:
        self.renderer = renderer
        self.identity, self.frame_format = renderer.identity, renderer.frame_format

    def expose(self, frame_id: str, setting: Setting) -> Taken:
        return Taken(self.renderer.expose(frame_id, setting), {})

    def expose_dark(self, frame_id: str, exposure_s: float) -> Taken:
        return Taken(self.renderer.expose_dark(frame_id, exposure_s), {})


def small_rig(**changes: Any) -> dict[str, Any]:
    """Of 48 × 48 pixels; its lamp does not drift unless `changes` say so."""
    rig = {**read_rig(SOURCE).with_no_sphere(), **changes}
    if "lamp_drift" not in changes:
        del rig["lamp_drift"]
    camera = {**rig["camera"], "rows": 48, "columns": 48, "focal_px": 800, "principal_px": [23.6, 23.9]}
    return {**rig, "camera": camera | changes.get("camera", {})}


def field(rig: dict[str, Any], folder: Path, plan: CapturePlan = FIELD) -> Path:
    """Photograph the bright field; gives its manifest."""
    return capture(plan, "flat", RenderedRig(VirtualRig(rig, VirtualField(rig))), folder / "flat")[0]


def tile(rig: dict[str, Any], folder: Path, plan: CapturePlan = TILE) -> list[Path]:
    """Photograph the white tile; gives its manifests."""
    return capture(
        plan, "spectralon", RenderedRig(VirtualRig(rig, VirtualTile(rig, REFLECTANCE))), folder / "spectralon"
    )


def frames(manifest: Path) -> FrameStore:
    return FrameStore.open(manifest.parent / "frames.zarr")


def sensor(rig: dict[str, Any], folder: Path, plan: CapturePlan = FIELD) -> Sensor:
    return measure_sensor(frames(field(rig, folder, plan)))


def calibrated(rig: dict[str, Any], folder: Path, plan: CapturePlan = TILE) -> Path:
    """Both documents of a session; gives ``radiometry.json``."""
    flat_manifest = field(rig, folder)
    calibrate_flat(flat_manifest, folder / "flat.json")
    document = folder / "radiometry.json"
    given = {kind: write_truth(kind, rig, folder / f"{kind}.json") for kind in GIVEN}
    calibrations = {**given, "flat": folder / "flat.json"}
    calibrate_radiometry(flat_manifest, tile(rig, folder, plan), calibrations, REFLECTANCE, document)
    return document


def test_gain_and_read_noise_are_within_their_standard_errors(tmp_path: Path) -> None:
    """Twelve seeds: deviations in standard errors have mean 0 ± 0.29 and mean square 1 ± 0.41."""
    gain = 2.0
    read_variance = (5.0 * gain) ** 2 + 4.0**2 / 12
    deviations = []
    for seed in range(12):
        rig = small_rig(seed=seed, lamp_drift={"amplitude": 0.01, "period_states": 150})
        transfer = sensor(rig, tmp_path / str(seed), replace(FIELD, bands_nm=(550,))).transfer
        deviations.append(
            (
                (transfer.dn_per_electron - gain) / transfer.dn_per_electron_error,
                (transfer.read_variance - read_variance) / transfer.read_variance_error,
            )
        )
        assert not transfer.beyond_noise
        assert transfer.dn_per_electron_error < 0.015 * gain
        assert transfer.read_variance_error < 0.01 * read_variance
    scores = np.array(deviations)
    assert (np.abs(scores.mean(axis=0)) < 3 / np.sqrt(12)).all()
    assert (np.abs((scores**2).mean(axis=0) - 1) < 3 * np.sqrt(2 / 12)).all()


def test_dark_frames_from_start_and_end_of_the_run_are_known_as_such(tmp_path: Path) -> None:
    rig = small_rig()
    ready = RenderedRig(VirtualRig(rig, VirtualField(rig)))
    (manifest,) = capture(FIELD, "flat", ready, tmp_path / "ends", darks_at_ends=True)
    found, usual = measure_sensor(frames(manifest)), sensor(rig, tmp_path)
    assert (found.darks_at_ends, usual.darks_at_ends) == (True, False)
    assert found.content() == usual.content()


def test_a_lamp_that_changes_between_repeats_adds_no_noise(tmp_path: Path) -> None:
    """Power that changes by 10 % in four frames would be 40 times the shot noise of the brightest."""
    rig = small_rig(lamp_drift={"amplitude": 0.05, "period_states": 8})
    measured = sensor(rig, tmp_path)
    assert not measured.transfer.beyond_noise
    assert measured.transfer.dn_per_electron == pytest.approx(
        2.0, abs=4 * measured.transfer.dn_per_electron_error
    )


def test_the_dark_level_is_that_of_the_camera(tmp_path: Path) -> None:
    for point in sensor(small_rig(), tmp_path).dark:
        # 48 steps of 4 DN; of 2304 · 8 values with a noise of 10 DN
        assert point.level_dn == pytest.approx(192, abs=0.4)


def test_a_straight_camera_is_linear_up_to_where_it_was_tested(tmp_path: Path) -> None:
    measured = sensor(small_rig(), tmp_path)
    straight = measured.linearity
    assert straight.limit_dn is None
    assert measured.usable_below_dn == measured.saturation_dn == 65532
    # three bands at 36 ms: up to 0.036 s · 3.3e6 / 4 electrons of 2 DN
    assert 0.9 * 59400 < straight.tested_to_dn < 65532
    assert straight.largest_deviation < 0.003
    assert (np.abs(straight.deviation) < 5 * straight.deviation_error).all()


class Bending(VirtualRig):
    """A rig whose camera lacks 15 % of what is above 40000 DN."""

    def expose(self, frame_id: str, setting: Any) -> NDArray[Any]:
        raw = super().expose(frame_id, setting).astype(np.float64)
        return (raw - 0.15 * np.maximum(raw - 40000.0, 0.0)).astype(np.uint16)


def test_a_camera_that_bends_is_not_used_where_it_does(tmp_path: Path) -> None:
    """It lacks 0.5 % of the signal at 41400 DN."""
    rig = small_rig()
    plan = replace(FIELD, exposures_s=tuple(np.linspace(0.004, 0.036, 9)))
    manifest = capture(plan, "flat", RenderedRig(Bending(rig, VirtualField(rig))), tmp_path)[0]
    measured = measure_sensor(frames(manifest))
    # levels are told in 64 steps of 1024 DN
    assert 40000 < measured.usable_below_dn < 41400 + 2048
    content = measured.content()
    assert content["saturation_dn"] == measured.usable_below_dn
    assert measured.transfer.dn_per_electron == pytest.approx(
        2.0, abs=4 * measured.transfer.dn_per_electron_error
    )


def test_values_beyond_the_linear_range_do_not_count(tmp_path: Path) -> None:
    """The tile at 5 and 150 ms: of the long exposure some values are bent, and are left out."""
    rig = small_rig()
    plan = replace(TILE, bands_nm=(550,), exposures_s=(0.005, 0.15))
    manifest = capture(plan, "tile", RenderedRig(Bending(rig, VirtualTile(rig, REFLECTANCE))), tmp_path)[0]
    polarimeter = virtual_polarimeter(rig, 550)
    whole = (slice(0, 48), slice(0, 48))

    def brightness(saturation_dn: float) -> float:
        radiometry = Radiometry(2.0, 10.0, {}, saturation_dn)
        image = reconstruct(frames(manifest), 550, polarimeter, radiometry, whole, virtual_flat(rig))
        return float(np.nanmean(image.mueller[0]))

    irradiance = VirtualTile(rig, REFLECTANCE).mueller_image(20.0, 550)[..., 0].mean()
    truth = 2.0 * rig["lamp_electrons_per_s"]["550"] * float(irradiance)
    assert brightness(40000.0) == pytest.approx(truth, rel=0.002)
    assert brightness(np.inf) < 0.99 * truth


def test_the_flat_field_is_the_vignetting_within_its_noise(tmp_path: Path) -> None:
    rig = small_rig()
    calibrate_flat(field(rig, tmp_path), tmp_path / "flat.json")
    flat = FlatField.read(tmp_path / "flat.json")
    truth = virtual_flat(rig).astype(np.float64)
    truth /= truth[21:27, 21:27].mean()
    content = json.loads((tmp_path / "flat.json").read_text())
    assert content["verdict"].startswith("good")
    for nm in BANDS:
        response = flat.at(nm, (slice(0, 48), slice(0, 48)), (48, 48))
        known = np.isfinite(response)
        error = content["bands"][str(nm)]["pixel_relative_standard_error"]
        assert error < 0.004
        relative = response[known] / truth[known] - 1
        # of 2304 pixels the root mean square is known to 1.5 %, the stated error to 0.9 %
        assert np.sqrt((relative**2).mean()) == pytest.approx(error, rel=0.08)
        # the middle's 36 pixels share their own error with all
        assert abs(relative.mean()) < 4 * error / 6


def test_hot_dead_and_stuck_pixels_have_no_flat_field(tmp_path: Path) -> None:
    rig = small_rig(hot_pixels={"share": 0.01, "electrons_per_s": 1e6})

    class Defects(VirtualRig):
        def expose(self, frame_id: str, setting: Any) -> NDArray[Any]:
            frame = super().expose(frame_id, setting)
            frame[3, 4] = 200
            frame[10, 40] = np.minimum(3.0 * frame[10, 40], 65532)
            return frame

    manifest = capture(FIELD, "flat", RenderedRig(Defects(rig, VirtualField(rig))), tmp_path / "flat")[0]
    calibrate_flat(manifest, tmp_path / "flat.json")
    whole = (slice(0, 48), slice(0, 48))
    missing = np.isnan(FlatField.read(tmp_path / "flat.json").at(550, whole, (48, 48)))
    # 2000 electrons in the shortest exposure, at 4 DN for two
    expected = frames(manifest).read_dark(*whole)[0].mean(axis=0) > 2000
    assert 10 < expected.sum() < 40
    expected[3, 4] = expected[10, 40] = True
    np.testing.assert_array_equal(missing, expected)


def test_the_lamps_power_is_that_of_the_rig(tmp_path: Path) -> None:
    rig = small_rig()
    document = calibrated(rig, tmp_path)
    content = json.loads(document.read_text())
    assert content["verdict"].startswith("good")
    for nm, scale in Radiometry.read(document).scale.items():
        truth = 2.0 * rig["lamp_electrons_per_s"][str(nm)]
        error = content["scale_standard_error"][str(nm)]
        assert error < 0.0006 * truth
        assert scale == pytest.approx(truth, rel=0.002)
        # the vignetting is 1 at its centre, the flat field over its middle: 0.03 %
        assert abs(scale - truth) < 4 * error + 0.0003 * truth


def test_a_lamp_that_wanders_shows_between_lights(tmp_path: Path) -> None:
    """Of one light the error knows nothing of it; of several it does."""
    rig = small_rig(lamp_drift={"amplitude": 0.01, "period_states": 150})
    lights = tuple(Light(f"{angle:06.2f}", float(angle)) for angle in (10, 16, 22, 28, 34, 40))
    document = calibrated(rig, tmp_path, replace(TILE, lights=lights))
    content = json.loads(document.read_text())
    assert list(content["scale_by_light"]) == [light.id for light in lights]
    for nm, scale in Radiometry.read(document).scale.items():
        truth = 2.0 * rig["lamp_electrons_per_s"][str(nm)]
        error = content["scale_standard_error"][str(nm)]
        assert 0.001 < error / truth < 0.006
        assert abs(scale - truth) < 4 * error


def test_the_same_photographs_give_the_same_bytes(tmp_path: Path) -> None:
    rig = small_rig()
    first = calibrated(rig, tmp_path).read_bytes()
    images = (tmp_path / "flat.exr").read_bytes()
    assert calibrated(rig, tmp_path).read_bytes() == first
    assert (tmp_path / "flat.exr").read_bytes() == images


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"states_deg": FIELD.states_deg[:1]}, "states_deg: count 1; take 2 or more"),
        ({"states_deg": STATES[:4]}, "states_deg: differ; repeat one state"),
        ({"exposures_s": SECONDS[:2]}, "exposures_s: count 2; take 3 or more"),
        ({"darks": 1}, "darks: count 1; take 2 or more"),
        ({"exposures_s": (0.002, 0.1, 0.2, 0.3)}, "450nm: is near saturation in all but 1 exposures"),
        ({"exposures_s": (1e-7, 2e-7, 3e-7)}, "450nm: shows no light"),
    ],
)
def test_a_flat_field_that_tells_too_little_is_refused(
    tmp_path: Path, changes: dict[str, Any], words: str
) -> None:
    manifest = field(small_rig(), tmp_path, replace(FIELD, **changes))
    with pytest.raises(InputError, match=words):
        calibrate_flat(manifest, tmp_path / "flat.json")
    assert not list(tmp_path.glob("flat.*"))


def test_frames_that_are_copies_are_refused(tmp_path: Path) -> None:
    class Copying(VirtualRig):
        def expose(self, frame_id: str, setting: Any) -> NDArray[Any]:
            return super().expose("the same", replace(setting, position=0))

        def expose_dark(self, frame_id: str, exposure_s: float) -> NDArray[Any]:
            return super().expose_dark("the same", exposure_s)

    rig = small_rig()
    manifest = capture(FIELD, "flat", RenderedRig(Copying(rig, VirtualField(rig))), tmp_path)[0]
    with pytest.raises(InputError, match="repeats: do not differ in any value"):
        measure_sensor(frames(manifest))


def test_a_tile_that_is_not_lit_is_refused(tmp_path: Path) -> None:
    rig = small_rig()
    with pytest.raises(InputError, match="450nm: shows the lit tile in 0 % of its middle"):
        calibrated(rig, tmp_path, replace(TILE, exposures_s=(2e-6,)))
    assert not (tmp_path / "radiometry.json").exists()
