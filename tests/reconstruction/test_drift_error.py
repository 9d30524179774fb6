"""What the correction for the lamp's drift adds to the errors of an element in the beam."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray
from rig_truth import write_truth

from pbrdf.capture.arrays import write_capture
from pbrdf.capture.session import capture_target
from pbrdf.formats.capture_store import FrameStore
from pbrdf.optics.elements import IDEAL
from pbrdf.optics.frames import change_frames
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.reconstruction.dark import darkness
from pbrdf.reconstruction.drift import lamp_power, lamp_power_errors
from pbrdf.reconstruction.validation import (
    BEYOND_NOISE,
    CALIBRATED,
    Validation,
    drift_error,
    validate_session,
)
from pbrdf.settings.checked import check
from pbrdf.settings.plan import capture_plan
from pbrdf.settings.rig import read_rig
from pbrdf.settings.targets import session_plans

Float = NDArray[np.float64]

SOURCE = Path(__file__).resolve().parents[2] / "config/rig/virtual.yaml"
DRAWS = range(400, 440)
SHAPE = (12, 15)
WHOLE = (slice(0, SHAPE[0]), slice(0, SHAPE[1]))
NOISE = (2.0, 3.0)
STATES = np.stack([np.zeros(36), 25.0 * np.arange(36), 5.0 * np.arange(36), np.full(36, 90.0)], axis=-1)
POLARIMETER = Polarimeter(1.52, 1.60, (0.0, 0.02, -0.01, 0.004))
W = POLARIMETER.measurement_matrix(np.deg2rad(STATES))


def lamp_store(folder: Path, repeats: tuple[int, ...]) -> FrameStore:
    """Nine states of a steady lamp in many bands, each with noise of its own; state 3 is repeated."""
    random = np.random.default_rng(3)
    rates = 4000.0 * (W[:9] @ IDEAL["air"].ravel())

    def noisy(signals: Float) -> NDArray[np.float32]:
        signal = np.broadcast_to(signals[:, None, None, None], (len(signals), 1, *SHAPE))
        electrons = random.poisson(signal / NOISE[0])
        return (electrons * NOISE[0] + random.normal(0, NOISE[1], signal.shape)).astype(np.float32)

    manifest = write_capture(
        folder,
        material="air",
        angle_deg=180.0,
        frames={nm: noisy(rates) for nm in DRAWS},
        states_deg=STATES[:9],
        exposures_s=(1.0,),
        saturation=65532.0,
        references={nm: noisy(rates[[3] * len(repeats)]) for nm in DRAWS} if repeats else None,
        references_after=repeats,
        reference_state=3 if repeats else 0,
    )
    return FrameStore.open(manifest.parent / "frames.zarr")


@pytest.mark.parametrize("repeats", [(9,), (0, 5, 9)], ids=["line", "cubic"])
def test_errors_of_the_power_are_what_many_takings_scatter(tmp_path: Path, repeats: tuple[int, ...]) -> None:
    store = lamp_store(tmp_path, repeats)
    dark = darkness(store, WHOLE)
    powers = np.array([lamp_power(store, nm, WHOLE, dark, NOISE) for nm in DRAWS])
    errors = np.array([lamp_power_errors(store, nm, WHOLE, dark, NOISE) for nm in DRAWS])
    assert errors.shape == (len(DRAWS), 9, len(repeats) + 1)
    predicted = np.sqrt(np.mean((errors**2).sum(axis=2), axis=0))
    scatter = np.sqrt(np.mean((powers - 1.0) ** 2, axis=0))
    assert predicted[3] == 0.0
    uncertain = predicted > 1e-5
    assert uncertain.sum() >= 5
    # four standard deviations of a scatter from so many draws
    np.testing.assert_allclose(scatter[uncertain], predicted[uncertain], rtol=4 / np.sqrt(2 * len(DRAWS)))


def test_without_repeats_nothing_is_corrected_and_nothing_errs(tmp_path: Path) -> None:
    store = lamp_store(tmp_path, ())
    errors = lamp_power_errors(store, DRAWS[0], WHOLE, darkness(store, WHOLE), NOISE)
    assert errors.shape == (9, 0)
    assert not drift_error(IDEAL["air"].ravel(), W[:9], errors, (0.0, 0.0)).any()


@pytest.mark.parametrize("element", IDEAL)
def test_the_error_of_a_matrix_is_the_change_that_a_false_power_makes(element: str) -> None:
    random = np.random.default_rng(5)
    turn = (0.3, -1.2)
    own = 7.0 * change_frames(IDEAL[element], -turn[0], -turn[1])
    causes = 1e-5 * random.normal(size=(36, 3))
    squares = np.zeros((4, 4))
    for cause in causes.T:
        found = np.linalg.pinv((1.0 + cause)[:, None] * W) @ W @ own.ravel()
        turned = change_frames(found.reshape(4, 4), *turn)
        squares += (turned / turned[0, 0] - IDEAL[element] / IDEAL[element][0, 0]) ** 2
    error = drift_error(own.ravel(), W, causes, turn)
    assert error[0, 0] == 0.0
    np.testing.assert_allclose(error, np.sqrt(squares), atol=1e-3 * error.max())


def test_deviations_of_a_drifting_lamp_are_of_the_size_of_their_errors(tmp_path: Path) -> None:
    """The virtual rig's five elements in two bands, its lamp drifting by a hundredth: 150 deviations that
    the errors of pixels alone do not explain.
    """
    raw = yaml.safe_load(SOURCE.read_text(encoding="utf-8"))
    raw["camera"] |= {"rows": 48, "columns": 48, "focal_px": 1600, "principal_px": [23.6, 23.9]}
    assert raw["lamp_drift"]["amplitude"] >= 0.01
    source = tmp_path / "rig.yaml"
    source.write_text(yaml.safe_dump(raw), encoding="utf-8")
    rig = read_rig(source)
    states = {"count": 36, "step_deg": 5, "ratio": 5}
    config = {
        "materials": "materials.tsv",
        "plan": {
            "lights_deg": [30],
            "bands_nm": [450, 550],
            "states": states,
            "exposures_ms": [5],
            "references": 3,
            "darks": 4,
        },
    }
    settings = check(config, "config", "config.yaml")
    plan = capture_plan(settings["plan"], rig, "config.yaml")
    plans = session_plans(plan, settings, "config.yaml")
    for element in IDEAL:
        capture_target(
            plans[element], rig.with_no_sphere(), source, element, settings["session"], tmp_path / element
        )
    manifests = {element: tmp_path / element / "lights/180.00/manifest.json" for element in IDEAL}
    truth = {
        kind: write_truth(kind, rig, tmp_path / f"{kind}.json")
        for kind in ("polarimeter", "radiometry", "lights")
    }
    validate_session("monday", manifests, truth, tmp_path / "monday.json")
    found = Validation.read(tmp_path / "monday.json").comparisons(CALIBRATED)
    ratios, of_pixels = [], []
    for each in found:
        deviation, error = each.deviation.ravel()[1:], each.error.ravel()[1:]
        ratios.append(deviation / error)
        of_pixels.append(deviation / np.sqrt(error**2 - each.drift_error.ravel()[1:] ** 2))
    assert 0.7 < np.sqrt(np.mean(np.square(ratios))) < 1.5
    assert np.abs(ratios).max() < BEYOND_NOISE < np.abs(of_pixels).max()
