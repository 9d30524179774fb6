"""Pictures by band come back as they were written, and what is no such file is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pbrdf.errors import InputError
from pbrdf.formats.band_exr import read_band, write_bands
from pbrdf.formats.exr_file import write_exr

PICTURES = {nm: np.random.default_rng(nm).normal(size=(5, 7)).astype(np.float32) for nm in (450, 650)}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "folder" / "flat.exr"
    write_bands(file, PICTURES, {"units": "relative response"})
    return file


def test_pictures_return_to_the_last_bit(path: Path) -> None:
    for nm, picture in PICTURES.items():
        np.testing.assert_array_equal(read_band(path, nm), picture)


def test_a_band_that_is_not_there_is_named_with_those_that_are(path: Path) -> None:
    with pytest.raises(InputError, match=r"550nm: is missing \(there: 450nm, 650nm\)"):
        read_band(path, 550)


def test_a_missing_file_and_another_kind_of_file_are_refused(path: Path) -> None:
    with pytest.raises(InputError, match="file: does not exist"):
        read_band(path.with_name("other.exr"), 450)
    path.write_bytes(b"no picture")
    with pytest.raises(InputError, match="file: is not an OpenEXR image"):
        read_band(path, 450)


def test_a_failing_write_leaves_what_was_there(path: Path) -> None:
    before = path.read_bytes()
    with pytest.raises(Exception, match=r"."):
        write_exr(path, {}, {"450nm": np.zeros(3, np.complex64)})
    assert path.read_bytes() == before
    assert [file.name for file in path.parent.iterdir()] == ["flat.exr"]
