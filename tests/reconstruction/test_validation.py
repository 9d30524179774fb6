"""Elements in the beam held against their ideal matrices."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from rig_truth import lights_content, polarimeter_content

from pbrdf.calibration.polarimeter import PolarimeterCalibration
from pbrdf.calibration.radiometry import Radiometry
from pbrdf.capture.arrays import write_capture
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FrameStore
from pbrdf.formats.documents import write_document
from pbrdf.instruments.virtual_beam import element_mueller
from pbrdf.optics.arm import Arm
from pbrdf.optics.elements import IDEAL
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.reconstruction.comparison import Comparison, rms_over, worst
from pbrdf.reconstruction.lamp import LampMatrix, lamp_matrix
from pbrdf.reconstruction.validation import (
    CALIBRATED,
    UNCALIBRATED,
    Validation,
    compare,
    horizontal_turn,
    validate_session,
)

Float = NDArray[np.float64]

BAND = 550
STATES = [(0.0, 25.0 * n % 360.0, 5.0 * n, 90.0) for n in range(36)]
RADIOMETRY = Radiometry(1e-6, 1e-3, {BAND: 1.0})
DEGREE = float(np.deg2rad(1.0))
RIGHT_ANGLE = np.pi / 2


def lamp_capture(folder: Path, polarimeter: Polarimeter, element: str, *, level: float = 100.0) -> Path:
    """Manifest of a disc of 9 px seen through an element without noise, x of both modules horizontal."""
    row, column = np.indices((25, 25)) - 12
    disc = level * (np.hypot(row, column) < 9.0) + 1e-6
    weights = polarimeter.measurement_matrix(np.deg2rad(STATES)) @ IDEAL[element].ravel()
    frames = (weights[:, None, None] * disc)[:, None].astype(np.float32)
    return write_capture(
        folder / element,
        material=element,
        angle_deg=180.0,
        frames={BAND: frames},
        states_deg=STATES,
        exposures_s=[1.0],
        saturation=90.0,
    )


def both_ways(folder: Path, polarimeter: Polarimeter, element: str) -> dict[str, Comparison]:
    store = FrameStore.open(lamp_capture(folder, polarimeter, element).parent / "frames.zarr")
    return compare(store, BAND, polarimeter, RADIOMETRY, (0.0, 0.0), IDEAL[element])


@pytest.mark.parametrize(
    ("polarimeter", "deviation"),
    [
        (Polarimeter(RIGHT_ANGLE + DEGREE, RIGHT_ANGLE), 0.0175),
        (Polarimeter(RIGHT_ANGLE, RIGHT_ANGLE - DEGREE), 0.0175),
        (Polarimeter(RIGHT_ANGLE, RIGHT_ANGLE, (0.0, 0.0, 0.0, DEGREE / 2)), 0.0175),
        (Polarimeter(RIGHT_ANGLE, RIGHT_ANGLE, (0.0, DEGREE / 2, 0.0, 0.0)), 0.035),
    ],
    ids=["generator retardance", "analyser retardance", "polariser", "retarder"],
)
def test_an_error_left_uncalibrated_shows_on_air(
    tmp_path: Path, polarimeter: Polarimeter, deviation: float
) -> None:
    """A degree of retardance or half a degree of a polariser shows as sin 1°, half a degree of a retarder
    as twice that; calibrated, nothing is left but float32.
    """
    ways = both_ways(tmp_path, polarimeter, "air")
    assert ways[UNCALIBRATED].largest == pytest.approx(deviation, rel=0.03)
    assert ways[CALIBRATED].largest < 1e-5


@pytest.mark.parametrize("element", IDEAL)
def test_every_element_comes_back_through_an_imperfect_polarimeter(tmp_path: Path, element: str) -> None:
    imperfect = Polarimeter(1.52, 1.60, (0.0, 0.02, -0.01, 0.004))
    ways = both_ways(tmp_path, imperfect, element)
    assert ways[CALIBRATED].largest < 1e-5
    assert ways[UNCALIBRATED].largest > 100 * ways[CALIBRATED].largest


@pytest.mark.parametrize("element", IDEAL)
@pytest.mark.parametrize(
    ("generator", "analyser"),
    [((0.0, -1.0, 0.0), (0.0, -1.0, 0.0)), ((0.6, -0.8, 0.0), (-0.28, 0.96, 0.0))],
    ids=["vertical", "oblique"],
)
def test_matrices_are_turned_to_the_horizontal(
    element: str, generator: tuple[float, float, float], analyser: tuple[float, float, float]
) -> None:
    """Whatever the modules' axes: with the arm's half turn about the vertical undone, the ideal matrix."""
    x, y, z = generator
    arm = Arm((0.0, 0.0, 1000.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0), 800.0, (-x, y, -z))
    turn = horizontal_turn(arm, PolarimeterCalibration({}, analyser), 180.0)
    measured = element_mueller(element, generator, analyser, (0.0, 0.0, -1.0)).reshape(16, 1, 1)
    pixels = np.broadcast_to(measured, (16, 2, 1))
    found = lamp_matrix(pixels, np.zeros((16, 2, 1)), np.ones((2, 1), np.bool_), turn).mueller
    np.testing.assert_allclose(found, IDEAL[element] / IDEAL[element][0, 0], atol=1e-12)


def comparison(
    deviation: float, error: float = 0.001, scatter: float = 0.001, drift: float = 0.0
) -> Comparison:
    """Air that deviates in M21, from 100 pixels."""
    mueller = np.eye(4)
    mueller[2, 1] = -deviation
    return Comparison(
        LampMatrix(mueller, np.full((4, 4), error), np.full((4, 4), scatter), 7.0, 100),
        np.eye(4),
        np.full((4, 4), drift),
    )


def test_deviation_is_the_largest_and_the_mean_square_of_sixteen() -> None:
    air = comparison(0.004)
    assert (air.largest, air.place) == (pytest.approx(0.004), (2, 1))
    assert air.rms == pytest.approx(0.001)
    assert (air.in_errors, air.noise_rms) == (pytest.approx(4.0), pytest.approx(0.001))
    assert worst([air, comparison(0.008), air]).largest == pytest.approx(0.008)
    assert rms_over([air, comparison(0.0)]) == pytest.approx(0.001 / np.sqrt(2))


@pytest.mark.parametrize(("error", "scatter"), [(0.001, 0.02), (0.002, 0.01)])
def test_the_larger_of_two_standard_errors_counts(error: float, scatter: float) -> None:
    assert comparison(0.004, error, scatter).largest_error == pytest.approx(0.002)


def test_the_error_of_the_lamps_drift_is_added_in_quadrature() -> None:
    assert comparison(0.004, 0.003, drift=0.004).largest_error == pytest.approx(0.005)


def validation(calibrated: float, uncalibrated: float) -> Validation:
    ways = {CALIBRATED: comparison(calibrated), UNCALIBRATED: comparison(uncalibrated)}
    return Validation("monday", {"polarimeter": "measured"}, {"air": {450: ways, 650: ways}})


def test_the_verdict_tells_noise_from_error() -> None:
    assert (
        "What is left is noise: at most 4.0 standard errors in 30 elements" in validation(0.004, 0.1).verdict
    )
    assert "What is left is more than noise: up to 6.0 standard errors" in validation(0.006, 0.1).verdict
    assert "within 0.006 of their ideal matrices (0.0015 rms)" in validation(0.006, 0.1).verdict
    assert "uncalibrated, within 0.1 (0.025 rms)" in validation(0.006, 0.1).verdict


def test_what_is_written_is_read(tmp_path: Path) -> None:
    path = tmp_path / "monday.json"
    written = validation(0.004, 0.1)
    written.write(path)
    read = Validation.read(path)
    assert (read.session, read.sources, read.verdict) == ("monday", written.sources, written.verdict)
    for way in (CALIBRATED, UNCALIBRATED):
        for ours, theirs in zip(read.comparisons(way), written.comparisons(way), strict=True):
            assert ours.plain() == theirs.plain()
    read.write(tmp_path / "again.json")
    assert (tmp_path / "again.json").read_bytes() == path.read_bytes()


def test_a_damaged_document_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "monday.json"
    validation(0.004, 0.1).write(path)
    content = json.loads(path.read_text(encoding="utf-8"))
    content["elements"]["air"]["bands_nm"]["650"][CALIBRATED]["mueller"].pop()
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError) as refused:
        Validation.read(path)
    assert refused.value.field == "elements.air.bands_nm.650.calibrated.mueller"


def calibrations(folder: Path, polarimeter: Polarimeter, band_nm: int) -> dict[str, Path]:
    """Documents of a session whose modules have their x horizontal."""
    x = (1.0, 0.0, 0.0)
    arm = Arm((0.0, 0.0, 1000.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0), 800.0, x)
    radiometry = {
        "dn_per_electron": 1e-6,
        "read_noise_dn": 1e-3,
        "scale": {str(band_nm): 1.0},
    }
    documents = {
        "polarimeter": (
            "polarimeter/1",
            {"source": "file", **polarimeter_content({band_nm: polarimeter}, x)},
        ),
        "lights": ("lights/1", {"source": "file", **lights_content(arm)}),
        "radiometry": ("radiometry/1", radiometry),
    }
    for kind, (schema, content) in documents.items():
        write_document(folder / f"{kind}.json", schema, {"source": "file", **content})
    return {kind: folder / f"{kind}.json" for kind in documents}


def test_a_session_from_files_to_file(tmp_path: Path) -> None:
    imperfect = Polarimeter(1.52, 1.60, (0.0, 0.02, -0.01, 0.004))
    manifests = {element: lamp_capture(tmp_path, imperfect, element) for element in IDEAL}
    documents = calibrations(tmp_path, imperfect, BAND)
    validate_session("monday", manifests, documents, tmp_path / "monday.json")
    read = Validation.read(tmp_path / "monday.json")
    assert list(read.results) == list(IDEAL)
    assert read.sources == dict.fromkeys(documents, "file")
    assert worst(read.comparisons(CALIBRATED)).largest < 1e-5
    assert all(each.measured.pixels > 80 for each in read.comparisons(CALIBRATED))


def test_a_band_that_was_not_calibrated_is_refused(tmp_path: Path) -> None:
    polarimeter = Polarimeter(RIGHT_ANGLE, RIGHT_ANGLE)
    manifests = {"air": lamp_capture(tmp_path, polarimeter, "air")}
    documents = calibrations(tmp_path, polarimeter, 450)
    with pytest.raises(InputError) as refused:
        validate_session("monday", manifests, documents, tmp_path / "monday.json")
    assert (refused.value.source, refused.value.field) == (str(documents["polarimeter"]), "bands.550")
    assert not (tmp_path / "monday.json").exists()


@pytest.mark.parametrize(
    ("level", "problem"), [(1e4, "is saturated at every exposure"), (0.004, "in no pixel")]
)
def test_a_lamp_too_bright_or_too_dark_is_refused(tmp_path: Path, level: float, problem: str) -> None:
    polarimeter = Polarimeter(RIGHT_ANGLE, RIGHT_ANGLE)
    manifest = lamp_capture(tmp_path, polarimeter, "air", level=level)
    store = FrameStore.open(manifest.parent / "frames.zarr")
    with pytest.raises(InputError) as refused:
        compare(store, BAND, polarimeter, RADIOMETRY, (0.0, 0.0), IDEAL["air"])
    assert (refused.value.source, refused.value.field) == (str(store.path), "550nm")
    assert problem in refused.value.problem
