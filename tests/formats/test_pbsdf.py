from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike

from pbrdf.errors import InputError
from pbrdf.formats.pbsdf import ANGLE_AXES, read_pbsdf, write_pbsdf
from pbrdf.formats.table_data import TableData
from pbrdf.formats.tensor_file import read_tensor_file, write_tensor_file


def small_table(bands: int = 5) -> TableData:
    rng = np.random.default_rng(2)
    mueller = rng.normal(size=(bands, 4, 3, 7, 4, 4)).astype(np.float32)
    mueller[:, 3, 2, 1] = np.nan
    return TableData(
        source="small",
        wavelengths_nm=450.0 + 50.0 * np.arange(bands),
        theta_h=(np.arange(4) / 3) ** 2 * np.pi / 2,
        theta_d=np.linspace(0, np.pi / 2, 3),
        phi_d=np.linspace(-np.pi, np.pi, 7),
        mueller=mueller,
    )


def fields_of(table: TableData, **changed: np.ndarray) -> dict[str, np.ndarray]:
    """Fields of a file, written out here independently of the writer under test."""
    axes = {name: getattr(table, name).astype(np.float32)[None] for name in ANGLE_AXES}
    matrices = np.einsum("bhdpij->pdhbij", table.mueller)
    return {**axes, "wvls": table.wavelengths_nm.astype("u2"), "M": matrices, **changed}


def empty(table: TableData, name: str) -> np.ndarray:
    return np.empty((0, getattr(table, name).size), np.float32)


def test_a_table_returns_as_it_was_written(tmp_path: Path) -> None:
    table = small_table()
    write_pbsdf(tmp_path / "a.pbsdf", table)
    read = read_pbsdf(tmp_path / "a.pbsdf")
    assert np.array_equal(read.wavelengths_nm, table.wavelengths_nm)
    for name in ANGLE_AXES:
        assert np.array_equal(getattr(read, name), getattr(table, name).astype(np.float32))
    assert np.array_equal(read.mueller, table.mueller, equal_nan=True)


def test_fields_are_laid_out_as_mitsuba_wants_them(tmp_path: Path) -> None:
    table = small_table()
    write_pbsdf(tmp_path / "a.pbsdf", table)
    stored = read_tensor_file(tmp_path / "a.pbsdf")
    for name, expected in fields_of(table).items():
        assert stored[name].dtype == expected.dtype
        assert np.array_equal(stored[name], expected, equal_nan=True)


@pytest.mark.parametrize("bands", [1, 4, 68])
def test_any_number_of_wavelengths_is_read_but_only_five_are_written(tmp_path: Path, bands: int) -> None:
    table = small_table(bands)
    write_tensor_file(tmp_path / "a.pbsdf", fields_of(table))
    assert read_pbsdf(tmp_path / "a.pbsdf").wavelengths_nm.size == bands
    with pytest.raises(InputError, match=r"select 5 bands, or split"):
        write_pbsdf(tmp_path / "b.pbsdf", table)
    assert not (tmp_path / "b.pbsdf").exists()


@pytest.mark.parametrize("first", [450.5, -1.0, 1e9])
def test_wavelengths_that_are_no_small_whole_number_are_not_written(tmp_path: Path, first: float) -> None:
    table = small_table()
    shifted = replace(table, wavelengths_nm=np.array([first, *first + np.arange(1.0, 5.0)]))
    with pytest.raises(InputError, match="whole"):
        write_pbsdf(tmp_path / "a.pbsdf", shifted)


def test_an_empty_axis_is_refused_and_the_remedy_is_a_file_of_axes(tmp_path: Path) -> None:
    table = small_table()
    write_tensor_file(tmp_path / "a.pbsdf", fields_of(table, theta_d=empty(table, "theta_d")))
    with pytest.raises(InputError) as caught:
        read_pbsdf(tmp_path / "a.pbsdf")
    assert caught.value.field == "theta_d"
    assert "`details`" in caught.value.remedy
    assert "--axes" in caught.value.remedy


def test_given_axes_repair_empty_ones(tmp_path: Path) -> None:
    table = small_table()
    hollow = {name: empty(table, name) for name in ANGLE_AXES}
    write_tensor_file(tmp_path / "a.pbsdf", fields_of(table, **hollow))
    axes: dict[str, ArrayLike] = {name: getattr(table, name).tolist() for name in ANGLE_AXES}
    read = read_pbsdf(tmp_path / "a.pbsdf", axes)
    for name in ANGLE_AXES:
        assert np.array_equal(getattr(read, name), getattr(table, name))
    assert np.array_equal(read.mueller, table.mueller, equal_nan=True)


def test_given_axes_of_the_wrong_length_do_not_repair(tmp_path: Path) -> None:
    table = small_table()
    write_tensor_file(tmp_path / "a.pbsdf", fields_of(table, theta_d=empty(table, "theta_d")))
    with pytest.raises(InputError, match="its axes say"):
        read_pbsdf(tmp_path / "a.pbsdf", {"theta_d": [0.0, 1.0]})


def test_given_axes_may_repeat_the_file_but_not_contradict_it(tmp_path: Path) -> None:
    table = small_table()
    write_pbsdf(tmp_path / "a.pbsdf", table)
    read_pbsdf(tmp_path / "a.pbsdf", {"theta_h": table.theta_h})
    for other in (table.theta_h + 1e-4, table.theta_h[:-1]):
        with pytest.raises(InputError, match="differs from the axis given"):
            read_pbsdf(tmp_path / "a.pbsdf", {"theta_h": other})


@pytest.mark.parametrize("axes", [{"theta_x": [0.0]}, {"theta_h": ["a"]}, {"theta_h": [[0.0], [0.0, 1.0]]}])
def test_axes_that_make_no_sense_are_refused(tmp_path: Path, axes: dict[str, ArrayLike]) -> None:
    write_pbsdf(tmp_path / "a.pbsdf", small_table())
    with pytest.raises(InputError) as caught:
        read_pbsdf(tmp_path / "a.pbsdf", axes)
    assert caught.value.field == "axes"


@pytest.mark.parametrize(
    ("name", "spoil"),
    [
        ("theta_h", lambda axis: axis[:, ::-1]),
        ("theta_d", lambda axis: np.degrees(axis)),
        ("phi_d", lambda axis: axis * np.nan),
        ("phi_d", lambda axis: axis[:, :-1]),
        ("theta_h", lambda axis: np.concatenate([axis, axis])),
        ("wvls", lambda axis: axis[::-1]),
        ("M", lambda matrices: matrices[..., :3, :]),
        ("M", lambda matrices: matrices.astype("f8")),
        ("M", lambda matrices: np.where(matrices > 2, np.inf, matrices).astype("f4")),
    ],
)
def test_fields_that_are_no_table_are_refused_by_name(tmp_path: Path, name: str, spoil: object) -> None:
    fields = fields_of(small_table())
    assert callable(spoil)
    write_tensor_file(tmp_path / "a.pbsdf", {**fields, name: spoil(fields[name])})
    with pytest.raises(InputError) as caught:
        read_pbsdf(tmp_path / "a.pbsdf")
    assert caught.value.field in {name, "M", "wavelengths_nm"}
    assert caught.value.source.endswith("a.pbsdf")


def test_a_missing_field_is_named(tmp_path: Path) -> None:
    fields = fields_of(small_table())
    del fields["wvls"]
    write_tensor_file(tmp_path / "a.pbsdf", fields)
    with pytest.raises(InputError, match="wvls"):
        read_pbsdf(tmp_path / "a.pbsdf")
