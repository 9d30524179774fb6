"""What the metadata of a Zarr array claim, held against what lies on the disk before anything is read."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import zarr

CODECS = {"bytes", "transpose", "blosc", "zstd", "gzip", "crc32c"}
"""Those that turn bytes into numbers and do nothing else."""
MOST_CHUNKS = 1_000_000
MOST_SQUEEZED = 40_000
"""Bytes for which a byte of a chunk may stand: Zstandard keeps 128 KiB of one value in 4."""


def require_known(array: zarr.Array[Any]) -> None:
    """Refuse an array (`ValueError`) of a codec that no writer here uses, or of chunks beyond counting."""
    metadata: Any = array.metadata.to_dict()
    unknown = {codec["name"] for codec in metadata["codecs"]} - CODECS
    if unknown:
        raise ValueError(f"the codec {', '.join(sorted(unknown))} is not known here")
    if array.nchunks > MOST_CHUNKS:
        raise ValueError(f"it claims {array.nchunks} chunks")


def require_backed(array: zarr.Array[Any], folder: Path) -> None:
    """Refuse an array that claims more than the files in its folder can hold, or that is not known.

    Parameters
    ----------
    array : zarr.Array
    folder : Path
        Where its ``zarr.json`` and chunks lie.

    Raises
    ------
    ValueError
        If it claims too many or too large chunks, or wants a codec that no writer here uses.
    """
    require_known(array)
    stored = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())
    claimed = array.nchunks * math.prod(array.chunks) * array.dtype.itemsize
    if claimed > MOST_SQUEEZED * stored:
        raise ValueError(f"it claims {claimed} bytes of {stored} on the disk")
