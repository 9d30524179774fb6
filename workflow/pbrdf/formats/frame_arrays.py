"""One array of frames in a store of photographs: a frame is a chunk, and is read whole or refused.

Arrays of a band, named ``450nm``, have the axes state and exposure before row and column; its repeats of
a state, ``450nm_reference``, reference and exposure; ``dark`` has exposure and repeat.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Literal

import google_crc32c
import numpy as np
import zarr
import zarr.buffer.cpu
import zarr.codecs
from numcodecs.blosc import Blosc
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.formats.zarr_claims import require_backed, require_known

TAKE_AGAIN = "run `pbrdf capture` for that material: it takes what is missing"
CODEC: Literal["zstd"] = "zstd"
LEVEL = 1
DARK = "dark"
REFERENCE = "_reference"
"""End of the names of arrays that repeat a state of a band."""


def frame_axes(name: str) -> tuple[str, str]:
    """Names of the two axes that count the frames of an array."""
    if name == DARK:
        return "exposure", "repeat"
    return ("reference" if name.endswith(REFERENCE) else "state"), "exposure"


def add_array(group: zarr.Group, name: str, shape: tuple[int, int, int, int], dtype: str) -> None:
    """Add an empty array to a store."""
    # zstd 1 with bit shuffling wrote a 192² frame in 1.2 ms and read it in 0.24 ms; lz4 took 1.6 and
    # 0.48 ms and 8 % more room, no compression 1.6 and 0.67 ms and 1.7 times the room.
    typesize = np.dtype(dtype).itemsize
    squeeze = zarr.codecs.BloscCodec(cname=CODEC, clevel=LEVEL, shuffle="bitshuffle", typesize=typesize)
    group.create_array(
        name,
        shape=shape,
        chunks=(1, 1, *shape[2:]),
        dtype=dtype,
        compressors=[squeeze, zarr.codecs.Crc32cCodec()],
        dimension_names=(*frame_axes(name), "row", "column"),
        # a folder an array, not a folder a frame
        chunk_key_encoding={"name": "default", "separator": "."},
        # a frame that is all zero is a frame all the same, not a missing one
        config={"write_empty_chunks": True},
    )


def get_array(
    group: zarr.Group, store: Path, name: str, shape: tuple[int, int, int, int], dtype: str
) -> zarr.Array[Any]:
    """Array of a store; raises `InputError` if there is none of that shape and type."""
    try:
        array = group.get(name)
        if isinstance(array, zarr.Array):
            require_known(array)
    # JSON and Zarr's metadata raise many types
    except Exception as error:
        raise InputError(store, name, f"cannot be opened ({error})", "restore its zarr.json") from None
    if not isinstance(array, zarr.Array):
        raise InputError(store, name, "is missing", TAKE_AGAIN)
    if array.shape != shape or array.dtype != dtype:
        problem = f"is {array.dtype} {array.shape} where the attributes say {dtype} {shape}"
        raise InputError(store, name, problem, "restore its zarr.json")
    if array.chunks != (1, 1, *shape[2:]):
        raise InputError(
            store, name, f"has chunks of {array.chunks}, not of a frame", "restore its zarr.json"
        )
    return array.with_config({"write_empty_chunks": True})


def chunk_file(array: zarr.Array[Any], store: Path, name: str, place: tuple[int, ...]) -> Path:
    """File of a frame, by the array's own way to name chunks."""
    # the type that Zarr declares also stands for arrays of its second version
    return store / name / array.metadata.encode_chunk_key((*place, 0, 0))


