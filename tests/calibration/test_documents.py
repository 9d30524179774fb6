from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rig_truth import write_truth

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.documents import KINDS, write_given
from pbrdf.calibration.flat_field import FlatField
from pbrdf.calibration.lights import read_lights
from pbrdf.calibration.polarimeter import PolarimeterCalibration
from pbrdf.calibration.radiometry import Radiometry
from pbrdf.calibration.sphere import Sphere
from pbrdf.errors import InputError
from pbrdf.settings.rig import RigSettings

READERS: dict[str, Callable[[str | Path], Any]] = {
    "camera": Camera.read,
    "polarimeter": PolarimeterCalibration.read,
    "lights": read_lights,
    "radiometry": Radiometry.read,
    "sphere": Sphere.read,
}
FIELDS = [
    ("camera", "focal_px"),
    ("camera", "principal_px"),
    ("camera", "rows"),
    ("camera", "columns"),
    ("lights", "centre_mm"),
    ("lights", "axis"),
    ("lights", "start"),
    ("lights", "radius_mm"),
    ("lights", "generator_axis"),
    ("polarimeter", "zeros_deg.generator_polariser"),
    ("polarimeter", "zeros_deg.generator_retarder"),
    ("polarimeter", "zeros_deg.analyser_retarder"),
    ("polarimeter", "zeros_deg.analyser_polariser"),
    ("polarimeter", "analyser_axis"),
    ("polarimeter", "bands"),
    ("polarimeter", "bands.550.generator_retardance_deg"),
    ("polarimeter", "bands.550.analyser_retardance_deg"),
    ("radiometry", "dn_per_electron"),
    ("radiometry", "read_noise_dn"),
    ("radiometry", "scale"),
    ("sphere", "centre_mm"),
    ("sphere", "radius_mm"),
]


def _changed(path: Path, field: str, value: object) -> Path:
    """Put a value at a dotted field of a document, or take the field out where the value is None."""
    content = json.loads(path.read_text(encoding="utf-8"))
    *outer, last = field.split(".")
    part = content
    for name in outer:
        part = part[name]
    if value is None:
        del part[last]
    else:
        part[last] = value
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


def _refusal(kind: str, path: Path) -> InputError:
    with pytest.raises(InputError) as refused:
        READERS[kind](path)
    assert refused.value.source == str(path)
    assert "\n" not in str(refused.value)
    return refused.value


@pytest.mark.parametrize("kind", READERS)
def test_a_file_of_the_user_is_taken_as_it_is_and_marked(
    tmp_path: Path, virtual: RigSettings, kind: str
) -> None:
    given = _changed(write_truth(kind, virtual, tmp_path / "mine.json"), "origin", "measured in May")
    path = tmp_path / "results/document.json"
    write_given(kind, given, path)
    before, after = (json.loads(p.read_text(encoding="utf-8")) for p in (given, path))
    assert after == before | {"source": "file"}
    assert repr(READERS[kind](path)) == repr(READERS[kind](given))


def test_a_flat_field_of_the_user_brings_its_image(tmp_path: Path, virtual: RigSettings) -> None:
    given = write_truth("flat", virtual, tmp_path / "mine.json")
    path = tmp_path / "results/flat.json"
    write_given("flat", given, path)
    window, shape = (slice(3, 9), slice(0, 7)), (192, 192)
    ours, theirs = (FlatField.read(p).at(550, window, shape) for p in (path, given))
    np.testing.assert_array_equal(ours, theirs)
    assert json.loads(path.read_text(encoding="utf-8"))["source"] == "file"


def test_the_projects_own_file_of_a_real_polarimeter_reads(tmp_path: Path) -> None:
    given = Path(__file__).resolve().parents[2] / "config/real/polarimeter.json"
    write_given("polarimeter", given, tmp_path / "polarimeter.json")
    elements = PolarimeterCalibration.read(tmp_path / "polarimeter.json").at(630, given)
    assert np.degrees(elements.generator_retardance) == pytest.approx(72.346)
    assert np.degrees(elements.analyser_retardance) == pytest.approx(72.297)


