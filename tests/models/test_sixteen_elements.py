"""The made-up material obeys what every isotropic, mirror-symmetric and reciprocal surface must."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pbrdf.formats.pbsdf import read_pbsdf
from pbrdf.formats.table_data import TableData
from pbrdf.models.sixteen_elements import write_sixteen_elements
from pbrdf.reconstruction.physicality import is_physical


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> TableData:
    path: Path = tmp_path_factory.mktemp("sixteen") / "sixteen.pbsdf"
    write_sixteen_elements(path)
    return read_pbsdf(path)


def test_it_is_mirror_symmetric(table: TableData) -> None:
    q = np.diag([1.0, 1.0, -1.0, -1.0])
    inner = table.mueller[2, :, 1:]
    np.testing.assert_allclose(inner[:, :, ::-1], q @ inner @ q, atol=2e-6)


def test_it_is_reciprocal(table: TableData) -> None:
    p = np.diag([1.0, 1.0, -1.0, 1.0])
    inner = table.mueller[2, :, 1:, :-1]
    half = inner.shape[2] // 2
    turned = np.roll(inner, half, axis=2)
    np.testing.assert_allclose(turned, p @ np.swapaxes(inner, -1, -2) @ p, atol=2e-6)


def test_phi_d_means_nothing_at_the_normal(table: TableData) -> None:
    found = table.mueller[:, 0, :40]
    np.testing.assert_allclose(found, np.broadcast_to(found[:, :, :1], found.shape), rtol=1e-4, atol=1e-6)


def test_its_matrices_are_physical(table: TableData) -> None:
    inner = table.mueller[:, ::5, 1:-8:5, ::10].reshape(-1, 4, 4)
    lit = inner[inner[:, 0, 0] > 0].astype(np.float64)
    assert is_physical(lit).mean() > 0.99


def test_every_element_is_there(table: TableData) -> None:
    around = table.mueller[2, 20, 20]
    assert (np.abs(around).max(axis=0) > 0.008 * around[:, 0, 0].min()).all()
