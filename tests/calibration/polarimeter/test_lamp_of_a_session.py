"""The default rig's lamp rises and falls by a hundredth: what its references tell all the same."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from pbrdf.calibration.polarimeter import ELEMENTS
from pbrdf.calibration.session_polarimeter import calibrate_polarimeter, run_drift
from pbrdf.capture.session import capture_target
from pbrdf.formats.capture_store import FrameStore
from pbrdf.settings.checked import check
from pbrdf.settings.plan import capture_plan
from pbrdf.settings.rig import RigSettings
from pbrdf.settings.targets import session_plans

CONFIG = Path(__file__).resolve().parents[3] / "config/config.yaml"
REFERENCES = ("air", "LPH", "CPR")


def session(folder: Path, rig: RigSettings, *, repeats: bool = True) -> dict[str, Path]:
    """Manifests of the default run's references, with or without the repeats of a state."""
    settings = check(yaml.safe_load(CONFIG.read_text(encoding="utf-8")), "config", "test")
    plans = session_plans(capture_plan(settings["plan"], rig, "test"), settings, "test")
    for name in REFERENCES:
        plan = plans[name] if repeats else replace(plans[name], references=(), reference_state=0)
        capture_target(plan, rig, "rig", name, settings["session"], folder / name)
    return {name: next((folder / name).glob("lights/*/manifest.json")) for name in REFERENCES}


def calibrated(manifests: dict[str, Path], document: Path) -> dict[str, Any]:
    calibrate_polarimeter(manifests, document)
    content: dict[str, Any] = json.loads(document.read_text(encoding="utf-8"))
    return content


def times_noise(content: dict[str, Any]) -> dict[str, float]:
    """Residual over noise of all references, by band."""
    squares = {
        nm: [
            [cell[key] ** 2 for key in ("residual_rms", "noise_rms")] for cell in band["references"].values()
        ]
        for nm, band in content["bands"].items()
    }
    return {nm: float(np.sqrt(np.divide(*np.sum(pairs, axis=0)))) for nm, pairs in squares.items()}


@pytest.fixture(scope="module")
def manifests(tmp_path_factory: pytest.TempPathFactory, virtual: RigSettings) -> dict[str, Path]:
    return session(tmp_path_factory.mktemp("references"), virtual)


@pytest.fixture(scope="module")
def content(manifests: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    return calibrated(manifests, tmp_path_factory.mktemp("made") / "polarimeter.json")


def test_the_lamp_is_known_at_every_taking_of_the_repeated_state(manifests: dict[str, Path]) -> None:
    header = FrameStore.open(manifests["air"].parent / "frames.zarr").header
    places = run_drift(header)
    assert isinstance(places, tuple)
    # repeats before the first state, amid and after the last; the state's own turn besides
    assert (places[0], places[-1], len(places)) == (0, 38, 4)
    assert 1 + header.reference_state in places
    assert run_drift(replace(header, references=header.references[:1])) is True


def test_the_residual_is_the_noise_at_every_band(content: dict[str, Any]) -> None:
    assert content["verdict"].startswith("good")
    assert max(times_noise(content).values()) < 1.2
    assert content["chi_square_per_freedom"] < 1.2


def test_standard_errors_cover_the_truth(content: dict[str, Any], virtual: RigSettings) -> None:
    truth = virtual["polarimeter"]
    pulls = [
        (content["zeros_deg"][name] - truth["zeros_deg"][name]) / content["zeros_standard_error_deg"][name]
        for name in ELEMENTS
    ]
    for nm, band in content["bands"].items():
        for module in ("generator", "analyser"):
            off = band[f"{module}_retardance_deg"] - 360 * truth[f"{module}_retardance_waves"][nm]
            pulls.append(off / band[f"{module}_retardance_standard_error_deg"])
    assert len(pulls) == 14
    assert np.abs(pulls).max() < 3
    assert 0.5 < np.sqrt(np.mean(np.square(pulls))) < 1.5


def test_without_repeats_a_straight_line_is_fitted_and_what_it_misses_is_said(
    virtual: RigSettings, tmp_path: Path
) -> None:
    content = calibrated(session(tmp_path, virtual, repeats=False), tmp_path / "polarimeter.json")
    assert content["lamp_known_at"] is None
    assert content["verdict"].startswith("fair")
    assert "repeat a state within the run" in content["verdict"]
    assert max(times_noise(content).values()) > 1.5
