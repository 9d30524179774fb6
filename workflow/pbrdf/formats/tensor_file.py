"""Mitsuba's ``tensor_file`` container, version 1.0: named arrays in one binary file.

Little-endian: ``tensor_file`` and a NUL, u8 major, u8 minor, u32 number of fields; then for each field u16
length of the name, the name in UTF-8, u16 number of dimensions, u8 data type, u64 offset of the
data from the start of the file, u64 for each dimension. Data lie in C order, each field at a
multiple of 8 bytes (Mitsuba 3, ``TensorFile``).
"""

from __future__ import annotations

import errno
import math
import os
import struct
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from pbrdf._kernels import items
from pbrdf.errors import InputError
from pbrdf.formats.beside import replace_file

_MAGIC = b"tensor_file\0"
_VERSION = (1, 0)
_PREAMBLE = struct.Struct("<12sBBI")
_FIELD = struct.Struct("<HBQ")
_DTYPES: dict[int, np.dtype[Any]] = {
    1: np.dtype("<u1"),
    2: np.dtype("<i1"),
    3: np.dtype("<u2"),
    4: np.dtype("<i2"),
    5: np.dtype("<u4"),
    6: np.dtype("<i4"),
    7: np.dtype("<u8"),
    8: np.dtype("<i8"),
    9: np.dtype("<f2"),
    10: np.dtype("<f4"),
    11: np.dtype("<f8"),
}
_CODES: dict[np.dtype[Any], int] = {dtype: code for code, dtype in _DTYPES.items()}
_ALIGNMENT = 8
_MAX_DIMENSIONS = 32
_LARGEST_ARRAY = 2**63 - 1
_BLOCK_BYTES = 48 << 20

_FETCH_AGAIN = "fetch or write the file again"


def read_tensor_file(path: str | Path) -> dict[str, NDArray[Any]]:
    """Map every field of a tensor file.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    dict of str to ndarray
        Read-only views of the mapped file in the order of its header; no data are read, and
        nothing is allocated that the file does not hold.

    Raises
    ------
    InputError
        If the file cannot be opened, is cut short, or says of itself what cannot be true.
    """
    try:
        content = (
            np.memmap(path, dtype=np.uint8, mode="r") if Path(path).stat().st_size else np.empty(0, "u1")
        )
    except OSError as error:
        raise InputError(path, "file", error.strerror or str(error), "check the path") from error
    header = _Header(path, content)
    magic, *version, number = header.take(_PREAMBLE, "header")
    if magic != _MAGIC:
        raise InputError(
            path, "header", "does not begin with 'tensor_file'", "give a .pbsdf or other tensor file"
        )
    if tuple(version) != _VERSION:
        found = ".".join(map(str, version))
        raise InputError(path, "header", f"has version {found}", "write the file as tensor_file 1.0")
    entries: dict[str, _Entry] = {}
    for index in range(number):
        name, entry = header.take_entry(f"field {index + 1} of {number}")
        if name in entries:
            raise InputError(path, name, "is there twice", _FETCH_AGAIN)
        entries[name] = entry
    _check_extents(path, entries, header.position, content.size)
    return {name: _view(content, entry) for name, entry in entries.items()}


def write_tensor_file(path: str | Path, fields: Mapping[str, NDArray[Any]]) -> None:
    """Write named arrays as a tensor file, beside the target and then renamed over it.

    Arrays of any stride are written in blocks: no second whole copy of them is made.

    Parameters
    ----------
    path : str or Path
    fields : mapping of str to ndarray
        Integers, unsigned integers and floats of any byte order and stride.

    Raises
    ------
    InputError
        If a field has a type or name that the format has no place for, or the disk refuses.
    """
    target = Path(path)
    header, offsets = _header_bytes(target, fields)
    with replace_file(target) as beside, beside.open("wb") as file, ThreadPoolExecutor(1) as background:
        _reserve(file, offsets[-1] + list(fields.values())[-1].nbytes if fields else len(header))
        file.write(header)
        for (name, array), offset in zip(fields.items(), offsets, strict=True):
            file.write(bytes(offset - file.tell()))
            written = background.submit(int)
            # one block goes to the disk while the next is put in order
            for block in _blocks(array, _little_endian(target, name, array)):
                written.result()
                written = background.submit(file.write, block.data)
            written.result()


@dataclass(frozen=True)
class _Entry:
    """What the header says of one field."""

    dtype: np.dtype[Any]
    offset: int
    shape: tuple[int, ...]


class _Header:
    """A cursor over the header that refuses to run past the end of the file."""

    def __init__(self, path: str | Path, content: NDArray[np.uint8]) -> None:
        self.path = path
        self.content = content
        self.position = 0

    def take(self, layout: struct.Struct, what: str) -> tuple[Any, ...]:
        return layout.unpack(self._bytes(layout.size, what))

    def take_entry(self, what: str) -> tuple[str, _Entry]:
        (length,) = self.take(struct.Struct("<H"), what)
        try:
            name = self._bytes(length, what).decode("utf-8")
        except UnicodeDecodeError as error:
            raise InputError(self.path, what, "has a name that is not UTF-8", _FETCH_AGAIN) from error
        if not name or "\0" in name:
            raise InputError(self.path, what, f"has the name {name!r}", _FETCH_AGAIN)
        dimensions, code, offset = self.take(_FIELD, name)
        if code not in _DTYPES:
            raise InputError(self.path, name, f"has the unknown data type {code}", _FETCH_AGAIN)
        if dimensions > _MAX_DIMENSIONS:
            raise InputError(self.path, name, f"claims {dimensions} dimensions", _FETCH_AGAIN)
        shape = self.take(struct.Struct(f"<{dimensions}Q"), name)
        return name, _Entry(_DTYPES[code], offset, shape)

    def _bytes(self, count: int, what: str) -> bytes:
        end = self.position + count
        if end > self.content.size:
            problem = f"the file ends at byte {self.content.size}, inside the header"
            raise InputError(self.path, what, problem, _FETCH_AGAIN)
        taken = self.content[self.position : end].tobytes()
        self.position = end
        return taken


