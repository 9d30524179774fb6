"""How many pixels a PNG or TIFF file claims, read without a decoder: that would make room for them."""

from __future__ import annotations

import math
import struct
from mmap import ACCESS_READ, mmap
from pathlib import Path

_PNG = b"\x89PNG\r\n\x1a\n"
_PNG_CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
_TIFF = {b"II*\0": "<", b"MM\0*": ">"}
_NO_COMPRESSION, _PACKED = 1, 32773
_MOST_SQUEEZED = {_NO_COMPRESSION: 1, _PACKED: 64}
_ANY_SQUEEZED = 1100
"""Bytes for which a byte may stand: DEFLATE reaches 1032, LZW less."""
_FORMS = {1: "B", 3: "H", 4: "I"}


def least_bytes(path: str | Path) -> int:
    """Bytes that a PNG or TIFF file must have to hold the image that its header tells of.

    Raises
    ------
    ValueError
        If it is neither, or its header is damaged.
    """
    # an empty file is none that can be mapped: a ValueError too
    try:
        with Path(path).open("rb") as file, mmap(file.fileno(), 0, access=ACCESS_READ) as content:
            if content[: len(_PNG)] == _PNG:
                return _png(content)
            if content[:4] in _TIFF:
                return _tiff(content, _TIFF[content[:4]])
    except (struct.error, KeyError, IndexError) as error:
        raise ValueError(f"the header is damaged ({error})") from None
    raise ValueError("this is neither PNG nor TIFF")


def _png(content: mmap) -> int:
    """Portable Network Graphics, 11.2.2: the first chunk is IHDR."""
    name, columns, rows, depth, colour = struct.unpack_from(">4sIIBB", content, 12)
    if name != b"IHDR":
        raise ValueError("the header is missing")
    return int(columns * rows * depth * _PNG_CHANNELS[colour]) // 8 // _ANY_SQUEEZED


def _tiff(content: mmap, order: str) -> int:
    """TIFF 6.0, section 2: the first directory of fields."""
    (directory,) = struct.unpack_from(f"{order}I", content, 4)
    (number,) = struct.unpack_from(f"{order}H", content, directory)
    fields: dict[int, int] = {}
    for index in range(number):
        tag, kind, count = struct.unpack_from(f"{order}HHI", content, directory + 2 + 12 * index)
        if count == 1 and kind in _FORMS:
            (fields[tag],) = struct.unpack_from(
                f"{order}{_FORMS[kind]}", content, directory + 10 + 12 * index
            )
    columns, rows, depth, compression = fields[256], fields[257], fields.get(258, 1), fields.get(259, 1)
    bits = math.prod((columns, rows, depth, fields.get(277, 1)))
    return bits // 8 // _MOST_SQUEEZED.get(compression, _ANY_SQUEEZED)
