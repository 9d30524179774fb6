"""OpenEXR files, whole or not at all."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import OpenEXR
from numpy.typing import NDArray

from pbrdf.formats.beside import replace_file

_LEAST_BYTES = 2
"""Of a sample: half precision."""
_MOST_SQUEEZED = 1100
"""Bytes for which a compressed byte may stand: in empty images 750 with ZIP and PXR24, 370 with PIZ."""
_HARD_SQUEEZED = 8000
"""The same of the compressions in `_HARD`: 6100."""
_HARD = (
    OpenEXR.DWAA_COMPRESSION,
    OpenEXR.DWAB_COMPRESSION,
    OpenEXR.HTJ2K32_COMPRESSION,
    OpenEXR.HTJ2K256_COMPRESSION,
)
_FLAT = (OpenEXR.scanlineimage, OpenEXR.tiledimage)


def write_exr(path: str | Path, header: Mapping[str, Any], channels: Mapping[str, NDArray[Any]]) -> None:
    """Write a scan-line image beside, then rename, so that `path` never holds half of one.

    Parameters
    ----------
    path : str or Path
    header : mapping
        Its attributes, `compression` among them.
    channels : mapping of str to ndarray, shape (rows, columns), float32, float16 or uint32
        C-contiguous, by name.
    """
    image = OpenEXR.File({"type": OpenEXR.scanlineimage, **header}, dict(channels))
    with image, replace_file(path) as part:
        try:
            image.write(str(part))
        # OpenEXR's word for whatever the disk refuses, which ends with the reason
        except RuntimeError as error:
            raise OSError(str(error).rpartition('". ')[2].rstrip(".")) from error


@contextmanager
def open_exr(path: str | Path) -> Iterator[OpenEXR.File]:
    """Read an image, each channel by itself, unless its header claims more than the file can hold.

    Raises
    ------
    ValueError
        If it cannot be decoded, or claims what cannot be true.
    """
    try:
        with OpenEXR.File(str(path), header_only=True) as image:
            claimed = sum(_least_bytes(part.header) for part in image.parts)
        if claimed > Path(path).stat().st_size:
            raise ValueError("it claims more pixels than the file can hold")
        with OpenEXR.File(str(path), separate_channels=True) as image:
            if not image.parts:
                raise ValueError("it has no part that can be decoded")
            yield image
    # OpenEXR's own errors, and names in its header that are not UTF-8
    except (RuntimeError, TypeError, KeyError) as error:
        raise ValueError(str(error)) from error


def _least_bytes(header: Mapping[str, Any]) -> int:
    """Bytes that a file must have to hold an image with this header."""
    if header["type"] not in _FLAT:
        raise ValueError("it is a deep image")
    first, last = header["dataWindow"]
    columns, rows = (int(end) - int(begin) + 1 for begin, end in zip(first, last, strict=True))
    samples = rows * columns * len(header["channels"]) * _LEAST_BYTES
    if header["compression"] == OpenEXR.NO_COMPRESSION:
        return samples
    return samples // (_HARD_SQUEEZED if header["compression"] in _HARD else _MOST_SQUEEZED)
