"""Numeric arrays of MATLAB's MAT-files, level 5 (versions 5 to 7), compressed or not.

A header of 128 bytes, of which the last four are version and byte order; then elements: u32 type, u32
bytes, data up to a multiple of 8 (a small one: u16 type, u16 bytes, 4 bytes of data). A matrix is an
element of elements: flags with the class, i32 dimensions, name, values in Fortran order, perhaps in a
smaller type than that of the class. A compressed element holds one element by DEFLATE ("MAT-File
Format", The MathWorks).

SciPy's reader believes the sizes that a file claims; this one holds them against the file first.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

_HEADER_BYTES = 128
_MATRIX, _COMPRESSED = 14, 15
_STORED = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_CLASSES = {6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8"}
_COMPLEX, _LOGICAL = 0x800, 0x200
_MOST_DIMENSIONS = 32
_LONGEST_NAME = 64
_LARGEST_ARRAY = 2**59
# DEFLATE cannot make more than 1032 bytes of one
_MOST_SQUEEZED = 1032
_BEGINNING_BYTES = 4096
"""Of a matrix: room for its flags, dimensions and name."""


class MatDamage(ValueError):
    """What a MAT-file says of itself is not true, or beyond this reader."""


@dataclass(frozen=True)
class MatArray:
    """A numeric array in a file, not read yet.

    Attributes
    ----------
    name : str
    shape : tuple of int
    """

    name: str
    shape: tuple[int, ...]
    _content: memoryview
    _squeezed: bool
    _order: str
    _offset: int
    _bytes: int
    _end: int
    _stored: str
    _class: str

    def read(self) -> NDArray[Any]:
        """All values, in Fortran order; raises `MatDamage` if they are not there."""
        content = _whole(self._content, self._end) if self._squeezed else self._content
        values = np.frombuffer(
            content[self._offset : self._offset + self._bytes], np.dtype(self._order + self._stored)
        )
        return values.astype(np.dtype(self._class), copy=False).reshape(self.shape, order="F")


def mat_arrays(path: str | Path) -> dict[str, MatArray]:
    """Numeric arrays of a file by name; cells, structures, text and sparse matrices are passed over.

    Parameters
    ----------
    path : str or Path

    Raises
    ------
    OSError
        If it cannot be opened.
    NotImplementedError
        If it is of version 7.3, which is HDF5.
    MatDamage
        If it is no MAT-file of level 5, or damaged.
    """
    content = np.memmap(path, np.uint8, "r").data if Path(path).stat().st_size else memoryview(b"")
    if bytes(content[:10]) == b"MATLAB 7.3" or bytes(content[:8]) == b"\x89HDF\r\n\x1a\n":
        raise NotImplementedError("HDF5")
    order = {b"IM": "<", b"MI": ">"}.get(bytes(content[126:128]))
    if order is None:
        raise MatDamage("it has no header of a MAT-file of version 5 to 7")
    arrays: dict[str, MatArray] = {}
    for kind, data in _elements(content[_HEADER_BYTES:], order):
        squeezed = kind == _COMPRESSED
        matrix = _matrix_inside(data, order) if squeezed else data if kind == _MATRIX else None
        found = None if matrix is None else _array(data if squeezed else matrix, squeezed, order)
        if found is not None:
            arrays[found.name] = found
    return arrays


def _elements(content: memoryview, order: str) -> Iterator[tuple[int, memoryview]]:
    """Types and data of the elements of the outermost level."""
    position = 0
    while position < len(content):
        kind, size, begin = _tag(content, position, order)
        if begin + size > len(content):
            problem = f"the element at byte {position + _HEADER_BYTES} claims {size} bytes"
            raise MatDamage(f"{problem} of the {len(content) - begin} that are left")
        yield kind, content[begin : begin + size]
        # elements in a compressed file follow one another without a gap
        position = begin + (size if kind == _COMPRESSED else _padded(size))


def _tag(content: memoryview, position: int, order: str) -> tuple[int, int, int]:
    """Type and size of the element at a position, and where its data begin."""
    if position + 8 > len(content):
        raise MatDamage("an element is cut short")
    kind, size = struct.unpack_from(f"{order}II", content, position)
    if kind >> 16:
        return kind & 0xFFFF, min(kind >> 16, 4), position + 4
    return kind, size, position + 8


def _padded(size: int) -> int:
    return -(-size // 8) * 8


def _matrix_inside(data: memoryview, order: str) -> memoryview | None:
    """Beginning of the matrix in a compressed element, None if something else is in it."""
    beginning = _inflated(data, 8)
    kind, size, _ = _tag(beginning, 0, order)
    if size > _MOST_SQUEEZED * len(data):
        raise MatDamage(f"{len(data)} compressed bytes claim to be {size}")
    return beginning if kind == _MATRIX else None


def _inflated(data: memoryview, size: int) -> memoryview:
    """First `size` bytes of compressed data, fewer if there are no more."""
    try:
        return memoryview(zlib.decompressobj().decompress(data, size))
    except zlib.error as error:
        raise MatDamage(f"compressed data are damaged ({error})") from None


def _whole(data: memoryview, size: int) -> memoryview:
    """Compressed data, all of them, whose checksum is right."""
    try:
        stream = zlib.decompressobj()
        content = stream.decompress(data, size)
        rest = stream.decompress(stream.unconsumed_tail, 1)
    except zlib.error as error:
        raise MatDamage(f"compressed data are damaged ({error})") from None
    if len(content) < size or rest or not stream.eof:
        raise MatDamage("compressed data are not as long as they say")
    return memoryview(content)


def _array(data: memoryview, squeezed: bool, order: str) -> MatArray | None:
    """What the beginning of a matrix says of it; None for what is no array of numbers."""
    content = _inflated(data, _BEGINNING_BYTES) if squeezed else data
    begin = 8 if squeezed else 0
    whole = _tag(content, 0, order)[1] + begin if squeezed else len(content)
    flags, position = _part(content, begin, order, 6)
    if len(flags) < 8:
        raise MatDamage("a matrix has no flags")
    (bits,) = struct.unpack_from(f"{order}I", flags)
    if bits & 0xFF not in _CLASSES or bits & (_COMPLEX | _LOGICAL):
        return None
    sizes, position = _part(content, position, order, 5)
    if not 8 <= len(sizes) <= 4 * _MOST_DIMENSIONS or len(sizes) % 4:
        raise MatDamage(f"a matrix has {len(sizes) // 4} dimensions")
    shape = struct.unpack(f"{order}{len(sizes) // 4}i", sizes)
    letters, position = _part(content, position, order, 1)
    name = bytes(letters[:_LONGEST_NAME]).decode("latin-1")
    kind, size, offset = _tag(content, position, order)
    if kind not in _STORED:
        raise MatDamage(f"{name} is stored as the unknown type {kind}")
    # NumPy multiplies the non-zero dimensions of an empty array too
    if math.prod(filter(None, shape)) > _LARGEST_ARRAY:
        raise MatDamage(f"{name} claims the shape {shape}")
    if min(shape) < 0 or math.prod(shape) * np.dtype(_STORED[kind]).itemsize != size or offset + size > whole:
        raise MatDamage(f"{name} claims the shape {shape} in {size} bytes")
    types = _STORED[kind], _CLASSES[bits & 0xFF]
    return MatArray(name, shape, data, squeezed, order, offset, size, whole, *types)


def _part(content: memoryview, position: int, order: str, kind: int) -> tuple[memoryview, int]:
    """Data of an element of a matrix that must be of one type, and where the next one begins."""
    found, size, begin = _tag(content, position, order)
    if found != kind or begin + size > len(content):
        raise MatDamage("the beginning of a matrix is damaged")
    # a small element is 8 bytes with its tag
    return content[begin : begin + size], position + 8 if begin == position + 4 else begin + _padded(size)