def _check_extents(path: str | Path, entries: Mapping[str, _Entry], header_end: int, size: int) -> None:
    """Refuse fields that lie outside the data part of the file or on top of one another."""
    spans: list[tuple[int, int, str]] = []
    for name, entry in entries.items():
        # NumPy multiplies the non-zero dimensions of an empty array too
        if math.prod(filter(None, entry.shape)) * entry.dtype.itemsize > _LARGEST_ARRAY:
            raise InputError(path, name, f"claims the shape {entry.shape}", _FETCH_AGAIN)
        end = entry.offset + math.prod(entry.shape) * entry.dtype.itemsize
        if end == entry.offset:
            continue
        if entry.offset < header_end or end > size:
            problem = f"claims bytes {entry.offset} to {end} of a file of {size}"
            raise InputError(path, name, problem, f"the file is cut short or damaged: {_FETCH_AGAIN}")
        spans.append((entry.offset, end, name))
    spans.sort()
    for (_, end, before), (start, _, name) in pairwise(spans):
        if start < end:
            raise InputError(path, name, f"lies on top of {before!r}", _FETCH_AGAIN)


def _view(content: NDArray[np.uint8], entry: _Entry) -> NDArray[Any]:
    """Read-only array over its part of the file; the offset of an empty one means nothing."""
    offset = entry.offset if math.prod(entry.shape) else 0
    return np.ndarray(entry.shape, entry.dtype, buffer=content, offset=offset)


def _header_bytes(path: Path, fields: Mapping[str, NDArray[Any]]) -> tuple[bytes, list[int]]:
    """Header of a file with these fields, and the offset of each field's data."""
    names = [name.encode("utf-8") for name in fields]
    for name, encoded in zip(fields, names, strict=True):
        if not encoded or b"\0" in encoded or len(encoded) > 0xFFFF:
            raise InputError(path, repr(name), "is no name for a field", "give it a short name without NUL")
    length = _PREAMBLE.size + sum(
        2 + len(encoded) + _FIELD.size + 8 * array.ndim
        for encoded, array in zip(names, fields.values(), strict=True)
    )
    parts = [_PREAMBLE.pack(_MAGIC, *_VERSION, len(fields))]
    offsets: list[int] = []
    end = length
    for (name, array), encoded in zip(fields.items(), names, strict=True):
        offset = -(-end // _ALIGNMENT) * _ALIGNMENT
        code = _CODES[_little_endian(path, name, array)]
        parts.append(struct.pack("<H", len(encoded)) + encoded)
        parts.append(_FIELD.pack(array.ndim, code, offset) + struct.pack(f"<{array.ndim}Q", *array.shape))
        offsets.append(offset)
        end = offset + array.nbytes
    return b"".join(parts), offsets


def _little_endian(path: Path, name: str, array: NDArray[Any]) -> np.dtype[Any]:
    """Type in which an array is stored."""
    dtype = array.dtype.newbyteorder("<")
    if dtype not in _CODES:
        known = ", ".join(sorted(known.name for known in _CODES))
        raise InputError(path, name, f"has the type {array.dtype}", f"convert it to one of {known}")
    return dtype


def _reserve(file: BinaryIO, length: int) -> None:
    """Allot the room of a file before it is written, which is several times faster than bit by bit."""
    try:
        os.posix_fallocate(file.fileno(), 0, length)
    except OSError as error:
        if error.errno not in (errno.EOPNOTSUPP, errno.EINVAL):
            raise


def _blocks(array: NDArray[Any], dtype: np.dtype[Any]) -> Iterator[NDArray[Any]]:
    """Cut the array along its first axis into pieces of 48 MiB in C order, gone with the next but one."""
    if array.ndim == 0 or array.size == 0:
        yield np.ascontiguousarray(array, dtype=dtype)
        return
    rows = max(1, _BLOCK_BYTES * array.shape[0] // array.nbytes)
    turns = np.empty((2, min(rows, array.shape[0]), *array.shape[1:]), dtype) if _of_matrices(array) else None
    for turn, start in enumerate(range(0, array.shape[0], rows)):
        block = array[start : start + rows]
        if turns is None:
            yield np.ascontiguousarray(block, dtype=dtype)
        else:
            scratch = turns[turn % 2, : len(block)]
            items.gather(block, scratch)
            yield scratch


def _of_matrices(array: NDArray[Any]) -> bool:
    """Whether only the order of whole 4×4 matrices has to change, which NumPy does ten times slower."""
    pieces = array.ndim == 6 and array.shape[-2:] == (4, 4) and array.strides[-2:] == (16, 4)
    return pieces and array.dtype == np.dtype("<f4") and not array.flags.c_contiguous
