from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from pbrdf.errors import InputError
from pbrdf.formats.documents import (
    member,
    number,
    numbers,
    positive,
    read_any,
    read_document,
    unit_vector,
    wavelengths,
    write_document,
    write_text,
)

KIND = "camera/1"


def _written(folder: Path, text: str) -> Path:
    path = folder / "document.json"
    path.write_text(text, encoding="utf-8")
    return path


def _refusal(read: Any, *arguments: Any) -> InputError:
    with pytest.raises(InputError) as refused:
        read(*arguments)
    assert "\n" not in str(refused.value)
    return refused.value


def test_a_document_returns_as_it_was_written(tmp_path: Path) -> None:
    content = {"b": [1, 2.5], "a": {"name": "größe", "none": None, "yes": True}}
    write_document(tmp_path / "a/b.json", KIND, content)
    assert read_document(tmp_path / "a/b.json", KIND) == {"schema": "pbrdf/camera/1", **content}


def test_numbers_return_to_the_last_bit(tmp_path: Path) -> None:
    values = [0.1, 1 / 3, 1e-300, 1.7976931348623157e308, -0.0]
    write_document(tmp_path / "a.json", KIND, {"values": values})
    assert numbers("a", read_any(tmp_path / "a.json"), "values", 5) == tuple(values)


def test_the_same_content_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("one", "other"):
        write_document(tmp_path / name, KIND, {"x": [0.1, 2], "y": "θ"})
    assert (tmp_path / "one").read_bytes() == (tmp_path / "other").read_bytes()
    assert (tmp_path / "one").read_bytes().endswith(b"}\n")


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf")])
def test_what_is_not_finite_is_not_written(tmp_path: Path, value: float) -> None:
    with pytest.raises(ValueError, match="not JSON compliant"):
        write_document(tmp_path / "a.json", KIND, {"x": [value]})
    assert list(tmp_path.iterdir()) == []


def test_text_that_cannot_be_encoded_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(UnicodeEncodeError):
        write_text(tmp_path / "a.json", "whole \ud800")
    assert list(tmp_path.iterdir()) == []


def test_another_user_may_read_what_is_written(tmp_path: Path) -> None:
    write_text(tmp_path / "a.json", "{}")
    assert (tmp_path / "a.json").stat().st_mode & 0o777 == 0o644


@pytest.mark.parametrize("text", ["NaN", "Infinity", "-Infinity", "1e999", "-1e999"])
def test_a_number_that_is_not_finite_is_refused(tmp_path: Path, text: str) -> None:
    path = _written(tmp_path, f'{{"schema": "pbrdf/camera/1", "x": [1, {text}]}}')
    refused = _refusal(read_document, path, KIND)
    assert (refused.source, refused.field) == (str(path), "file")
    assert f"{text} is not a finite number" in refused.problem


@pytest.mark.parametrize("text", ["", "{", "{'a': 1}", "nonsense", "[" * 100_000])
def test_what_is_not_json_is_refused(tmp_path: Path, text: str) -> None:
    assert "is not JSON" in _refusal(read_any, _written(tmp_path, text)).problem


def test_bytes_that_are_no_text_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "document.json"
    path.write_bytes(b'{"a": "\xff"}')
    assert "is not JSON" in _refusal(read_any, path).problem


@pytest.mark.parametrize("text", ["[]", "3", '"text"', "null"])
def test_what_is_no_object_is_refused(tmp_path: Path, text: str) -> None:
    assert _refusal(read_any, _written(tmp_path, text)).problem == "is not a JSON object"


@pytest.mark.parametrize("schema", ["pbrdf/camera/2", "pbrdf/lights/1", "camera/1", 3, None])
def test_another_schema_is_refused(tmp_path: Path, schema: object) -> None:
    refused = _refusal(read_document, _written(tmp_path, json.dumps({"schema": schema})), KIND)
    assert refused.field == "schema"
    assert repr(schema) in refused.problem
    assert "`pbrdf/camera/1`" in refused.remedy


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    assert _refusal(read_any, tmp_path / "none.json").problem == "does not exist"


def test_a_folder_is_no_document(tmp_path: Path) -> None:
    assert "cannot be read" in _refusal(read_any, tmp_path).problem


def test_a_member_is_found_by_its_dotted_name() -> None:
    assert member("a", {"x": {"y": [1]}}, "x.y") == [1]


@pytest.mark.parametrize("field", ["z", "x.z", "x.y.z"])
def test_a_missing_member_is_named(field: str) -> None:
    refused = _refusal(member, "a.json", {"x": {"y": 1}}, field)
    assert (refused.source, refused.field, refused.problem) == ("a.json", field, "is missing")


@pytest.mark.parametrize("value", ["1", True, None, [1], float("nan"), float("inf"), 10**400])
def test_what_is_no_finite_number_is_refused(value: object) -> None:
    assert _refusal(number, "a.json", {"x": value}, "x").field == "x"
    assert _refusal(numbers, "a.json", {"x": [0, value]}, "x", 2).field == "x[1]"
    assert _refusal(positive, "a.json", {"x": value}, "x").field == "x"


@pytest.mark.parametrize("value", [[1], [1, 2, 3], "12", 12, None])
def test_another_number_of_numbers_is_refused(value: object) -> None:
    assert _refusal(numbers, "a.json", {"x": value}, "x", 2).remedy == "give 2 numbers"


@pytest.mark.parametrize("value", [0, -0.1])
def test_what_is_not_above_zero_is_refused(value: float) -> None:
    assert _refusal(positive, "a.json", {"x": value}, "x").remedy == "give a number above zero"


def test_bands_are_whole_nanometres() -> None:
    assert wavelengths("a.json", {"bands": {"450": 1, "0650": 2}}, "bands") == {450: "450", 650: "0650"}


@pytest.mark.parametrize("value", [{}, [450], "450", 450, None])
def test_what_has_no_bands_is_refused(value: object) -> None:
    assert _refusal(wavelengths, "a.json", {"bands": value}, "bands").field == "bands"


@pytest.mark.parametrize("name", ["450.5", "-450", "red", "", "٤٥٠"])
def test_what_is_no_wavelength_is_refused(name: str) -> None:
    assert _refusal(wavelengths, "a.json", {"bands": {name: 1}}, "bands").field == f"bands.{name}"


def test_a_direction_is_made_of_length_one() -> None:
    assert unit_vector("a.json", {"x": [0, 0.9995, 0]}, "x") == (0.0, 1.0, 0.0)


@pytest.mark.parametrize("value", [[0, 0, 0], [0, 0.99, 0], [1, 1, 0]])
def test_what_is_no_unit_vector_is_refused(value: list[float]) -> None:
    assert _refusal(unit_vector, "a.json", {"x": value}, "x").remedy == "give a unit vector"
