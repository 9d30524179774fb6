"""A session's polarimeter put to the test: known elements in the beam, measured and ideal.

Baek et al. 2020, supplement, fig. 2: air, two linear and two circular polarisers, in perfect
orientation. Each is reconstructed twice from the same frames, with the calibrated polarimeter and
with one that was never calibrated.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pbrdf.calibration.lamp_disc import lamp_pixels
from pbrdf.calibration.lights import read_lights
from pbrdf.calibration.polarimeter import PolarimeterCalibration
from pbrdf.calibration.radiometry import Radiometry
from pbrdf.capture.frames import open_frames
from pbrdf.formats.capture_store import FrameStore, band_name
from pbrdf.formats.documents import member, read_any, read_document, wavelengths, write_document
from pbrdf.optics.arm import Arm
from pbrdf.optics.elements import IDEAL
from pbrdf.optics.frames import angle_between, change_frames, transverse
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.reconstruction.comparison import Comparison, rms_over, worst
from pbrdf.reconstruction.dark import darkness
from pbrdf.reconstruction.drift import lamp_power_errors
from pbrdf.reconstruction.lamp import lamp_matrix
from pbrdf.reconstruction.mueller_image import reconstruct

Float = NDArray[np.float64]

KIND = "validation/1"

CALIBRATED, UNCALIBRATED = WAYS = ("calibrated", "uncalibrated")

NEVER_CALIBRATED = Polarimeter(np.pi / 2, np.pi / 2)
"""What a rig is meant to be: quarter waves, every scale zero where its element's axis is."""

HORIZONTAL = (1.0, 0.0, 0.0)
"""The camera's x."""

BEYOND_NOISE = 5.0
"""Standard errors: among the 375 elements of five matrices in five bands, noise alone exceeds it once
in five thousand sessions."""

UNITS = {
    "mueller, standard_error, scatter, drift_error, ideal": "1: sixteen elements by rows, divided by M00",
    "deviation_max, deviation_rms and what begins so": "1: of elements divided by M00",
    "deviation_max_in_standard_errors": "1: standard errors of the element",
}

FRAMES = "x horizontal (the camera's x), z along the beam toward the camera; conventions of Mitsuba 3"


@dataclass(frozen=True)
class Validation:
    """What the elements say of a session.

    Attributes
    ----------
    session : str
    sources : dict of str to str
        Where each calibration comes from, by kind.
    results : dict
        By element, by band (nm) and by way ("calibrated", "uncalibrated"): the comparison.
    """

    session: str
    sources: dict[str, str]
    results: dict[str, dict[int, dict[str, Comparison]]]

    @property
    def bands_nm(self) -> list[int]:
        """Bands of the elements, nm."""
        return list(next(iter(self.results.values())))

    def comparisons(self, way: str) -> list[Comparison]:
        """All of one way, over elements and bands."""
        return [band[way] for element in self.results.values() for band in element.values()]

    def is_noise(self, way: str) -> bool:
        """Whether no deviation of that way is larger than noise alone makes it."""
        return max(each.in_errors for each in self.comparisons(way)) <= BEYOND_NOISE

    @property
    def verdict(self) -> str:
        """What the comparison says, in words."""
        calibrated, plain = self.comparisons(CALIBRATED), self.comparisons(UNCALIBRATED)
        errors = max(each.in_errors for each in calibrated)
        words = (
            f"Calibrated, the elements are within {worst(calibrated).largest:.3g} of their ideal matrices "
            f"({rms_over(calibrated):.3g} rms); uncalibrated, within {worst(plain).largest:.3g} "
            f"({rms_over(plain):.3g} rms)."
        )
        if self.is_noise(CALIBRATED):
            count = 15 * len(calibrated)
            return f"{words} What is left is noise: at most {errors:.1f} standard errors in {count} elements."
        return f"{words} What is left is more than noise: up to {errors:.1f} standard errors."

    def write(self, path: str | Path) -> None:
        """Write as a document of schema ``pbrdf/validation/1``."""
        content = {
            "session": self.session,
            "verdict": self.verdict,
            "calibrations": self.sources,
            "frames": FRAMES,
            "units": UNITS,
            "elements": {
                element: {
                    "over_bands": {
                        way: {
                            "deviation_max": worst(found).largest,
                            "deviation_rms": rms_over(found),
                        }
                        for way, found in ((w, [band[w] for band in bands.values()]) for w in WAYS)
                    },
                    "bands_nm": {
                        str(nm): {way: each.plain() for way, each in ways.items()}
                        for nm, ways in bands.items()
                    },
                }
                for element, bands in self.results.items()
            },
        }
        write_document(path, KIND, content)

    @classmethod
    def read(cls, path: str | Path) -> Validation:
        """Read what `write` wrote; raises `InputError` if a number is missing or not finite."""
        content = read_document(path, KIND)
        results = {
            element: {
                nm: {
                    way: Comparison.from_plain(path, content, f"elements.{element}.bands_nm.{name}.{way}")
                    for way in WAYS
                }
                for nm, name in wavelengths(path, content, f"elements.{element}.bands_nm").items()
            }
            for element in member(path, content, "elements")
        }
        return cls(
            str(member(path, content, "session")), dict(member(path, content, "calibrations")), results
        )


