"""Our calibration of other people's polarimeters gives their answers, or better ones.

The air measurement is of a Mueller spectropolarimeter of the University of Alabama in Huntsville,
whose owners fitted each wavelength after division by its largest signal. The mirror is that of
Quéau et al., Opt. Lett. 43(20) 2018.
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
import scipy.io
from numpy.typing import NDArray

from pbrdf.calibration.polarimeter_fit import PolarimeterFit, fit_polarimeter
from pbrdf.calibration.polarimeter_result import residual_map
from pbrdf.calibration.polarimeter_signal import Amplitude, Reference
from pbrdf.calibration.polarimeter_verdict import judge

Float = NDArray[np.float64]

AIR = [Reference("air", np.eye(4))]
MIRROR = [Reference("mirror", np.diag([1.0, 1.0, -1.0, -1.0]))]


@pytest.fixture(scope="module")
def air_spectrum(real_data: Path) -> tuple[Float, Float, Float]:
    """Wavelengths (nm), signals (wavelength, state) and the owners' five angles, 450 to 650 nm."""
    rows = np.loadtxt(real_data / "drr-air/air.lvm")
    answers = scipy.io.loadmat(str(real_data / "drr-air/CalData.mat"))["CalData"]
    visible = (rows[:, 0] > 449.0) & (rows[:, 0] < 651.0)
    return rows[visible, 0], rows[visible, 1:], answers[visible]


def _air_fits(signals: Float, amplitude: Amplitude) -> list[PolarimeterFit]:
    slow = 6.0 * np.arange(61)
    states = np.stack([0 * slow, slow, 5 * slow, 0 * slow], axis=-1)
    return [fit_polarimeter(states, row[None, None], AIR, amplitude=amplitude) for row in signals]


def _five_angles(fit: PolarimeterFit) -> list[float]:
    """Errors of both retardances, then angles of retarders and second polariser, degrees."""
    e = fit.elements
    retardances = np.array([e.generator_retardances[0], e.analyser_retardances[0]]) - np.pi / 2
    return np.rad2deg([*retardances, *e.zeros[1:]]).tolist()  # type: ignore[no-any-return]


@pytest.fixture(scope="module")
def at_maximum(air_spectrum: tuple[Float, Float, Float]) -> list[PolarimeterFit]:
    return _air_fits(air_spectrum[1], "maximum")


def test_kept_at_the_maximum_every_angle_is_theirs(
    air_spectrum: tuple[Float, Float, Float], at_maximum: list[PolarimeterFit]
) -> None:
    wavelengths, _, answers = air_spectrum
    assert len(wavelengths) == 101
    found = np.array([_five_angles(fit) for fit in at_maximum])
    np.testing.assert_allclose(found, answers, rtol=0, atol=0.01)


def test_a_free_amplitude_leaves_less_over_at_every_wavelength(
    air_spectrum: tuple[Float, Float, Float], at_maximum: list[PolarimeterFit]
) -> None:
    wavelengths, signals, _ = air_spectrum
    free = _air_fits(signals, "free")
    for one, other in zip(free, at_maximum, strict=True):
        assert one.residual_rms[0, 0] < other.residual_rms[0, 0]
    at_550 = int(np.abs(wavelengths - 550).argmin())
    assert _five_angles(free[at_550])[:2] == pytest.approx([6.39, 2.38], abs=0.01)
    assert judge(free[at_550], [550]).words.startswith("poor: residual 4.3 %")
    relative = [fit[at_550].residual_rms[0, 0] / signals[at_550].max() for fit in (free, at_maximum)]
    assert relative == pytest.approx([0.0258, 0.0299], abs=5e-5)


def test_air_alone_is_said_to_leave_frame_and_sign_open(at_maximum: list[PolarimeterFit]) -> None:
    assert not at_maximum[0].frame_rotation.settled
    assert not at_maximum[0].s3_sign.settled


ROUNDED = {23: 22.5, 68: 67.5, 113: 112.5, 158: 157.5}
"""Names of the files hold the angles as whole degrees."""


@pytest.fixture(scope="module")
def mirror_images(real_data: Path) -> tuple[Float, NDArray[np.uint8]]:
    """States (degrees) and images of the mirror at 630 nm."""
    paths = sorted((real_data / "mirror-polarimeter/630").glob("*.png"))
    assert len(paths) == 512
    angles = [[int(part) for part in path.stem.split("_")] for path in paths]
    polariser, generator, analyser = np.array([[ROUNDED.get(a, a) for a in row] for row in angles]).T
    # their axes are zero − reading, as seen in the sense of ours
    states = np.stack([0 * polariser, -generator, -analyser, -polariser], axis=-1)
    return states, np.stack([cv2.imread(str(path), cv2.IMREAD_UNCHANGED) for path in paths])


@pytest.fixture(scope="module")
def mirror_fit(mirror_images: tuple[Float, NDArray[np.uint8]]) -> PolarimeterFit:
    states, images = mirror_images
    # a border of 150 pixels in their count from one: the 150th belongs to the field
    field = images[:, 149:-150, 149:-150].reshape(len(images), -1)
    intended = (0.0, 61.0, 94.0, 151.0)
    return fit_polarimeter(states, np.median(field, axis=1)[None, None], MIRROR, intended_zeros_deg=intended)


def test_a_mirror_gives_their_answer_of_this_band(mirror_fit: PolarimeterFit) -> None:
    elements = mirror_fit.elements
    zeros = np.rad2deg(elements.zeros)
    assert zeros.tolist() == pytest.approx([0.0, 61.693, 94.327, 150.998], abs=0.005)
    retardances = np.rad2deg([elements.generator_retardances[0], elements.analyser_retardances[0]])
    assert retardances.tolist() == pytest.approx([72.415, 72.390], abs=0.005)
    # they leave out the halves of both polarisers
    assert elements.amplitudes[0, 0] / 4 == pytest.approx(59.004, abs=0.005)
    assert mirror_fit.residual_rms[0, 0] == pytest.approx(0.852, abs=0.0005)
    assert judge(mirror_fit, [630]).usable


def test_the_same_mirror_with_exchanged_axes_is_as_good(
    mirror_images: tuple[Float, NDArray[np.uint8]], mirror_fit: PolarimeterFit
) -> None:
    states, _ = mirror_images
    intended = (0.0, 151.0, 184.0, 151.0)
    other = fit_polarimeter(states, mirror_fit.signal, MIRROR, intended_zeros_deg=intended)
    np.testing.assert_allclose(other.residual_rms, mirror_fit.residual_rms, rtol=1e-9)
    turned = np.rad2deg(other.elements.zeros - mirror_fit.elements.zeros)
    np.testing.assert_allclose(turned, [0, 90, 90, 0], atol=1e-6)


def test_every_pixel_of_the_mirror_leaves_little_over(
    mirror_images: tuple[Float, NDArray[np.uint8]], mirror_fit: PolarimeterFit
) -> None:
    states, images = mirror_images
    w = mirror_fit.polarimeters()[0].measurement_matrix(np.deg2rad(states))
    expected = w @ MIRROR[0].mueller.ravel()
    field = images[:, 149:-150:8, 149:-150:8].reshape(len(images), -1)
    _, rms = residual_map(expected[:, None], field)
    assert np.median(rms) < 1.5
