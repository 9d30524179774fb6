from __future__ import annotations

from pathlib import Path

import pytest

from pbrdf.errors import InputError
from pbrdf.settings.materials import COLUMNS, Material, placed_materials, read_materials, select

HEADER = "\t".join(COLUMNS)
GOOD = ("gold", "rig", "monday", "25", "-", "-")


def _written(folder: Path, *rows: tuple[str, ...]) -> Path:
    path = folder / "materials.tsv"
    path.write_text("\n".join([HEADER, *("\t".join(row) for row in rows)]) + "\n", encoding="utf-8")
    return path


def _changed(column: str, cell: str) -> tuple[str, ...]:
    return tuple(cell if name == column else value for name, value in zip(COLUMNS, GOOD, strict=True))


def _refusal(folder: Path, *rows: tuple[str, ...], data: str | None = None) -> InputError:
    path = _written(folder, *rows)
    with pytest.raises(InputError) as refused:
        read_materials(path, data)
    assert refused.value.source == str(path)
    assert "\n" not in str(refused.value)
    return refused.value


def test_rows_become_materials_in_the_order_of_the_file(tmp_path: Path) -> None:
    spectralon = ("spectralon", "table", "-", "-", "{data}/s.pbsdf", "{data}/axes.yaml")
    found = read_materials(_written(tmp_path, spectralon, GOOD), "elsewhere")
    assert list(found) == ["spectralon", "gold"]
    assert found["gold"] == Material("gold", "rig", "monday", 25.0)
    assert found["spectralon"] == Material(
        "spectralon", "table", path=Path("elsewhere/s.pbsdf"), details=Path("elsewhere/axes.yaml")
    )


@pytest.mark.parametrize("column", ["material", "session"])
@pytest.mark.parametrize(
    "name",
    ["../x", "<script>", "a/b", ".", "..", "_sessions", "-gold", "red gold", "gold\x00", "g" * 65, "größe"],
)
def test_a_name_that_cannot_become_a_folder_is_refused(tmp_path: Path, column: str, name: str) -> None:
    refused = _refusal(tmp_path, _changed(column, name))
    assert refused.field == f"line 2, {column}"
    assert "cannot become a folder" in refused.problem
    assert "letters, digits" in refused.remedy


@pytest.mark.parametrize("name", ["calibration", "report"])
def test_a_name_of_a_folder_of_results_is_refused(tmp_path: Path, name: str) -> None:
    refused = _refusal(tmp_path, _changed("material", name))
    assert refused.field == "line 2, material"
    assert name in refused.problem


@pytest.mark.parametrize("column", COLUMNS)
def test_an_empty_cell_is_refused(tmp_path: Path, column: str) -> None:
    refused = _refusal(tmp_path, GOOD, _changed(column, ""))
    assert refused.field == f"line 3, {column}"
    assert refused.problem == "is empty"
    assert "`-`" in refused.remedy


@pytest.mark.parametrize(
    ("row", "column"),
    [
        (("-", "rig", "monday", "25", "-", "-"), "material"),
        (("gold", "camera", "monday", "25", "-", "-"), "source"),
        (("gold", "rig", "-", "25", "-", "-"), "session"),
        (("gold", "rig", "monday", "-", "-", "-"), "radius_mm"),
        (("gold", "rig", "monday", "-25", "-", "-"), "radius_mm"),
        (("gold", "rig", "monday", "nan", "-", "-"), "radius_mm"),
        (("gold", "rig", "monday", "1e999", "-", "-"), "radius_mm"),
        (("gold", "rig", "monday", "25 mm", "-", "-"), "radius_mm"),
        (("gold", "capture", "monday", "25", "-", "-"), "path"),
        (("gold", "images", "monday", "25", "-", "a.csv"), "path"),
        (("gold", "images", "monday", "25", "photos", "-"), "details"),
        (("gold", "table", "-", "-", "-", "-"), "path"),
        (("gold", "rig", "monday", "25", "-"), "details"),
        (("gold", "rig", "monday", "25", "-", "-", "-"), "cells"),
    ],
)
def test_a_row_that_says_too_little_or_too_much_is_refused(
    tmp_path: Path, row: tuple[str, ...], column: str
) -> None:
    assert _refusal(tmp_path, row).field == f"line 2, {column}"


