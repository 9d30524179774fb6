"""A session's photographs of flat field and Spectralon tile to its ``flat.json`` and ``radiometry.json``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.flat_field import KIND as FLAT
from pbrdf.calibration.flat_field import FlatField, MeasuredFlat, measure_flat, measured_flat
from pbrdf.calibration.lamp_scale import LampScale, lamp_scale, middle_window, tile_irradiance
from pbrdf.calibration.lights import read_lights
from pbrdf.calibration.linearity import level_sums, linearity
from pbrdf.calibration.measured_radiometry import measured_radiometry
from pbrdf.calibration.photon_transfer import (
    LEAST_EXPOSURES,
    dark_points,
    fit_transfer,
    flat_points,
    require_light,
)
from pbrdf.calibration.polarimeter import PolarimeterCalibration
from pbrdf.calibration.radiometry import KIND as RADIOMETRY
from pbrdf.calibration.radiometry import Radiometry
from pbrdf.calibration.sensor import Sensor
from pbrdf.capture.frames import open_frames
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FrameStore
from pbrdf.formats.documents import write_document
from pbrdf.formats.receipt import digests
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.reconstruction.dark import Darkness, darkness
from pbrdf.reconstruction.mueller_image import MuellerImage, reconstruct
from pbrdf.reconstruction.reduction import data_reduction
from pbrdf.reconstruction.streaming import StatesAhead, merged_states

LEAST_REPEATS = 2
"""A variance needs as many, of the flat field and of the dark."""


def calibrate_flat(manifest: str | Path, document: str | Path) -> None:
    """Measure the flat field of every band.

    Parameters
    ----------
    manifest : str or Path
        Of the flat field's only light; frames lie beside it.
    document : str or Path
        ``flat.json``; its image goes beside it.

    Raises
    ------
    InputError
        If the photographs cannot be used: too few exposures or repeats, no light, too much of it.
    """
    store = open_frames(manifest)
    sensor = measure_sensor(store)
    store = store.saturating_at(sensor.usable_below_dn)
    dark = darkness(store, _whole(store))
    flats = {nm: _flat(store, nm, dark, sensor.noise) for nm in store.header.bands_nm}
    write_document(document, FLAT, {**measured_flat(document, flats), "inputs": digests({"flat": manifest})})


def calibrate_radiometry(
    flat_manifest: str | Path,
    tile_manifests: Sequence[str | Path],
    calibrations: Mapping[str, str | Path],
    reflectance: float,
    document: str | Path,
) -> None:
    """Measure noise and range of the camera, and the lamp's power in every band.

    Parameters
    ----------
    flat_manifest : str or Path
        Of the flat field's only light; frames lie beside it.
    tile_manifests : sequence of str or Path
        Of the tile, a light each. More than one tell how much the lamp's power wanders between captures.
    calibrations : mapping
        The session's documents ``camera``, ``polarimeter``, ``lights`` and ``flat``.
    reflectance : float
        Of the tile.
    document : str or Path
        ``radiometry.json``.

    Raises
    ------
    InputError
        If the photographs or a calibration cannot be used, or the lights differ in bands.
    """
    sensor = measure_sensor(open_frames(flat_manifest))
    stores = {store.header.light: store for store in map(open_frames, tile_manifests)}
    first = next(iter(stores.values())).header.bands_nm
    for store in stores.values():
        if store.header.bands_nm != first:
            problem = f"are {list(store.header.bands_nm)} where another light has {list(first)}"
            raise InputError(store.path, "bands_nm", problem, "take the tile in the same bands")
    tiles = {light: _scales(store, sensor, calibrations, reflectance) for light, store in stores.items()}
    of_tile = {f"spectralon {light}": path for light, path in zip(stores, tile_manifests, strict=True)}
    inputs = digests({"flat_field": flat_manifest, **of_tile, **calibrations})
    write_document(
        document, RADIOMETRY, {**measured_radiometry(sensor, tiles, reflectance), "inputs": inputs}
    )


def measure_sensor(store: FrameStore) -> Sensor:
    """Noise and range of the camera that took repeated photographs of an evenly bright field.

    Raises
    ------
    InputError
        If a frame cannot be read, the states are not one state repeated, there are too few of them, of
        exposures or of dark frames, or a band is too dark or too bright.
    """
    header, whole = store.header, _whole(store)
    _require_repeats(store)
    mean_dark, good = _dark_and_good(store)
    dark_frames = store.read_dark(*whole).reshape(len(header.exposures_s), header.darks, -1)
    dark = dark_points(dark_frames, header.exposures_s, good)
    integer = header.dtype.startswith("uint")
    clipped = float((dark_frames[..., good] == 0).mean()) if integer else 0.0
    del dark_frames

    def frames(band_nm: int) -> NDArray[np.generic]:
        stack = store.read_band(band_nm, *whole)
        return stack.reshape(*stack.shape[:2], -1)

    sums = [
        level_sums(frames(nm), mean_dark, header.exposures_s, good, header.saturation)
        for nm in header.bands_nm
    ]
    straight = linearity(sum(sums[1:], start=sums[0]), header.saturation)
    limit = header.saturation if straight.limit_dn is None else straight.limit_dn
    points = list(dark)
    for nm in header.bands_nm:
        flat = flat_points(nm, frames(nm), mean_dark, header.exposures_s, good, limit, store.path)
        require_light(dark, flat, store.path)
        points += flat
    sensor = Sensor(
        transfer=fit_transfer(points, store.path),
        linearity=straight,
        step_dn=float(1 << header.shift) if integer else 0.0,
        saturation_dn=header.saturation,
        dark=tuple(dark),
        dark_clipped_share=clipped,
        darks_at_ends=header.darks_at_ends,
    )
    if not sensor.read_noise_dn > 0:
        raise InputError(store.path, "dark", "shows no noise", "give dark frames as the camera reads them")
    return sensor


def _whole(store: FrameStore) -> tuple[slice, slice]:
    return slice(0, store.header.rows), slice(0, store.header.columns)


def _require_repeats(store: FrameStore) -> None:
    header = store.header
    if len(set(header.states_deg)) > 1:
        raise InputError(store.path, "states_deg", "differ", "repeat one state before the flat field")
    for field, count, least in (
        ("states_deg", len(header.states_deg), LEAST_REPEATS),
        ("darks", header.darks, LEAST_REPEATS),
        ("exposures_s", len(header.exposures_s), LEAST_EXPOSURES),
    ):
        if count < least:
            raise InputError(store.path, field, f"count {count}", f"take {least} or more of the flat field")


def _dark_and_good(store: FrameStore) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Mean dark frames (exposure, pixels), and the pixels that are hot in none."""
    dark = darkness(store, _whole(store))
    good: NDArray[np.bool_] = dark.usable == len(store.header.exposures_s)
    if not good.any():
        raise InputError(
            store.path, "dark", "has every pixel hot", "cover the lamp while dark frames are taken"
        )
    return dark.mean, good


