"""What the metadata of a Zarr array claim, held against what lies on the disk before anything is read."""

from __future__ import annotations

import hashlib
import json
import math
from pathlib import Path
from typing import Any

import zarr

CODECS = {"bytes", "transpose", "blosc", "zstd", "gzip", "crc32c"}
"""Those that turn bytes into numbers and do nothing else."""
MOST_CHUNKS = 1_000_000
MOST_SQUEEZED = 40_000
"""Bytes for which a byte of a chunk may stand: Zstandard keeps 128 KiB of one value in 4."""


SEAL = "metadata_digest"
"""Attribute of a store with the digest of what its ``zarr.json`` files say: only chunks carry checksums."""


def seal(group: zarr.Group, folder: Path) -> None:
    """Give a store whose arrays are all there the attribute `SEAL`."""
    group.attrs[SEAL] = _metadata_digest(folder)


def require_sealed(folder: Path) -> None:
    """Refuse a store (`ValueError`) whose metadata are not those that were sealed; old ones have no seal."""
    attributes = json.loads((folder / "zarr.json").read_bytes())["attributes"]
    if SEAL in attributes and attributes[SEAL] != _metadata_digest(folder):
        raise ValueError("its zarr.json files are not those that were written")


def _metadata_digest(folder: Path) -> str:
    """SHA-256 of the metadata of a store and its arrays, but for the seal; half of its digits."""
    found = {}
    for file in (folder / "zarr.json", *folder.glob("*/zarr.json")):
        metadata = json.loads(file.read_bytes())
        metadata.get("attributes", {}).pop(SEAL, None)
        found[file.relative_to(folder).as_posix()] = metadata
    return hashlib.sha256(json.dumps(found, sort_keys=True).encode()).hexdigest()[:32]


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