def validate_session(
    session: str,
    manifests: Mapping[str, str | Path],
    calibrations: Mapping[str, str | Path],
    document: str | Path,
) -> None:
    """Hold the elements that were photographed in a session against their ideal matrices.

    Parameters
    ----------
    session : str
        Its name.
    manifests : mapping
        By element (`pbrdf.optics.elements.IDEAL`) the manifest of its only light; frames lie beside it.
    calibrations : mapping
        The session's documents ``polarimeter``, ``radiometry`` and ``lights``.
    document : str or Path
        What is written.

    Raises
    ------
    InputError
        If a capture or a calibration cannot be used, a band is not calibrated, no pixel shows the
        lamp, or most that do are saturated.
    """
    sources = {kind: str(member(path, read_any(path), "source")) for kind, path in calibrations.items()}
    polarimeter = PolarimeterCalibration.read(calibrations["polarimeter"])
    radiometry = Radiometry.read(calibrations["radiometry"])
    arm = read_lights(calibrations["lights"])
    results = {}
    for element, manifest in manifests.items():
        store = open_frames(manifest)
        turn = horizontal_turn(arm, polarimeter, store.header.angle_deg)
        results[element] = {
            nm: compare(
                store, nm, polarimeter.at(nm, calibrations["polarimeter"]), radiometry, turn, IDEAL[element]
            )
            for nm in store.header.bands_nm
        }
    Validation(session, sources, results).write(document)


def horizontal_turn(arm: Arm, polarimeter: PolarimeterCalibration, angle_deg: float) -> tuple[float, float]:
    """Angles from the x axes of generator and analyser to the horizontal, about the beam, radians.

    Of the beam from the lamp's middle to the camera: over the lamp's disc directions differ by so
    little that frames do not.
    """
    along = -arm.light_position(angle_deg)
    along = along / np.linalg.norm(along)
    wanted = transverse(HORIZONTAL, along)
    axes = (arm.generator_x(angle_deg), polarimeter.analyser_axis)
    turn_in, turn_out = (float(angle_between(transverse(axis, along), wanted, along)) for axis in axes)
    return turn_in, turn_out


def compare(
    store: FrameStore,
    band_nm: int,
    polarimeter: Polarimeter,
    radiometry: Radiometry,
    turn: tuple[float, float],
    ideal: Float,
) -> dict[str, Comparison]:
    """Both ways of one element in one band, over the same pixels.

    Parameters
    ----------
    store : FrameStore
        Its frames.
    band_nm : int
    polarimeter : Polarimeter
        As calibrated in that band.
    radiometry : Radiometry
    turn : tuple of float
        From `horizontal_turn`.
    ideal : ndarray, shape (4, 4)
        In horizontal frames, with any M00.

    Raises
    ------
    InputError
        If the lamp is not there, or saturated.
    """
    whole = (slice(0, store.header.rows), slice(0, store.header.columns))
    ways = {CALIBRATED: polarimeter, UNCALIBRATED: NEVER_CALIBRATED}
    images = {way: reconstruct(store, band_nm, elements, radiometry, whole) for way, elements in ways.items()}
    first = images[CALIBRATED]
    lamp = lamp_pixels(first.mueller[0], first.variance[0], store.path, band_name(band_nm))
    power_errors = lamp_power_errors(
        store.saturating_at(radiometry.saturation_dn),
        band_nm,
        whole,
        darkness(store, whole),
        (radiometry.dn_per_electron, radiometry.read_noise_dn),
    )
    states = np.deg2rad(store.header.states_deg)
    return {
        way: Comparison(
            lamp_matrix(image.mueller, image.variance, lamp, turn),
            ideal / ideal[0, 0],
            drift_error(
                image.mueller[:, lamp].mean(axis=1, dtype=np.float64),
                ways[way].measurement_matrix(states),
                power_errors,
                turn,
            ),
        )
        for way, image in images.items()
    }


def drift_error(mueller: Float, measurement: Float, power_errors: Float, turn: tuple[float, float]) -> Float:
    """Standard error of a matrix over its M00 from errors of the lamp's power at the states.

    Parameters
    ----------
    mueller : ndarray, shape (16,)
        Elements between the modules' frames, in any unit.
    measurement : ndarray, shape (states, 16)
        The polarimeter's measurement matrix.
    power_errors : ndarray, shape (states, n)
        Error of the power at each state for one standard deviation of each of n independent causes
        (`pbrdf.reconstruction.drift.lamp_power_errors`).
    turn : tuple of float
        From `horizontal_turn`.

    Returns
    -------
    ndarray, shape (4, 4)
        To first order: a state's light that is taken for a lamp brighter by ε counts as less by ε.
    """
    lost = (measurement @ mueller)[:, None] * power_errors
    causes = (np.linalg.pinv(measurement) @ lost).T.reshape(-1, 4, 4)
    matrix = change_frames(mueller.reshape(4, 4), *turn)
    errors = change_frames(causes, *turn)
    of_ratio = (errors - matrix / matrix[0, 0] * errors[:, :1, :1]) / matrix[0, 0]
    error: Float = np.sqrt((of_ratio**2).sum(axis=0))
    return error