def test_lines_are_counted_as_an_editor_does(tmp_path: Path) -> None:
    path = tmp_path / "materials.tsv"
    path.write_text(f"{HEADER}\n\n\n" + "\t".join(_changed("source", "camera")) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="line 4, source"):
        read_materials(path)


def test_a_doubled_material_is_refused(tmp_path: Path) -> None:
    refused = _refusal(tmp_path, GOOD, GOOD)
    assert (refused.field, refused.problem) == ("material", "`gold` stands there twice")


def test_a_table_of_no_materials_is_refused(tmp_path: Path) -> None:
    assert _refusal(tmp_path).field == "rows"


@pytest.mark.parametrize("header", ["material,source", "material\tsource", ""])
def test_other_columns_are_refused(tmp_path: Path, header: str) -> None:
    path = tmp_path / "materials.tsv"
    path.write_text(header + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="write the columns material <tab> source"):
        read_materials(path)


def test_bytes_that_are_no_text_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "materials.tsv"
    path.write_bytes(HEADER.encode() + b"\ngr\xfcn\trig\tmonday\t25\t-\t-\n")
    with pytest.raises(InputError, match="is not UTF-8"):
        read_materials(path)


def test_a_missing_table_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="file: does not exist; correct `materials`"):
        read_materials(tmp_path / "none.tsv")


@pytest.mark.parametrize("column", ["path", "details"])
def test_data_left_open_is_refused(tmp_path: Path, column: str) -> None:
    row = {"path": "photos", "details": "a.csv"} | {column: "{data}/x"}
    refused = _refusal(tmp_path, ("gold", "images", "monday", "-", row["path"], row["details"]))
    assert refused.field == f"line 2, {column}"
    assert "--config data=" in refused.remedy


def test_only_the_named_materials_are_taken_in_the_order_named() -> None:
    table = {name: Material(name, "rig") for name in ("gold", "jade", "opal")}
    assert list(select(table, ["opal", "gold"], "config.yaml")) == ["opal", "gold"]
    assert select(table, [], "config.yaml") == table


@pytest.mark.parametrize(
    ("name", "remedy"), [("glod", "did you mean `gold`?"), ("xyz", "the table has gold, jade")]
)
def test_a_misspelt_material_is_refused(name: str, remedy: str) -> None:
    table = {name: Material(name, "rig") for name in ("gold", "jade")}
    with pytest.raises(InputError) as refused:
        select(table, [name], "config.yaml")
    assert (refused.value.field, refused.value.remedy) == ("only", remedy)


@pytest.mark.parametrize("column", ["path", "details"])
def test_a_path_that_leads_nowhere_is_refused(tmp_path: Path, column: str) -> None:
    (tmp_path / "there").touch()
    paths = {"path": Path("there"), "details": Path("there")} | {column: Path("nowhere")}
    table = {"gold": Material("gold", "images", "monday", **paths)}
    with pytest.raises(InputError) as refused:
        placed_materials(table, tmp_path.joinpath, "materials.tsv")
    assert refused.value.field == f"gold, {column}"
    assert "nowhere" in refused.value.problem


def test_paths_are_put_in_their_place(tmp_path: Path) -> None:
    (tmp_path / "there").touch()
    table = {"gold": Material("gold", "table", path=Path("there")), "jade": Material("jade", "rig")}
    found = placed_materials(table, tmp_path.joinpath, "materials.tsv")
    assert found["gold"].path == tmp_path / "there"
    assert found["gold"].details is None
    assert found["jade"] == table["jade"]
