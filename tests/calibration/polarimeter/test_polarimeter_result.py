"""What is written of a measured polarimeter is what reconstruction reads, and nothing unusable is read."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.calibration.polarimeter import KIND, PolarimeterCalibration
from pbrdf.calibration.polarimeter_fit import PolarimeterFit, fit_polarimeter
from pbrdf.calibration.polarimeter_result import measured_polarimeter, residual_map, retardance_curve
from pbrdf.calibration.polarimeter_signal import Reference
from pbrdf.errors import InputError
from pbrdf.formats.documents import write_document
from pbrdf.optics.elements import IDEAL
from pbrdf.optics.polarimeter import Polarimeter

Float = NDArray[np.float64]
Signals = Callable[..., Float]

BANDS_NM = [450, 550]
UP = (0.0, -1.0, 0.0)
RIG = [
    Polarimeter(1.53, 1.54, (0.0, 0.02, -0.01, 0.004), 0.01),
    Polarimeter(1.59, 1.58, (0.0, 0.02, -0.01, 0.004)),
]


def fitted(
    states: Float, signals: Signals, names: tuple[str, ...] = ("air",), **options: Any
) -> PolarimeterFit:
    references = [Reference(name, IDEAL[name]) for name in names]
    clean = signals(RIG, states, references)
    sigma = np.broadcast_to(clean.mean(axis=-1, keepdims=True) / 1000, clean.shape)
    seen = clean + sigma * np.random.default_rng(3).normal(size=clean.shape)
    noise = sigma if options.pop("known", True) else None
    return fit_polarimeter(states, seen, references, noise=noise, **options)


def written(fit: PolarimeterFit, path: Path) -> dict[str, Any]:
    write_document(path, KIND, measured_polarimeter(fit, BANDS_NM, UP, "DN"))
    return json.loads(path.read_text(encoding="utf-8"))  # type: ignore[no-any-return]


@pytest.mark.parametrize("extinction", [False, True])
def test_what_is_written_reads_as_the_fit(
    extinction: bool, tmp_path: Path, slow_and_fast_deg: Float, signals: Signals
) -> None:
    fit = fitted(slow_and_fast_deg, signals, extinction=extinction)
    written(fit, tmp_path / "polarimeter.json")
    read = PolarimeterCalibration.read(tmp_path / "polarimeter.json")
    assert read.analyser_axis == UP
    assert list(read.bands) == BANDS_NM
    for polarimeter, expected in zip(read.bands.values(), fit.polarimeters(), strict=True):
        assert polarimeter.zeros == pytest.approx(expected.zeros, abs=1e-15)
        assert polarimeter.generator_retardance == pytest.approx(expected.generator_retardance, rel=1e-15)
        assert polarimeter.analyser_retardance == pytest.approx(expected.analyser_retardance, rel=1e-15)
        assert polarimeter.extinction == pytest.approx(expected.extinction, rel=1e-15)
    assert (read.bands[450].extinction > 0.005) == extinction


def test_a_document_tells_errors_residuals_and_what_was_assumed(
    tmp_path: Path, slow_and_fast_deg: Float, signals: Signals
) -> None:
    content = written(
        fitted(slow_and_fast_deg, signals, ("air", "CPR"), extinction=True, drift=True), tmp_path / "a.json"
    )
    assert content["source"] == "measured"
    assert content["verdict"].startswith("good: ")
    assert content["usable"] is True
    assert content["s3_sign"] == {"settled": True, "by": "CPR"}
    assert content["frame_rotation"]["settled"] is False
    assert "0°" in content["frame_rotation"]["assumed"]
    assert content["scale_sense"]["settled"] is False
    assert content["zeros_standard_error_deg"]["generator_polariser"] == 0.0
    assert 0 < content["zeros_standard_error_deg"]["generator_retarder"] < 0.1
    air = content["bands"]["450"]["references"]["air"]
    assert air["residual_rms"] == pytest.approx(air["noise_rms"], rel=0.4)
    assert air["amplitude"] == pytest.approx(1000, rel=5 * air["amplitude_standard_error"] / 1000)
    assert content["lamp_known_at"] is None
    assert abs(air["lamp_drift"][0]) < 5 * air["lamp_drift_standard_error"][0]
    assert content["chi_square_per_freedom"] == pytest.approx(1.0, abs=0.3)


def test_noise_that_nobody_gave_is_not_told(
    tmp_path: Path, slow_and_fast_deg: Float, signals: Signals
) -> None:
    content = written(fitted(slow_and_fast_deg, signals, known=False), tmp_path / "a.json")
    assert content["chi_square_per_freedom"] is None
    assert content["bands"]["450"]["references"]["air"]["noise_rms"] is None


def test_the_same_signals_give_the_same_bytes(
    tmp_path: Path, slow_and_fast_deg: Float, signals: Signals
) -> None:
    for name in ("one.json", "other.json"):
        written(fitted(slow_and_fast_deg, signals), tmp_path / name)
    assert (tmp_path / "one.json").read_bytes() == (tmp_path / "other.json").read_bytes()


def test_the_curve_shows_retardances_beside_the_quarter_wave(
    slow_and_fast_deg: Float, signals: Signals
) -> None:
    curve = retardance_curve(fitted(slow_and_fast_deg, signals), BANDS_NM)
    assert curve["ideal_waves"] == 0.25
    assert curve["wavelengths_nm"] == BANDS_NM
    for module in ("generator", "analyser"):
        true = [getattr(p, f"{module}_retardance") / (2 * np.pi) for p in RIG]
        # the second rig's band leaks, which a fit without extinction takes for retardance
        np.testing.assert_allclose(curve[f"{module}_retardance_waves"][1], true[1], atol=3e-3)
        assert all(0 < error < 1e-3 for error in curve[f"{module}_standard_error_waves"])


def test_an_unusable_measurement_is_not_read(
    tmp_path: Path, slow_and_fast_deg: Float, signals: Signals
) -> None:
    seen = np.random.default_rng(0).uniform(50, 100, (1, 2, 36))
    fit = fit_polarimeter(slow_and_fast_deg, seen, [Reference("air", np.eye(4))])
    content = written(fit, tmp_path / "polarimeter.json")
    assert content["usable"] is False
    with pytest.raises(InputError) as refused:
        PolarimeterCalibration.read(tmp_path / "polarimeter.json")
    assert refused.value.field == "verdict"
    assert content["verdict"] in refused.value.problem


@pytest.mark.parametrize("ratio", [-0.1, 1.0, "much"])
def test_an_extinction_that_no_polariser_has_is_refused(
    ratio: object, tmp_path: Path, slow_and_fast_deg: Float, signals: Signals
) -> None:
    content = written(fitted(slow_and_fast_deg, signals), tmp_path / "polarimeter.json")
    content["bands"]["550"]["extinction_ratio"] = ratio
    (tmp_path / "polarimeter.json").write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError) as refused:
        PolarimeterCalibration.read(tmp_path / "polarimeter.json")
    assert refused.value.field == "bands.550.extinction_ratio"


def test_pixels_of_a_known_reference_leave_their_noise_over(slow_and_fast_deg: Float) -> None:
    random = np.random.default_rng(1)
    expected = RIG[0].measurement_matrix(np.deg2rad(slow_and_fast_deg)) @ np.eye(4).ravel()
    brightness = random.uniform(100, 200, 70000)
    images = expected[:, None] * brightness + random.normal(size=(36, 70000))
    images[4, 7] = np.nan
    coefficients, rms = residual_map(expected[:, None], images)
    assert np.isnan(rms[7]) and np.isnan(coefficients[0, 7])
    keep = np.arange(70000) != 7
    np.testing.assert_allclose(coefficients[0, keep], brightness[keep], atol=3)
    # one unknown of 36 signals
    assert (rms[keep] ** 2).mean() == pytest.approx(35 / 36, rel=0.005)


def test_pixels_of_an_unknown_sample_give_its_matrix(slow_and_fast_deg: Float) -> None:
    w = RIG[0].measurement_matrix(np.deg2rad(slow_and_fast_deg))
    samples = np.random.default_rng(2).normal(size=(16, 50))
    coefficients, rms = residual_map(w, w @ samples)
    np.testing.assert_allclose(coefficients, samples, atol=1e-10)
    np.testing.assert_allclose(rms, 0.0, atol=1e-12)


def test_images_of_other_states_are_refused(slow_and_fast_deg: Float) -> None:
    w = RIG[0].measurement_matrix(np.deg2rad(slow_and_fast_deg))
    with pytest.raises(InputError, match="images"):
        residual_map(w, np.zeros((35, 4)))
    with pytest.raises(InputError, match="states"):
        residual_map(w[:12], np.zeros((12, 4)))