@pytest.mark.parametrize(
    ("kind", "other"), [(kind, other) for kind in KINDS for other in READERS if other != kind]
)
def test_the_wrong_kind_of_file_is_refused_and_nothing_written(
    tmp_path: Path, virtual: RigSettings, kind: str, other: str
) -> None:
    given = write_truth(other, virtual, tmp_path / "mine.json")
    with pytest.raises(InputError) as refused:
        write_given(kind, given, tmp_path / "results/document.json")
    assert (refused.value.source, refused.value.field) == (str(given), "schema")
    assert f"`pbrdf/{kind}/1`" in refused.value.remedy
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize(("kind", "field"), FIELDS)
def test_a_missing_field_is_named(tmp_path: Path, virtual: RigSettings, kind: str, field: str) -> None:
    path = _changed(write_truth(kind, virtual, tmp_path / "document.json"), field, None)
    refused = _refusal(kind, path)
    assert (refused.field, refused.problem) == (field, "is missing")
    with pytest.raises(InputError):
        write_given(kind, path, tmp_path / "results/document.json")
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize(("kind", "field"), FIELDS)
def test_a_field_that_is_text_is_named(tmp_path: Path, virtual: RigSettings, kind: str, field: str) -> None:
    path = _changed(write_truth(kind, virtual, tmp_path / "document.json"), field, "unknown")
    assert _refusal(kind, path).field == field


@pytest.mark.parametrize(("kind", "field"), FIELDS)
def test_a_value_that_is_not_finite_is_refused(
    tmp_path: Path, virtual: RigSettings, kind: str, field: str
) -> None:
    path = _changed(write_truth(kind, virtual, tmp_path / "document.json"), field, [float("nan")] * 3)
    assert "NaN" in _refusal(kind, path).problem


@pytest.mark.parametrize(
    ("kind", "field", "value"),
    [
        ("camera", "focal_px", [3200, 0]),
        ("camera", "focal_px", [-3200, 3200]),
        ("camera", "rows", 192.5),
        ("camera", "rows", 0),
        ("camera", "columns", -192),
        ("lights", "axis", [0, 0, 0]),
        ("lights", "start", [0, 0, -2]),
        ("lights", "generator_axis", [0.5, 0.5, 0]),
        ("lights", "radius_mm", 0),
        ("polarimeter", "analyser_axis", [0, 0, 0]),
        ("polarimeter", "bands", {}),
        ("polarimeter", "bands", [450]),
        ("radiometry", "dn_per_electron", -1),
        ("radiometry", "read_noise_dn", 0),
        ("radiometry", "scale", {}),
        ("radiometry", "scale", 5),
        ("sphere", "radius_mm", 0),
    ],
)
def test_what_no_rig_has_is_refused(
    tmp_path: Path, virtual: RigSettings, kind: str, field: str, value: object
) -> None:
    path = _changed(write_truth(kind, virtual, tmp_path / "document.json"), field, value)
    assert _refusal(kind, path).field == field


@pytest.mark.parametrize(
    ("kind", "field", "value"),
    [
        (
            "polarimeter",
            "bands.red",
            {"generator_retardance_deg": 90, "analyser_retardance_deg": 90},
        ),
        ("radiometry", "scale.red", 1.0),
        ("radiometry", "scale.550", 0.0),
        ("radiometry", "scale.550", -1.0),
    ],
)
def test_a_band_that_is_none_is_named(
    tmp_path: Path, virtual: RigSettings, kind: str, field: str, value: object
) -> None:
    path = _changed(write_truth(kind, virtual, tmp_path / "document.json"), field, value)
    assert _refusal(kind, path).field == field


def test_a_band_that_was_not_calibrated_is_named(tmp_path: Path, virtual: RigSettings) -> None:
    path = write_truth("polarimeter", virtual, tmp_path / "polarimeter.json")
    with pytest.raises(InputError) as refused:
        PolarimeterCalibration.read(path).at(530, path)
    assert (refused.value.source, refused.value.field) == (str(path), "bands.530")
    assert "450, 500, 550, 600, 650 nm" in refused.value.remedy


@pytest.mark.parametrize("kind", READERS)
def test_a_missing_file_is_refused(tmp_path: Path, kind: str) -> None:
    assert _refusal(kind, tmp_path / "none.json").problem == "does not exist"
