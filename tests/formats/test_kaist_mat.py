from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.io

from pbrdf.errors import InputError
from pbrdf.formats.kaist_mat import read_kaist_mat
from pbrdf.formats.pbsdf import ANGLE_AXES, read_pbsdf, write_pbsdf
from pbrdf.formats.table_data import TableData


@pytest.fixture
def table() -> TableData:
    rng = np.random.default_rng(3)
    return TableData(
        source="small",
        wavelengths_nm=450.0 + 50.0 * np.arange(5),
        theta_h=(np.arange(4) / 3) ** 2 * np.pi / 2,
        theta_d=np.linspace(0, np.pi / 2, 3),
        phi_d=np.linspace(-np.pi, np.pi, 7),
        mueller=rng.normal(size=(5, 4, 3, 7, 4, 4)).astype(np.float32),
    )


def axes_of(table: TableData) -> dict[str, np.ndarray]:
    axes = {name: getattr(table, name).astype(np.float32)[None] for name in ANGLE_AXES}
    return {**axes, "wvls": table.wavelengths_nm.astype("u2")[None]}


def stored(table: TableData) -> np.ndarray:
    return np.einsum("bhdpij->pdhbij", table.mueller)


def assert_equal(one: TableData, other: TableData) -> None:
    for name in ("wavelengths_nm", *ANGLE_AXES):
        assert np.array_equal(getattr(one, name), getattr(other, name))
    assert np.array_equal(one.mueller, other.mueller, equal_nan=True)


@pytest.mark.parametrize("compressed", [False, True])
def test_both_published_forms_of_a_table_are_the_same_table(
    tmp_path: Path, table: TableData, compressed: bool
) -> None:
    write_pbsdf(tmp_path / "a.pbsdf", table)
    content = {**axes_of(table), "pbrdf_T_f": stored(table)}
    scipy.io.savemat(tmp_path / "a.mat", content, do_compression=compressed)
    assert_equal(read_kaist_mat(tmp_path / "a.mat"), read_pbsdf(tmp_path / "a.pbsdf"))


def test_axes_may_lie_in_a_file_of_their_own(tmp_path: Path, table: TableData) -> None:
    scipy.io.savemat(tmp_path / "whole.mat", {**axes_of(table), "pbrdf_T": stored(table)})
    scipy.io.savemat(tmp_path / "a.mat", {"pbrdf_T": stored(table)})
    scipy.io.savemat(tmp_path / "axes.mat", {**axes_of(table), "xyzi_T": np.zeros((2, 3))})
    read = read_kaist_mat(tmp_path / "a.mat", tmp_path / "axes.mat")
    assert_equal(read, read_kaist_mat(tmp_path / "whole.mat"))
    with pytest.raises(InputError, match="pbrdf_table_info"):
        read_kaist_mat(tmp_path / "a.mat")


def test_axes_of_two_files_must_agree(tmp_path: Path, table: TableData) -> None:
    axes = axes_of(table)
    scipy.io.savemat(tmp_path / "a.mat", {**axes, "pbrdf_T": stored(table)})
    scipy.io.savemat(tmp_path / "axes.mat", {**axes, "theta_d": axes["theta_d"] * 0.9})
    with pytest.raises(InputError, match=r"theta_d: differs"):
        read_kaist_mat(tmp_path / "a.mat", tmp_path / "axes.mat")


def test_filled_is_preferred_and_raw_can_be_asked_for(tmp_path: Path, table: TableData) -> None:
    raw = stored(table).copy()
    raw[2] = np.nan
    scipy.io.savemat(tmp_path / "a.mat", {**axes_of(table), "pbrdf_T": raw, "pbrdf_T_f": stored(table)})
    assert not np.isnan(read_kaist_mat(tmp_path / "a.mat").mueller).any()
    assert not np.isnan(read_kaist_mat(tmp_path / "a.mat", form="filled").mueller).any()
    assert np.isnan(read_kaist_mat(tmp_path / "a.mat", form="raw").mueller[..., 2, :, :]).all()


def test_a_form_asked_for_is_not_replaced_by_the_other(tmp_path: Path, table: TableData) -> None:
    scipy.io.savemat(tmp_path / "a.mat", {**axes_of(table), "pbrdf_T": stored(table)})
    read_kaist_mat(tmp_path / "a.mat")
    with pytest.raises(InputError, match=r"pbrdf_T_f: is not in the file, which holds .*pbrdf_T"):
        read_kaist_mat(tmp_path / "a.mat", form="filled")


def test_version_7_3_is_refused_with_the_way_to_save_it(tmp_path: Path) -> None:
    header = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    (tmp_path / "a.mat").write_bytes(header.ljust(512, b"\0") + b"\x89HDF\r\n\x1a\n" + bytes(512))
    with pytest.raises(InputError, match="-v7"):
        read_kaist_mat(tmp_path / "a.mat")


def test_damaged_and_missing_files_are_refused(tmp_path: Path, table: TableData) -> None:
    scipy.io.savemat(tmp_path / "a.mat", {**axes_of(table), "pbrdf_T": stored(table)}, do_compression=True)
    whole = (tmp_path / "a.mat").read_bytes()
    for length in (0, 3, 127, 150, len(whole) // 2, len(whole) - 1):
        (tmp_path / "cut.mat").write_bytes(whole[:length])
        with pytest.raises(InputError, match=r"cut\.mat"):
            read_kaist_mat(tmp_path / "cut.mat")
    with pytest.raises(InputError, match="No such file"):
        read_kaist_mat(tmp_path / "absent.mat")


@pytest.mark.parametrize("matrices", ["text", np.zeros((7, 3, 4, 5, 4, 4), "i4"), np.zeros((7, 3, 4, 5, 16))])
def test_variables_that_are_no_table_are_refused(tmp_path: Path, table: TableData, matrices: object) -> None:
    scipy.io.savemat(tmp_path / "a.mat", {**axes_of(table), "pbrdf_T": matrices})
    with pytest.raises(InputError, match=r"a\.mat"):
        read_kaist_mat(tmp_path / "a.mat")