def _flat(store: FrameStore, band_nm: int, dark: Darkness, noise: tuple[float, float]) -> MeasuredFlat:
    with StatesAhead(store, band_nm, _whole(store)) as ahead:
        merged = merged_states(ahead, dark, noise)
    repeats = merged.planes[: len(merged.used)].reshape(-1, store.header.rows, store.header.columns)
    return measure_flat(repeats, band_nm, store.path)


def _scales(
    store: FrameStore,
    sensor: Sensor,
    calibrations: Mapping[str, str | Path],
    reflectance: float,
) -> dict[int, LampScale]:
    header = store.header
    camera, arm = Camera.read(calibrations["camera"]), read_lights(calibrations["lights"])
    polarimeter = PolarimeterCalibration.read(calibrations["polarimeter"])
    flat = FlatField.read(calibrations["flat"])
    window = middle_window(header.rows, header.columns)
    irradiance = tile_irradiance(camera, arm, header.angle_deg, window)
    radiometry = Radiometry(*sensor.noise, {}, sensor.usable_below_dn)
    scales = {}
    for nm in header.bands_nm:
        elements = polarimeter.at(nm, calibrations["polarimeter"])
        response = flat.at(nm, window, (header.rows, header.columns))
        image = reconstruct(store, nm, elements, radiometry, window, response)
        low, high = image.summary["drift"]
        lamp = (high - low, _power_error(store, elements, image) if header.references else 0.0)
        scales[nm] = lamp_scale(
            image.mueller[0], image.variance[0], irradiance, reflectance, lamp, nm, store.path
        )
    return scales


def _power_error(store: FrameStore, polarimeter: Polarimeter, image: MuellerImage) -> float:
    """Relative noise of the repeated state's mean over the tile, which sends back unpolarised light."""
    solution = data_reduction(polarimeter, store.header.states_deg, store.path)
    known = image.missing == 0
    m00, variance = (float(plane[0][known].mean()) for plane in (image.mueller, image.variance))
    of_state = variance / float((solution.reduction[0] ** 2).sum())
    rate = float(solution.measurement[store.header.reference_state, 0]) * m00
    return float((of_state / known.sum()) ** 0.5 / abs(rate))
