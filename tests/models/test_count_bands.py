"""How many bands a table has, before it is opened."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pbrdf.formats.table_data import TableData
from pbrdf.formats.table_zarr import write_table
from pbrdf.formats.tensor_file import write_tensor_file
from pbrdf.models.table import count_bands
from pbrdf.tabulation.axes import table_axes


@pytest.mark.parametrize("bands", [1, 5, 68])
def test_bands_are_counted_without_reading_the_table(tmp_path: Path, bands: int) -> None:
    axes = table_axes(2, 2, 3)
    nm = 400.0 + 5 * np.arange(bands)
    mueller = np.ones((bands, *axes.shape, 4, 4), np.float32)
    write_table(tmp_path / "t.zarr", TableData("t", nm, axes.theta_h, axes.theta_d, axes.phi_d, mueller), {})
    write_tensor_file(tmp_path / "t.pbsdf", {"wvls": nm.astype(np.uint16)})
    assert count_bands(tmp_path / "t.zarr") == bands
    assert count_bands(tmp_path / "t.pbsdf") == bands


@pytest.mark.parametrize("name", ["absent.zarr", "absent.pbsdf", "gold.mat", "broken.pbsdf"])
def test_what_cannot_be_read_is_left_to_its_reader(tmp_path: Path, name: str) -> None:
    (tmp_path / "broken.pbsdf").write_bytes(b"tensor")
    assert count_bands(tmp_path / name) == 5