def write_frame(file: Path, dtype: str, frame: NDArray[Any]) -> None:
    """Write a frame's chunk as Zarr writes it, beside, flushed, then renamed.

    Zarr's own writing takes four times as long and does not flush.

    Parameters
    ----------
    file : Path
        See `chunk_file`.
    dtype : str
        Of the array.
    frame : ndarray, shape (rows, columns)
    """
    words = np.ascontiguousarray(frame, np.dtype(dtype).newbyteorder("<"))
    squeezed = Blosc(CODEC, LEVEL, Blosc.BITSHUFFLE).encode(words)
    checksum = google_crc32c.value(bytes(squeezed)).to_bytes(4, "little")
    beside = file.with_name(f".{file.name}.part")
    with beside.open("wb") as stream:
        stream.write(squeezed)
        stream.write(checksum)
        stream.flush()
        os.fsync(stream.fileno())
    beside.replace(file)


def require_frames(array: zarr.Array[Any], store: Path, name: str) -> None:
    """Refuse an array that lacks frames; raises `InputError` naming the first."""
    lost = array.nchunks - array.nchunks_initialized
    if lost:
        places = np.ndindex(array.shape[:2])
        first = next(place for place in places if not chunk_file(array, store, name, place).is_file())
        problem = f"is missing: the array lacks {lost} of {array.nchunks} frames"
        raise InputError(store, _frame(name, first), problem, TAKE_AGAIN)
    try:
        require_backed(array, store / name)
    except ValueError as error:
        raise InputError(store, name, f"is damaged ({error})", "restore its zarr.json") from None


def decode(
    array: zarr.Array[Any],
    store: Path,
    name: str,
    outer: slice,
    rows: slice,
    columns: slice,
    into: NDArray[Any] | None = None,
) -> NDArray[Any]:
    """Window of the frames `outer` of the first axis; raises `InputError` for a damaged one.

    It fills `into`, if that is given.
    """
    out = None if into is None else zarr.buffer.cpu.NDBuffer.from_numpy_array(into)
    try:
        frames = np.asarray(array.get_basic_selection((outer, slice(None), rows, columns), out=out))
    # Zarr, Blosc and the checksum each raise a type of their own
    except Exception as error:
        places = np.ndindex(outer.stop - outer.start, array.shape[1])
        for place in places:
            decode_frame(array, store, name, (outer.start + place[0], place[1]))
        # each by itself can be read now
        raise _damaged(store, name, (outer.start, 0), error) from None
    if frames.dtype.kind == "f":
        refuse_not_finite(store, name, frames, outer.start)
    return frames


def decode_frame(array: zarr.Array[Any], store: Path, name: str, place: tuple[int, int]) -> NDArray[Any]:
    """One frame, shape (rows, columns); raises `InputError` if it is damaged."""
    try:
        return np.asarray(array[place])
    # Zarr, Blosc and the checksum each raise a type of their own
    except Exception as error:
        raise _damaged(store, name, place, error) from None


def missing_frame(store: Path, name: str, place: tuple[int, ...]) -> InputError:
    """What to raise for a frame that is not there."""
    return InputError(store, _frame(name, place), "is missing", TAKE_AGAIN)


def _damaged(store: Path, name: str, place: tuple[int, ...], error: Exception) -> InputError:
    return InputError(
        store,
        _frame(name, place),
        f"is damaged ({error})",
        "delete that frame's file and " + TAKE_AGAIN,
    )


def refuse_not_finite(source: str | Path, name: str, frames: NDArray[Any], begin: int = 0) -> None:
    """Refuse frames of an array, of shape (…, …, row, column), that hold NaN or infinity.

    `begin` is the place of the first of them along the first axis.

    Raises
    ------
    InputError
        Naming the first such frame.
    """
    bad = ~np.isfinite(frames).all(axis=(2, 3))
    if bad.any():
        outer, inner = (int(index) for index in np.argwhere(bad)[0])
        raise InputError(
            source,
            _frame(name, (begin + outer, inner)),
            "holds values that are not finite",
            "take or export that frame again",
        )


def _frame(name: str, place: tuple[int, ...]) -> str:
    """A frame in words: ``450nm, state 7, exposure 1``."""
    return ", ".join(
        [name, *(f"{axis} {index}" for axis, index in zip(frame_axes(name), place, strict=True))]
    )
