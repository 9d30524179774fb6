from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pbrdf.errors import InputError
from pbrdf.formats.band_exr import write_bands
from pbrdf.formats.receipt import write_receipt
from pbrdf.formats.table_data import TableData
from pbrdf.formats.table_zarr import write_table
from pbrdf.report.file_summary import file_summary


def test_a_table_says_what_it_was_made_from(tmp_path: Path, table: TableData) -> None:
    write_table(tmp_path / "table.zarr", table, {})
    bare = file_summary(tmp_path / "table.zarr")
    assert bare["kind"] == "pBRDF table"
    assert not any(name.startswith("made") for name in bare)
    (tmp_path / "slice.json").write_text("{}")
    write_receipt(
        tmp_path / "table.json",
        outputs=[tmp_path / "table.zarr"],
        inputs={"slices": [tmp_path / "slice.json"]},
        settings={"fill_sigma": 1.5},
    )
    told = file_summary(tmp_path / "table.zarr")
    assert told["made with fill_sigma"] == "1.5"
    assert len(told["made from slices"]) == 64


def test_a_picture_a_band_names_its_bands_and_unit(tmp_path: Path) -> None:
    write_bands(tmp_path / "flat.exr", {550: np.ones((4, 6), np.float32)}, {"units": "relative response"})
    told = file_summary(tmp_path / "flat.exr")
    assert told == {"kind": "image a band", "channels": "550nm", "units": "relative response"}


def test_a_journal_that_is_being_written_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "journal.jsonl"
    path.write_text('{"frame": "a", "checksum": "1"}\n{"frame": "b", "chec', encoding="utf-8")
    before = path.read_bytes()
    assert file_summary(path)["frames"] == "1"
    assert path.read_bytes() == before


@pytest.mark.parametrize("name", ["gone.zarr", "page.html", "broken.exr", "broken.jsonl", "empty.zarr"])
def test_what_cannot_be_told_is_refused_in_a_line(tmp_path: Path, name: str) -> None:
    if name == "empty.zarr":
        (tmp_path / name).mkdir()
    elif name != "gone.zarr":
        (tmp_path / name).write_text("nothing\nof the kind\n")
    with pytest.raises(InputError) as error:
        file_summary(tmp_path / name)
    assert "\n" not in str(error.value)
