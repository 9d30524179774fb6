"""Arrays of a MAT-file are those that SciPy reads, and nothing is believed that the file does not hold."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from pbrdf.formats.mat_file import MatDamage, mat_arrays

RNG = np.random.default_rng(2)
NUMBERS = {
    "doubles": RNG.normal(size=(3, 4, 5)),
    "singles": RNG.normal(size=(2, 7)).astype(np.float32),
    "words": np.arange(7, dtype=np.uint16),
    "small": np.array([[3]], np.int64),
    "bytes": np.arange(-3, 3, dtype=np.int8),
    "empty": np.zeros((0, 3)),
    "long": np.arange(2000, dtype=float),
}
OTHERS = {"flags": np.ones((3, 2), bool), "text": "a", "struct": {"x": 1}, "complex": np.array([1 + 2j])}


@pytest.fixture(params=[False, True], ids=["plain", "compressed"])
def path(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    scipy.io.savemat(tmp_path / "a.mat", NUMBERS | OTHERS, do_compression=request.param)
    return tmp_path / "a.mat"


def test_arrays_are_those_that_scipy_reads(path: Path) -> None:
    arrays = mat_arrays(path)
    theirs = scipy.io.loadmat(path)
    assert arrays.keys() == NUMBERS.keys()
    for name, array in arrays.items():
        read = array.read()
        assert read.dtype == theirs[name].dtype
        assert array.shape == theirs[name].shape
        np.testing.assert_array_equal(read, theirs[name])


def test_whole_numbers_saved_in_fewer_bytes_keep_their_class(tmp_path: Path) -> None:
    matrix = (
        struct.pack("<4I", 6, 8, 6, 0) + struct.pack("<2I2i", 5, 8, 1, 2) + struct.pack("<2H4s", 1, 1, b"x")
    )
    matrix += struct.pack("<2H4B", 2, 2, 7, 9, 0, 0)
    header = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H2s", 0x0100, b"IM")
    (tmp_path / "a.mat").write_bytes(header + struct.pack("<2I", 14, len(matrix)) + matrix)
    read = mat_arrays(tmp_path / "a.mat")["x"].read()
    assert read.dtype == np.float64
    np.testing.assert_array_equal(read, [[7, 9]])


def test_the_other_byte_order_is_read(tmp_path: Path) -> None:
    values = struct.pack(">2I2d", 9, 16, 1.5, -2.0)
    matrix = (
        struct.pack(">4I", 6, 8, 6, 0) + struct.pack(">2I2i", 5, 8, 2, 1) + struct.pack(">2I8s", 1, 1, b"y")
    )
    header = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack(">H2s", 0x0100, b"MI")
    body = matrix + values
    (tmp_path / "a.mat").write_bytes(header + struct.pack(">2I", 14, len(body)) + body)
    np.testing.assert_array_equal(mat_arrays(tmp_path / "a.mat")["y"].read(), [[1.5], [-2.0]])


def test_a_file_cut_short_is_refused(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-9])
    with pytest.raises(MatDamage, match=r"claims|cut short"):
        mat_arrays(path)


def test_a_flipped_bit_in_compressed_values_is_noticed(tmp_path: Path) -> None:
    scipy.io.savemat(tmp_path / "a.mat", {"a": NUMBERS["long"]}, do_compression=True)
    content = bytearray((tmp_path / "a.mat").read_bytes())
    content[-300] ^= 1
    (tmp_path / "a.mat").write_bytes(content)
    with pytest.raises(MatDamage, match=r"damaged|not as long"):
        mat_arrays(tmp_path / "a.mat")["a"].read()


def test_hdf5_and_strangers_are_told_apart(tmp_path: Path) -> None:
    (tmp_path / "a.mat").write_bytes(b"MATLAB 7.3 MAT-file".ljust(512))
    with pytest.raises(NotImplementedError):
        mat_arrays(tmp_path / "a.mat")
    (tmp_path / "a.mat").write_bytes(b"something else".ljust(512))
    with pytest.raises(MatDamage, match="no header"):
        mat_arrays(tmp_path / "a.mat")
