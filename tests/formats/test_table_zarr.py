from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from pbrdf.errors import InputError
from pbrdf.formats.table_data import Origin, TableData
from pbrdf.formats.table_zarr import read_table, write_table

ARRAYS = ("mueller", "variance", "count", "origin")
AXES = ("wavelengths_nm", "theta_h", "theta_d", "phi_d")


@pytest.fixture
def table() -> TableData:
    rng = np.random.default_rng(4)
    grid = (2, 4, 3, 7)
    mueller = rng.normal(size=(*grid, 4, 4)).astype(np.float32)
    mueller[:, :, 1] = np.nan
    return TableData(
        source="small",
        wavelengths_nm=np.array([450.0, 532.5]),
        theta_h=(np.arange(4) / 3) ** 2 * np.pi / 2,
        theta_d=np.linspace(0, np.pi / 2, 3),
        phi_d=np.linspace(-np.pi, np.pi, 7),
        mueller=mueller,
        variance=(mueller**2).astype(np.float32),
        count=rng.integers(0, 60000, grid).astype(np.uint16),
        origin=rng.integers(0, len(Origin), grid).astype(np.uint8),
    )


def content(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_a_table_returns_as_it_was_written(tmp_path: Path, table: TableData) -> None:
    write_table(tmp_path / "t.zarr", table, {})
    read = read_table(tmp_path / "t.zarr")
    assert read.source == str(tmp_path / "t.zarr")
    for name in AXES:
        assert np.array_equal(getattr(read, name), getattr(table, name))
    for name in ARRAYS:
        assert getattr(read, name).dtype == getattr(table, name).dtype
        assert np.array_equal(getattr(read, name), getattr(table, name), equal_nan=name in ARRAYS[:2])


def test_what_a_table_does_not_know_stays_unknown(tmp_path: Path, table: TableData) -> None:
    write_table(tmp_path / "t.zarr", replace(table, variance=None, count=None, origin=None), {})
    read = read_table(tmp_path / "t.zarr")
    assert (read.variance, read.count, read.origin) == (None, None, None)


def test_xarray_opens_it_with_coordinates_units_and_frames(tmp_path: Path, table: TableData) -> None:
    write_table(tmp_path / "t.zarr", table, {"material": "gold", "lights": [1, 2]})
    with xr.open_zarr(tmp_path / "t.zarr", consolidated=False) as opened:
        assert opened.attrs["schema"] == "pbrdf/table/1"
        assert opened.attrs["material"] == "gold"
        assert opened.attrs["lights"] == [1, 2]
        assert "norm(L x V)" in opened.attrs["frames"]
        assert opened["mueller"].dims == ("wavelength", "theta_h", "theta_d", "phi_d", "row", "col")
        assert opened["mueller"].attrs["units"] == "sr-1"
        assert {name: opened[name].attrs["units"] for name in opened.coords} == {
            "wavelength": "nm",
            "theta_h": "rad",
            "theta_d": "rad",
            "phi_d": "rad",
        }
        node = opened["mueller"].sel(wavelength=532.5, theta_d=np.pi / 2).isel(theta_h=1, phi_d=2)
        assert np.array_equal(node, table.mueller[1, 1, 2, 2])
        assert table.count is not None
        assert opened["count"].dtype == np.uint16
        assert np.array_equal(opened["count"], table.count)
        assert opened["origin"].attrs["flag_meanings"].split()[Origin.INPAINTED] == "inpainted"


def test_a_slab_of_one_band_and_difference_angle_is_one_chunk(tmp_path: Path, table: TableData) -> None:
    write_table(tmp_path / "t.zarr", table, {})
    chunks = [p for p in (tmp_path / "t.zarr" / "mueller" / "c").rglob("*") if p.is_file()]
    assert len(chunks) == 2 * 3


def test_same_table_gives_same_bytes(tmp_path: Path, table: TableData) -> None:
    write_table(tmp_path / "a.zarr", table, {"material": "gold"})
    write_table(tmp_path / "b.zarr", table, {"material": "gold"})
    assert content(tmp_path / "a.zarr") == content(tmp_path / "b.zarr")


def test_a_transposed_table_gives_the_bytes_of_a_contiguous_one(tmp_path: Path, table: TableData) -> None:
    turned = np.ascontiguousarray(table.mueller.transpose(3, 2, 1, 0, 4, 5)).transpose(3, 2, 1, 0, 4, 5)
    write_table(tmp_path / "a.zarr", table, {})
    write_table(tmp_path / "b.zarr", replace(table, mueller=turned), {})
    assert content(tmp_path / "a.zarr") == content(tmp_path / "b.zarr")


def test_an_old_table_is_replaced_whole(tmp_path: Path, table: TableData) -> None:
    write_table(tmp_path / "t.zarr", table, {})
    smaller = replace(table, variance=None, count=None, origin=None)
    write_table(tmp_path / "t.zarr", smaller, {})
    assert read_table(tmp_path / "t.zarr").variance is None
    assert list(tmp_path.iterdir()) == [tmp_path / "t.zarr"]


@pytest.mark.parametrize("failing", [1, 2])
def test_a_failing_write_leaves_the_old_table_and_no_other(
    tmp_path: Path, table: TableData, monkeypatch: pytest.MonkeyPatch, failing: int
) -> None:
    write_table(tmp_path / "t.zarr", table, {})
    before = content(tmp_path / "t.zarr")
    rename, calls = Path.rename, []

    def breaks(self: Path, target: Path) -> Path:
        calls.append(target)
        if len(calls) == failing:
            raise OSError(5, "Input/output error")
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", breaks)
    with pytest.raises(InputError, match="Input/output error"):
        write_table(tmp_path / "t.zarr", replace(table, variance=None), {})
    assert content(tmp_path / "t.zarr") == before
    assert list(tmp_path.iterdir()) == [tmp_path / "t.zarr"]


def test_attributes_of_the_schema_cannot_be_replaced(tmp_path: Path, table: TableData) -> None:
    with pytest.raises(InputError, match="frames"):
        write_table(tmp_path / "t.zarr", table, {"frames": "mine"})


@pytest.mark.parametrize("array", ARRAYS)
def test_a_flipped_bit_in_a_chunk_is_refused_by_array(tmp_path: Path, table: TableData, array: str) -> None:
    write_table(tmp_path / "t.zarr", table, {})
    chunk = next(p for p in sorted((tmp_path / "t.zarr" / array / "c").rglob("*")) if p.is_file())
    spoilt = bytearray(chunk.read_bytes())
    spoilt[len(spoilt) // 2] ^= 1
    chunk.write_bytes(spoilt)
    with pytest.raises(InputError) as caught:
        read_table(tmp_path / "t.zarr")
    assert (caught.value.source, caught.value.field) == (str(tmp_path / "t.zarr"), array)


@pytest.mark.parametrize("array", [*ARRAYS, "theta_h"])
def test_short_and_lost_chunks_are_refused_by_array(tmp_path: Path, table: TableData, array: str) -> None:
    write_table(tmp_path / "t.zarr", table, {})
    chunk = next(p for p in sorted((tmp_path / "t.zarr" / array / "c").rglob("*")) if p.is_file())
    chunk.write_bytes(chunk.read_bytes()[:3])
    with pytest.raises(InputError, match=f"{array}: is damaged"):
        read_table(tmp_path / "t.zarr")
    chunk.unlink()
    with pytest.raises(InputError, match=f"{array}: has lost 1 of"):
        read_table(tmp_path / "t.zarr")


@pytest.mark.parametrize(
    ("file", "key", "value", "field"),
    [
        ("zarr.json", "attributes", {"schema": "pbrdf/slice/1"}, "schema"),
        ("zarr.json", "attributes", {}, "schema"),
        ("zarr.json", "zarr_format", 9, "zarr.json"),
        ("mueller/zarr.json", "shape", [2, 4, 3, 8, 4, 4], "mueller"),
        ("mueller/zarr.json", "shape", [2, 4, 3, 7, 4, 2**60], "mueller"),
        ("mueller/zarr.json", "data_type", "float64", "mueller"),
        ("mueller/zarr.json", "codecs", [], "mueller"),
        ("count/zarr.json", "data_type", "int16", "count"),
        ("theta_h/zarr.json", "shape", [2**62], "theta_h"),
        ("theta_h/zarr.json", "shape", [2, 2], "theta_h"),
    ],
)
def test_metadata_that_lie_are_refused_by_array(
    tmp_path: Path, table: TableData, file: str, key: str, value: object, field: str
) -> None:
    write_table(tmp_path / "t.zarr", table, {})
    path = tmp_path / "t.zarr" / file
    path.write_text(json.dumps({**json.loads(path.read_text()), key: value}))
    with pytest.raises(InputError) as caught:
        read_table(tmp_path / "t.zarr")
    assert caught.value.field == field


@pytest.mark.parametrize("file", ["zarr.json", "theta_d/zarr.json", "mueller/zarr.json", "count/zarr.json"])
def test_metadata_that_are_no_json_are_refused(tmp_path: Path, table: TableData, file: str) -> None:
    write_table(tmp_path / "t.zarr", table, {})
    (tmp_path / "t.zarr" / file).write_text("{")
    with pytest.raises(InputError):
        read_table(tmp_path / "t.zarr")


def test_missing_tables_and_arrays_are_refused(tmp_path: Path, table: TableData) -> None:
    with pytest.raises(InputError):
        read_table(tmp_path / "absent.zarr")
    write_table(tmp_path / "t.zarr", table, {})
    (tmp_path / "t.zarr" / "mueller").rename(tmp_path / "elsewhere")
    with pytest.raises(InputError, match="mueller"):
        read_table(tmp_path / "t.zarr")


@pytest.mark.parametrize("spoil", ["infinite", "descending"])
def test_values_that_are_no_table_are_refused(tmp_path: Path, table: TableData, spoil: str) -> None:
    if spoil == "infinite":
        table.mueller[0, 0, 0, 0, 0, 0] = np.inf
    else:
        table.theta_d[:] = table.theta_d[::-1].copy()
    write_table(tmp_path / "t.zarr", table, {})
    with pytest.raises(InputError, match=r"mueller|theta_d"):
        read_table(tmp_path / "t.zarr")
