from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from pbrdf.errors import InputError
from pbrdf.settings.checked import check, read_checked

PLAN = """
plan:
  lights_deg: [8, 41]
  bands_nm: [550]
  states: {count: 36, step_deg: 5, ratio: 5}
  exposures_ms: [5]
"""


def _written(folder: Path, text: str) -> Path:
    path = folder / "config.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def _refusal(folder: Path, text: str) -> InputError:
    path = _written(folder, text)
    with pytest.raises(InputError) as refused:
        read_checked(path, "config")
    assert refused.value.source == str(path)
    assert "\n" not in str(refused.value)
    return refused.value


def test_defaults_fill_what_is_left_out(tmp_path: Path) -> None:
    settings = read_checked(_written(tmp_path, "materials: m.tsv\ntabulation: {theta_h: 7}" + PLAN), "config")
    assert settings["only"] == []
    assert settings["rig"] is None
    assert settings["plan"]["darks"] == 4
    assert settings["tabulation"] == {
        "mapping": "slices",
        "slips": [],
        "theta_h": 7,
        "theta_d": 91,
        "phi_d": 361,
        "grazing_deg": 80,
        "widest_gap_deg": 6,
        "symmetrise": True,
        "fill_sigma": 1.5,
        "project": False,
    }
    assert settings["fitting"]["models"] == ["baek2018", "hyde2009"]


def test_a_plan_is_not_made_up(tmp_path: Path) -> None:
    assert "plan" not in read_checked(_written(tmp_path, "materials: m.tsv"), "config")


def test_whoever_changes_settings_leaves_the_defaults_alone() -> None:
    check({"materials": "m.tsv"}, "config", "a.yaml")["only"].append("gold")
    assert check({"materials": "m.tsv"}, "config", "a.yaml")["only"] == []


def test_what_the_user_wrote_stays_as_it_was() -> None:
    content = {"materials": "m.tsv", "tabulation": {"theta_h": 7}}
    check(content, "config", "a.yaml")
    assert content == {"materials": "m.tsv", "tabulation": {"theta_h": 7}}


@pytest.mark.parametrize(
    ("text", "field", "problem", "remedy"),
    [
        ("material: m.tsv", "top level", "unknown key `material`", "did you mean `materials`?"),
        ("materials: m.tsv\nzebra: 1", "top level", "unknown key `zebra`", "known keys are calibration, "),
        ("rig: r.yaml", "materials", "is missing", "give the path of the table of materials"),
        ("materials: m\nfitting: {sed: 1}", "fitting", "unknown key `sed`", "did you mean `seed`?"),
        ("materials: 5", "materials", "5 is not of type 'string'", "give the path of the table"),
        ("materials: m\nonly: gold", "only", "'gold' is not of type 'array'", "give a list of names"),
        ("materials: m\nfitting: {starts: 1.0}", "fitting.starts", "1.0 is not of type 'integer'", "give"),
        ("materials: m\nfitting: {starts: yes}", "fitting.starts", "True is not of type 'integer'", "give"),
        ("materials: m\nfitting: {starts: 0}", "fitting.starts", "0 is less than the minimum of 1", "give"),
        (
            "materials: m\nfitting: {models: [ward]}",
            "fitting.models.0",
            "'ward' is not one of",
            "(baek2018, ",
        ),
        ("materials: m\nplan: {lights_deg: [8]}", "plan.bands_nm", "is missing", "give a list of band cent"),
        ("materials: m\nfitting: {1: 2}", "fitting", "the key 1 is no text", 'write it as "1"'),
        (
            "materials: m\ntabulation: {grazing_deg: .nan}",
            "tabulation.grazing_deg",
            "is nan",
            "give a finite number",
        ),
        ("materials: m" + PLAN.replace("[5]", "[5, .inf]"), "plan.exposures_ms.1", "is inf", "finite"),
        ("", "top level", "None is not of type 'object'", "`key: value`"),
        ("- materials", "top level", "is not of type 'object'", "`key: value`"),
    ],
)
def test_what_the_schema_does_not_allow_is_named(
    tmp_path: Path, text: str, field: str, problem: str, remedy: str
) -> None:
    refused = _refusal(tmp_path, text)
    assert refused.field == field
    assert problem in refused.problem
    assert remedy in refused.remedy


@pytest.mark.parametrize("written", ["2.9e6", "2e-3", "1e20", '"41"'])
def test_a_number_that_yaml_takes_for_text_comes_with_one_that_it_does_not(
    tmp_path: Path, written: str
) -> None:
    refused = _refusal(tmp_path, "materials: m" + PLAN.replace("[5]", f"[{written}]"))
    assert refused.field == "plan.exposures_ms.0"
    assert refused.problem.endswith("is no number")
    offered = refused.remedy.split("write ")[1].removesuffix(", without quotes")
    assert yaml.safe_load(offered) == float(written.strip('"'))


def test_a_word_where_a_number_belongs_gets_no_advice_on_yaml(tmp_path: Path) -> None:
    refused = _refusal(tmp_path, "materials: m" + PLAN.replace("[5]", "[short]"))
    assert "'short' is not of type 'number'" in refused.problem
    assert refused.remedy.startswith("give exposure times, either a list in ms, ascending, or {shortest, ")


def test_a_long_value_does_not_flood_the_line(tmp_path: Path) -> None:
    refused = _refusal(tmp_path, f"materials: {list(range(1000))}")
    assert len(str(refused)) < 300


@pytest.mark.parametrize("text", ["materials: [a", "a: b: c", "\tmaterials: m"])
def test_broken_yaml_is_refused(tmp_path: Path, text: str) -> None:
    refused = _refusal(tmp_path, text)
    assert refused.field == "file"
    assert "is not YAML" in refused.problem


def test_bytes_that_are_no_text_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "config.yaml"
    path.write_bytes(b"materials: \xff")
    with pytest.raises(InputError, match="is not YAML"):
        read_checked(path, "config")


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.yaml: file: does not exist"):
        read_checked(tmp_path / "none.yaml", "config")


def test_a_folder_is_no_config(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="file: cannot be read"):
        read_checked(tmp_path, "config")
