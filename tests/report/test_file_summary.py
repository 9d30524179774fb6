from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from pbrdf.errors import InputError
from pbrdf.formats.band_exr import write_bands
from pbrdf.formats.receipt import write_receipt
from pbrdf.formats.table_data import TableData
from pbrdf.formats.table_zarr import write_table
from pbrdf.report.file_summary import file_summary
from pbrdf.report.pages import material_page
from pbrdf.report.panels_data import TableSlice, drawn_panels


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
    assert told["kind"] == "image a band"
    assert told["shape"] == "1 × 4 × 6 px"
    assert told["550nm"] == "1 … 1 relative response"


def test_a_journal_that_is_being_written_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "journal.jsonl"
    path.write_text('{"frame": "a", "checksum": "1"}\n{"frame": "b", "chec', encoding="utf-8")
    before = path.read_bytes()
    assert file_summary(path)["frames"] == "1"
    assert path.read_bytes() == before


def test_rows_tell_their_quantities_and_units(tmp_path: Path) -> None:
    path = tmp_path / "comparison.csv"
    path.write_text("material,quantity,value,unit\ngold,dolp,0.1,1\ngold,cost,3,1/sr\n", encoding="utf-8")
    told = file_summary(path)
    assert told["shape"] == "2 rows × 4 columns"
    assert (told["material"], told["quantity"], told["unit"]) == ("gold", "cost, dolp", "1, 1/sr")


def test_a_page_tells_its_verdict_and_what_it_was_made_from(tmp_path: Path, table: TableData) -> None:
    provenance = {"table (SHA-256)": "ab<c"}
    html = material_page("gold", table, [], calibration_sources={}, provenance=provenance)
    (tmp_path / "gold.html").write_text(html, encoding="utf-8")
    told = file_summary(tmp_path / "gold.html")
    assert told["title"] == "gold"
    assert told["verdict"].startswith("2 bands, ")
    assert told["table (SHA-256)"] == "ab<c"


def test_values_of_panels_tell_their_range(tmp_path: Path, table: TableData) -> None:
    cut = TableSlice("theta_d", "phi_d", 3)
    drawn_panels("values/gold", table, None, [cut], [cut]).write(tmp_path / "gold")
    told = file_summary(tmp_path / "gold" / "slice0_band1.js")
    assert (told["slice"], told["band"]) == ("0", "1")
    first = cut.of(table.mueller[1])[..., 0, 0]
    assert told["table"].startswith(f"M00 {np.nanmin(first):.3g} … {np.nanmax(first):.3g} 1/sr, ")


@pytest.mark.parametrize(
    ("suffix", "shape"), [("png", "288 × 576 px"), ("svg", "144pt × 288pt"), ("pdf", "144 × 288 pt")]
)
def test_pictures_tell_their_size(tmp_path: Path, suffix: str, shape: str) -> None:
    path = tmp_path / f"a.{suffix}"
    Figure(figsize=(4, 2)).savefig(path, dpi=144)
    assert file_summary(path)["shape"] == shape


BROKEN = ("exr", "jsonl", "html", "js", "csv", "png", "svg", "pdf")


@pytest.mark.parametrize(
    "name", ["gone.zarr", "model.obj", "empty.zarr", *(f"broken.{end}" for end in BROKEN)]
)
def test_what_cannot_be_told_is_refused_in_a_line(tmp_path: Path, name: str) -> None:
    if name == "empty.zarr":
        (tmp_path / name).mkdir()
    elif name != "gone.zarr":
        (tmp_path / name).write_bytes(b"nothing\nof the kind\xff\n")
    with pytest.raises(InputError) as error:
        file_summary(tmp_path / name)
    assert "\n" not in str(error.value)
