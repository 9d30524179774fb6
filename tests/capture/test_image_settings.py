"""What the CSV of a folder of images says, and what of it is refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from image_folder import Photographs

from pbrdf.capture.images import COLUMNS, read_image_settings
from pbrdf.errors import InputError


@pytest.fixture
def photographs(tmp_path: Path) -> Photographs:
    return Photographs(tmp_path)


@pytest.mark.parametrize("name", ["./450_0_0.01.png", ".//450_0_0.01.png"])
def test_a_file_under_two_names_is_refused(photographs: Photographs, name: str) -> None:
    photographs.rows[5][0] = name
    assert photographs.refusal().problem == "`450_0_0.01.png` stands there twice"


def test_a_doubled_row_is_refused(photographs: Photographs) -> None:
    photographs.rows.append(photographs.rows[5])
    refused = photographs.refusal()
    assert (refused.field, refused.problem) == ("file", f"`{photographs.rows[5][0]}` stands there twice")


def test_two_images_of_the_same_setting_are_refused(photographs: Photographs) -> None:
    photographs.rows.append(["550_3_0.08.png", *photographs.rows[0][1:]])
    photographs.rows = [row for index, row in enumerate(photographs.rows) if index != 39]
    refused = photographs.refusal()
    assert refused.field == "light 041.00, 450 nm, state (0.0, 0.0, 0.0, 90.0), 0.01 s"
    assert refused.problem == "is what line 2 (`450_0_0.01.png`) and line 69 (`550_3_0.08.png`) both show"


def test_a_missing_combination_is_refused(photographs: Photographs) -> None:
    photographs.drop("550_3_0.08.png")
    refused = photographs.refusal()
    assert refused.source == str(photographs.details)
    assert refused.field == "light 041.00, 550 nm, state (0.0, 75.0, 15.0, 90.0), 0.08 s"
    assert refused.problem == (
        "has no image, and line 9 (`450_3_0.08.png`) shows that exposure in "
        "light 041.00, 450 nm, state (0.0, 75.0, 15.0, 90.0), 0.08 s"
    )


def test_a_light_that_lacks_a_state_of_others_is_refused(photographs: Photographs) -> None:
    photographs.move("550", to_light="8")
    photographs.drop("550_3_0.01.png", "550_3_0.08.png")
    for light in ("008.00", "041.00"):
        refused = photographs.refusal(light)
        assert refused.field == "light 008.00, 450 nm, state (0.0, 75.0, 15.0, 90.0), 0.01 s"
        assert refused.problem.startswith("has no image, and line 8 (`450_3_0.01.png`) shows that state")
        assert refused.remedy == "add it, or drop that state everywhere"


def test_a_light_that_lacks_an_exposure_of_others_is_refused(photographs: Photographs) -> None:
    photographs.move("550", to_light="8")
    photographs.drop(*(f"550_{state}_0.08.png" for state in range(16)))
    refused = photographs.refusal("008.00")
    assert refused.field == "light 008.00, 450 nm, state (0.0, 0.0, 0.0, 90.0), 0.08 s"
    assert "line 3 (`450_0_0.08.png`) shows that exposure in light 041.00" in refused.problem


def test_a_light_that_lacks_a_band_of_others_is_refused(photographs: Photographs) -> None:
    for row in photographs.rows:
        if row[2] == "550":
            row[1] = "8"
    refused = photographs.refusal("041.00")
    assert refused.field == "light 041.00, 550 nm, state (0.0, 0.0, 0.0, 90.0), 0.01 s"
    assert "line 34 (`550_0_0.01.png`) shows that band in light 008.00" in refused.problem


def test_an_exposure_of_one_image_alone_is_refused(photographs: Photographs) -> None:
    row = next(row for row in photographs.rows if row[0] == "550_3_0.08.png")
    row[-1] = "0.081"
    refused = photographs.refusal()
    assert "line 41 (`550_3_0.08.png`) shows that exposure" in refused.problem


def test_gaps_are_found_before_an_image_is_read(photographs: Photographs) -> None:
    photographs.drop("550_15_0.08.png")
    for path in photographs.folder.iterdir():
        path.unlink()
    assert photographs.refusal().problem.startswith("has no image")


def test_uneven_dark_frames_are_refused(photographs: Photographs) -> None:
    photographs.rows.pop()
    refused = photographs.refusal()
    assert refused.field == "light 041.00, dark, 0.08 s"
    assert refused.problem == "has 1 frames, and line 67 (`dark_1_0.01.png`) is one of 2 of 0.01 s"


def test_an_exposure_without_dark_frames_is_refused(photographs: Photographs) -> None:
    del photographs.rows[-2:]
    assert photographs.refusal().problem.startswith("has 0 frames")


def test_a_dark_frame_of_a_time_that_no_image_has_is_refused(photographs: Photographs) -> None:
    photographs.rows[-1][-1] = "0.5"
    refused = photographs.refusal()
    assert refused.field == "line 69 (`dark_1_0.08.png`), exposure_s"
    assert refused.problem == "is 0.5, and no image was exposed so long"


@pytest.mark.parametrize("light", ["41", "8"])
def test_dark_frames_alone_are_no_light(photographs: Photographs, light: str) -> None:
    if light == "41":
        photographs.rows = [row for row in photographs.rows if row[2] == "dark"]
    else:
        for row in photographs.rows[-4:]:
            row[1] = light
    refused = photographs.refusal()
    assert refused.field == "band_nm"
    assert f"the light 0{float(light):05.2f} has no other images" in refused.problem


def test_a_light_without_images_is_refused(photographs: Photographs) -> None:
    refused = photographs.refusal("060.00")
    assert "060.00" in refused.problem


@pytest.mark.parametrize("name", ["../secret.png", "/etc/secret.png", "a/../../secret.png", ""])
def test_a_path_that_leaves_the_folder_is_refused(photographs: Photographs, name: str) -> None:
    photographs.rows[2][0] = name
    refused = photographs.refusal()
    assert refused.field == "line 4, file"
    assert repr(name) in refused.problem


@pytest.mark.parametrize(
    ("column", "cell"),
    [
        ("light_deg", "nan"),
        ("light_deg", "-8"),
        ("light_deg", "361"),
        ("band_nm", "red"),
        ("band_nm", "0"),
        ("band_nm", "-450"),
        ("band_nm", "450.5"),
        ("generator_retarder_deg", "inf"),
        ("analyser_polariser_deg", ""),
        ("exposure_s", "0"),
        ("exposure_s", "-1"),
        ("exposure_s", "10 ms"),
    ],
)
def test_a_cell_that_cannot_be_read_is_named(photographs: Photographs, column: str, cell: str) -> None:
    photographs.rows[2][COLUMNS.index(column)] = cell
    assert photographs.refusal().field == f"line 4, {column}"


def test_a_line_cut_short_or_too_long_is_refused(photographs: Photographs) -> None:
    row = photographs.rows[2]
    photographs.rows[2] = row[:-1]
    assert photographs.refusal().field == "line 4, exposure_s"
    photographs.rows[2] = [*row, "again"]
    assert photographs.refusal().field == "line 4"


def test_other_columns_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "settings.csv"
    path.write_text("file,angle\na.png,3\n")
    with pytest.raises(InputError, match="header"):
        read_image_settings(path)


def test_a_table_of_no_images_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "settings.csv"
    path.write_text(",".join(COLUMNS) + "\n")
    with pytest.raises(InputError, match="rows: there are none"):
        read_image_settings(path)


def test_a_missing_table_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.csv: file: does not exist"):
        read_image_settings(tmp_path / "none.csv")


def test_bytes_that_are_no_text_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "settings.csv"
    path.write_bytes(",".join(COLUMNS).encode() + b"\ngr\xfcn.png,41,450,0,0,0,0,1\n")
    with pytest.raises(InputError, match="is not UTF-8"):
        read_image_settings(path)
