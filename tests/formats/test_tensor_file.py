from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from pbrdf.errors import InputError
from pbrdf.formats.tensor_file import read_tensor_file, write_tensor_file

EVERY_TYPE = ("u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f2", "f4", "f8")


def field(name: bytes, shape: tuple[int, ...], *, code: int = 10, offset: int = 0) -> bytes:
    head = struct.pack("<H", len(name)) + name
    return head + struct.pack("<HBQ", len(shape), code, offset) + struct.pack(f"<{len(shape)}Q", *shape)


def container(*fields: bytes, number: int | None = None, data: bytes = b"") -> bytes:
    count = len(fields) if number is None else number
    return struct.pack("<12sBBI", b"tensor_file\0", 1, 0, count) + b"".join(fields) + data


def refusal(path: Path, content: bytes) -> InputError:
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        read_tensor_file(path)
    assert caught.value.source == str(path)
    assert caught.value.remedy
    return caught.value


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("tensor") / "sound.bin"
    fields = {
        "empty": np.empty((0, 9), "f4"),
        "axis": np.arange(3, dtype="u2"),
        "M": np.arange(24, dtype="f4").reshape(2, 3, 4),
    }
    write_tensor_file(path, fields)
    return path.read_bytes()


def test_every_type_returns_as_it_was_written(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    fields = {kind: rng.integers(0, 100, (3, 5)).astype(kind) for kind in EVERY_TYPE}
    write_tensor_file(tmp_path / "all.bin", fields)
    read = read_tensor_file(tmp_path / "all.bin")
    assert list(read) == list(fields)
    for name, values in fields.items():
        assert read[name].dtype == values.dtype
        assert np.array_equal(read[name], values)


def test_scalars_empty_and_transposed_arrays_return_as_they_were_written(tmp_path: Path) -> None:
    fields = {
        "scalar": np.float32(2.5) + np.zeros((), "f4"),
        "empty": np.empty((0, 7), "f8"),
        "turned": np.arange(60, dtype=">f8").reshape(3, 4, 5).transpose(2, 0, 1),
    }
    write_tensor_file(tmp_path / "a.bin", fields)
    read = read_tensor_file(tmp_path / "a.bin")
    for name, values in fields.items():
        assert read[name].shape == values.shape
        assert np.array_equal(read[name], values)


def test_arrays_larger_than_a_block_are_written_in_order(tmp_path: Path) -> None:
    large = np.arange(9 << 20, dtype=np.float32).reshape(4, -1, 16).transpose(1, 0, 2)
    write_tensor_file(tmp_path / "a.bin", {"large": large})
    assert np.array_equal(read_tensor_file(tmp_path / "a.bin")["large"], large)


def test_same_arrays_give_same_bytes_laid_out_as_the_format_says(tmp_path: Path) -> None:
    write_tensor_file(tmp_path / "a.bin", {"n": np.array([1, 2], "u2"), "x": np.array([0.5], "f4")})
    # preamble 18, each entry 2 + 1 + 11 + 8 = 22: data from 62, hence at 64 and 72
    header = container(field(b"n", (2,), code=3, offset=64), field(b"x", (1,), code=10, offset=72))
    data = b"\0\0" + struct.pack("<2H4x", 1, 2) + struct.pack("<f", 0.5)
    assert (tmp_path / "a.bin").read_bytes() == header + data


def test_fields_are_read_only_views_of_the_file(tmp_path: Path, sound: bytes) -> None:
    (tmp_path / "a.bin").write_bytes(sound)
    view = read_tensor_file(tmp_path / "a.bin")["M"]
    assert not view.flags.owndata
    assert not view.flags.writeable


def test_every_truncation_is_refused(tmp_path: Path, sound: bytes) -> None:
    for length in range(len(sound)):
        refusal(tmp_path / "cut.bin", sound[:length])


@pytest.mark.parametrize(
    ("content", "names"),
    [
        (b"", "header"),
        (b"x" * 40, "header"),
        (struct.pack("<12sBBI", b"tensor_file\0", 2, 0, 0), "header"),
        (container(number=2**32 - 1), "field 1"),
        (container(field(b"M", (2,), code=0)), "M"),
        (container(field(b"M", (2,), code=12)), "M"),
        (container(field(b"M", (1,) * 33)), "M"),
        (container(field(b"", (1,))), "field 1"),
        (container(field(b"a\0b", (1,))), "field 1"),
        (container(field(b"\xff\xfe", (1,))), "field 1"),
        (container(field(b"M", (4,), offset=41), data=bytes(16)), "M"),
        (container(field(b"M", (4,), offset=40), data=bytes(15)), "M"),
        (container(field(b"M", (4,), offset=39), data=bytes(16)), "M"),
        (container(field(b"M", (4,), offset=2**64 - 1), data=bytes(16)), "M"),
        # 2⁶⁴ bytes: the product overflows to 0 in 64 bits
        (container(field(b"M", (2**31, 2**31), offset=48), data=bytes(16)), "M"),
        (container(field(b"M", (0, 2**62), offset=48), data=bytes(16)), "M"),
        (container(field(b"M", (0,)), field(b"M", (0,))), "M"),
        (container(field(b"A", (2,), offset=62), field(b"B", (2,), offset=66), data=bytes(16)), "B"),
    ],
)
def test_a_header_that_lies_is_refused_by_field(tmp_path: Path, content: bytes, names: str) -> None:
    assert names in refusal(tmp_path / "lies.bin", content).field


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    flips=st.lists(st.tuples(st.integers(0, 10**6), st.integers(1, 255)), max_size=6),
    kept=st.one_of(st.none(), st.integers(0, 10**6)),
)
def test_damage_is_read_or_refused_and_nothing_else(
    tmp_path: Path, sound: bytes, flips: list[tuple[int, int]], kept: int | None
) -> None:
    content = bytearray(sound)
    for position, mask in flips:
        # half of the flips fall on the header, where they matter
        content[position % (120 if position % 2 else len(content))] ^= mask
    damaged = bytes(content if kept is None else content[: kept % (len(content) + 1)])
    path = tmp_path / "damaged.bin"
    path.write_bytes(damaged)
    try:
        fields = read_tensor_file(path)
    except InputError:
        return
    assert sum(values.nbytes for values in fields.values()) <= len(damaged)
    for values in fields.values():
        values.tobytes()


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(tail=st.binary(max_size=200), number=st.integers(0, 2**32 - 1))
def test_any_bytes_behind_the_preamble_are_read_or_refused(tmp_path: Path, tail: bytes, number: int) -> None:
    path = tmp_path / "random.bin"
    path.write_bytes(container(tail, number=number))
    try:
        read_tensor_file(path)
    except InputError as error:
        assert error.source == str(path)


def test_missing_files_and_folders_are_refused(tmp_path: Path) -> None:
    for path in (tmp_path / "absent.bin", tmp_path):
        with pytest.raises(InputError):
            read_tensor_file(path)


@pytest.mark.parametrize("fields", [{"b": np.array([True])}, {"": np.zeros(1)}, {"a\0": np.zeros(1)}])
def test_what_the_format_has_no_place_for_is_not_written(
    tmp_path: Path, fields: dict[str, np.ndarray]
) -> None:
    with pytest.raises(InputError):
        write_tensor_file(tmp_path / "a.bin", fields)
    assert list(tmp_path.iterdir()) == []


def test_a_failing_write_leaves_the_old_file_and_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.bin"
    write_tensor_file(path, {"x": np.zeros(2)})
    before = path.read_bytes()

    def full_disk(self: Path, target: Path) -> Path:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full_disk)
    with pytest.raises(InputError, match="No space left"):
        write_tensor_file(path, {"x": np.ones(2)})
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]
