"""Maps of residuals: noise gives one, and what the polarimeter does not explain stands out where it is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.calibration.lamp_signal import LampSignal, lamp_signal
from pbrdf.capture.arrays import write_capture
from pbrdf.formats.capture_store import FrameStore
from pbrdf.optics.elements import IDEAL
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.report.polarimeter_maps import disc_picture, disc_residuals, state_picture

Float = NDArray[np.float64]

BAND, NOISE, RADIUS = 550, 2.0, 13.0
STATES = np.stack([np.zeros(36), 25.0 * np.arange(36), 5.0 * np.arange(36), np.full(36, 90.0)], axis=-1)
RETARDANCE = np.pi / 2


def predicted(retardance: float = RETARDANCE) -> Float:
    """Signals of air, DN, state 7 again after all."""
    w = Polarimeter(retardance, np.pi / 2).measurement_matrix(np.deg2rad(STATES))
    signal: Float = 4000.0 * (w @ IDEAL["air"].ravel())
    return np.append(signal, signal[7])


def disc_store(folder: Path, right_half: Float) -> FrameStore:
    """A disc whose right half shows other signals; its brightness falls from left to right."""
    row, column = np.indices((36, 36)) - 18
    lamp = (np.hypot(row, column) < RADIUS) * (1.0 - 0.005 * column)
    signal = np.where(column >= 0, right_half[:, None, None], predicted()[:, None, None]) * lamp
    frames = signal + np.random.default_rng(8).normal(100.0, NOISE, signal.shape)
    manifest = write_capture(
        folder,
        material="air",
        angle_deg=180.0,
        frames={BAND: frames[:36, None].astype(np.float32)},
        dark=np.full((1, 2, 36, 36), 100.0, np.float32),
        references={BAND: frames[36:, None].astype(np.float32)},
        references_after=[36],
        reference_state=7,
        states_deg=STATES,
        exposures_s=[0.5],
        saturation=65000.0,
    )
    return FrameStore.open(manifest.parent / "frames.zarr")


def known_noise(found: LampSignal) -> LampSignal:
    """The same with the noise that was put in, which the scatter of a torn disc would overstate."""
    noise = np.full(len(found.noise), NOISE / found.exposure_s / np.sqrt(found.pixels))
    return LampSignal(found.states_deg, found.signal, noise, found.exposure_s, found.pixels)


def halves(values: Float) -> tuple[float, float]:
    """Root mean squares of the left and of the right half; the seam is near the middle column."""
    middle = values.shape[1] // 2
    left, right = values[:, : middle - 2], values[:, middle + 2 :]
    return float(np.sqrt(np.nanmean(left**2))), float(np.sqrt(np.nanmean(right**2)))


def test_noise_alone_gives_one_however_bright_a_pixel_is(tmp_path: Path) -> None:
    store = disc_store(tmp_path, predicted())
    found = known_noise(lamp_signal(store, BAND))
    residuals = disc_residuals(store, BAND, found, predicted())
    assert np.isfinite(residuals).sum() == pytest.approx(found.pixels, rel=0.01)
    assert halves(residuals) == (pytest.approx(1.0, abs=0.03), pytest.approx(1.0, abs=0.03))


def test_half_a_retarder_that_differs_shows_in_its_half(tmp_path: Path) -> None:
    """As much as its signals differ beyond a common factor, added to the noise in quadrature."""
    other = predicted(RETARDANCE + 0.01)
    store = disc_store(tmp_path, other)
    residuals = disc_residuals(store, BAND, known_noise(lamp_signal(store, BAND)), predicted())
    beyond = other - predicted() * (other @ predicted()) / (predicted() @ predicted())
    expected = np.sqrt(1.0 + np.mean(beyond**2) / NOISE**2)
    assert expected > 1.5
    assert halves(residuals) == (pytest.approx(1.0, abs=0.05), pytest.approx(expected, rel=0.06))


def test_the_pictures_say_in_words_what_they_show() -> None:
    maps = [[np.full((4, 4), 1.0), np.full((4, 4), 1.5)], [np.full((4, 4), 0.9), np.full((4, 4), 3.0)]]
    assert (
        "at 450, 550 nm; medians: air 1, 1.5; LPH 0.9, 3."
        in disc_picture(["air", "LPH"], [450, 550], maps).alt
    )
    pulls = np.zeros((2, 2, 7))
    pulls[1, 0, 3] = -4.5
    assert state_picture(["air", "LPH"], [450, 550], pulls).alt.endswith("the largest is 4.5.")
