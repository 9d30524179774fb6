"""The photographs of one light: a Zarr store of raw frames, one frame one chunk.

``frames.zarr`` holds an array (state, exposure, row, column) a band, named ``450nm``, where a state
was taken again also its repeats ``450nm_reference`` (reference, exposure, row, column), and the dark frames
``dark`` (exposure, repeat, row, column), all of the camera's own type.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import zarr
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.formats.folders import replace_folder
from pbrdf.formats.frame_arrays import (
    DARK,
    REFERENCE,
    add_array,
    chunk_file,
    decode,
    decode_frame,
    frame_axes,
    get_array,
    missing_frame,
    require_frames,
    write_frame,
)
from pbrdf.formats.zarr_claims import require_sealed, seal

SCHEMA = "pbrdf/frames/1"
DTYPES = ("uint8", "uint16", "float32")


@dataclass(frozen=True)
class FramesHeader:
    """What the frames of a light are.

    Attributes
    ----------
    material, light : str
        Names of the material and of the light's folder.
    source : str
        What took the frames: a rig, ``images``, ``arrays``. Frames of another source never join them.
    angle_deg : float
        Angle of the arm, degrees.
    bands_nm : tuple of int
        Band centres, ascending, nm.
    states_deg : tuple of four floats each
        Generator polariser, generator retarder, analyser retarder, analyser polariser; degrees.
    exposures_s : tuple of float
        Exposure times, ascending, s.
    darks : int
        Dark frames per exposure.
    rows, columns : int
        Size of a frame, px.
    dtype : {"uint8", "uint16", "float32"}
    adc_bits, shift : int
        Bits of the converter and how far its word is shifted left.
    saturation : float
        A stored value at or above this is saturated, DN.
    references : tuple of int
        How many states were taken before each repeat of one of them, ascending; empty for no repeats.
    reference_state : int
        Which state is repeated.
    metered_dn_per_s : float or None
        Where the exposures were chosen by what the camera saw: the brightest part of the picture over all
        bands and states that were looked at. Stored units a second.
    darks_at_ends : bool
        Whether dark frames were taken at start and end of the run only, not with the light's own frames.
    """

    material: str
    light: str
    source: str
    angle_deg: float
    bands_nm: tuple[int, ...]
    states_deg: tuple[tuple[float, ...], ...]
    exposures_s: tuple[float, ...]
    darks: int
    rows: int
    columns: int
    dtype: str
    adc_bits: int
    shift: int
    saturation: float
    references: tuple[int, ...] = ()
    reference_state: int = 0
    metered_dn_per_s: float | None = None
    darks_at_ends: bool = False

    def attributes(self) -> dict[str, Any]:
        """As JSON holds it: lists for tuples."""
        content = asdict(self)
        content["bands_nm"] = list(self.bands_nm)
        content["states_deg"] = [list(state) for state in self.states_deg]
        content["exposures_s"] = list(self.exposures_s)
        content["references"] = list(self.references)
        return {"schema": SCHEMA, **content}

    def arrays(self) -> tuple[str, ...]:
        """Names of the arrays of the store, in the order their frames are read."""
        names = [band_name(band_nm) for band_nm in self.bands_nm]
        if self.references:
            names += [reference_name(band_nm) for band_nm in self.bands_nm]
        return (*names, DARK) if self.darks else tuple(names)

    def shape(self, name: str) -> tuple[int, int, int, int]:
        """Shape of an array of the store."""
        counts = {
            "state": len(self.states_deg),
            "exposure": len(self.exposures_s),
            "reference": len(self.references),
            "repeat": self.darks,
        }
        outer, inner = frame_axes(name)
        return counts[outer], counts[inner], self.rows, self.columns


class FrameStore:
    """The ``frames.zarr`` of one light.

    Use `create` to begin one and `open` to go on with it or to read it.
    """

    def __init__(self, path: Path, group: zarr.Group, header: FramesHeader) -> None:
        self.path = path
        self.header = header
        self._group = group
        self._arrays: dict[str, zarr.Array[Any]] = {}

    @classmethod
    def create(cls, path: str | Path, header: FramesHeader) -> FrameStore:
        """Begin an empty store; raises `InputError` for a type of frame that is not known."""
        path = Path(path)
        if header.dtype not in DTYPES:
            raise InputError(
                path, "dtype", f"is {header.dtype}", f"convert the frames to {', '.join(DTYPES)}"
            )
        with replace_folder(path) as beside:
            group = zarr.open_group(beside, mode="w", attributes=header.attributes())
            for name in header.arrays():
                add_array(group, name, header.shape(name), header.dtype)
            seal(group, beside)
        return cls.open(path, writable=True)

    @classmethod
    def open(cls, path: str | Path, *, writable: bool = False) -> FrameStore:
        """Open an existing store.

        Raises
        ------
        InputError
            If there is none, or its metadata are not those of a frame store.
        """
        path = Path(path)
        if not path.is_dir():
            raise InputError(path, "store", "does not exist", "take or write the capture first")
        try:
            group = zarr.open_group(path, mode="r+" if writable else "r", zarr_format=3)
            attributes = dict(group.attrs)
        # JSON and Zarr's metadata raise many types
        except Exception as error:
            raise InputError(path, "store", f"cannot be opened ({error})", "restore its zarr.json") from None
        if attributes.pop("schema", None) != SCHEMA:
            raise InputError(path, "schema", f"is not {SCHEMA}", "give a capture written by this program")
        return cls(path, group, _header(path, attributes))

    def saturating_at(self, limit: float) -> FrameStore:
        """The same frames, of which also values at or above `limit`, DN, count as saturated."""
        header = replace(self.header, saturation=min(limit, self.header.saturation))
        return FrameStore(self.path, self._group, header)

    def write_frame(self, band_nm: int, state: int, exposure: int, frame: NDArray[Any]) -> None:
        """Store a frame (rows, columns)."""
        self.write_at(band_name(band_nm), (state, exposure), frame)

    def write_dark(self, exposure: int, repeat: int, frame: NDArray[Any]) -> None:
        """Store a dark frame (rows, columns)."""
        self.write_at(DARK, (exposure, repeat), frame)

    def write_at(self, name: str, place: tuple[int, int], frame: NDArray[Any]) -> None:
        """Store a frame (rows, columns) at its place in an array, its pixels flushed to the disk."""
        shape = (self.header.rows, self.header.columns)
        if frame.shape != shape:
            raise ValueError(f"a frame of {frame.shape} pixels does not fit into {self.path} of {shape}")
        write_frame(self.file_at(name, place), self.header.dtype, frame)

    def read_at(self, name: str, place: tuple[int, int]) -> NDArray[Any]:
        """Frame (rows, columns) at a place of an array.

        Raises
        ------
        InputError
            If it is missing or damaged.
        """
        if not self.file_at(name, place).is_file():
            raise missing_frame(self.path, name, place)
        return decode_frame(self._array(name), self.path, name, place)

    def flush(self) -> None:
        """Have the disk know of every frame's name as it does of its pixels."""
        for name in self.header.arrays():
            folder = os.open(self.path / name, os.O_RDONLY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)

    def file_at(self, name: str, place: tuple[int, int]) -> Path:
        """File of a frame, whether it is there or not."""
        return chunk_file(self._array(name), self.path, name, place)

    def require_complete(self) -> None:
        """Refuse a store that lacks any frame.

        Raises
        ------
        InputError
            Naming the first frame that is missing of a band, of its repeats or of the dark frames.
        """
        for name in self.header.arrays():
            self._complete_array(name)

    def read_band(self, band_nm: int, rows: slice, columns: slice) -> NDArray[Any]:
        """Window of all frames of a band, shape (state, exposure, row, column), type of the camera.

        Raises
        ------
        InputError
            If a frame is missing, damaged or not finite.
        """
        return self._read(band_name(band_nm), rows, columns)

    def read_dark(self, rows: slice, columns: slice) -> NDArray[Any]:
        """Window of the dark frames, shape (exposure, repeat, row, column); raises as `read_band`."""
        return self._read(DARK, rows, columns)

    def read_states(
        self, band_nm: int, rows: slice, columns: slice, into: Sequence[NDArray[Any]] = ()
    ) -> Iterator[NDArray[Any]]:
        """Windows of a band's frames, some states at a time: shape (state, exposure, row, column).

        Parameters
        ----------
        band_nm, rows, columns
            Which frames, and their window.
        into : sequence of ndarray, shape (states at a time, exposure, row, column), optional
            Memory to fill by turns; what is given is part of it. By default fresh memory a state.

        Raises
        ------
        InputError
            If a frame is missing, before the first is read; or if one is damaged or not finite.
        """
        yield from self._read_each(band_name(band_nm), rows, columns, into)

    def read_state(self, band_nm: int, state: int, rows: slice, columns: slice) -> NDArray[Any]:
        """Window of the frames of one state, shape (exposure, row, column); raises as `read_states`."""
        name = band_name(band_nm)
        array = self._complete_array(name)
        one: NDArray[Any] = decode(array, self.path, name, slice(state, state + 1), rows, columns)[0]
        return one

    def read_references(self, band_nm: int, rows: slice, columns: slice) -> Iterator[NDArray[Any]]:
        """Windows of the repeats of a band's reference state, one by one: shape (exposure, row, column).

        None where none was taken; raises as `read_states`.
        """
        if self.header.references:
            for repeat in self._read_each(reference_name(band_nm), rows, columns):
                yield repeat[0]

    def mean_dark(self, rows: slice, columns: slice) -> NDArray[np.float32]:
        """Mean dark frame of each exposure, shape (exposure, row, column), DN; zero where none was taken."""
        if not self.header.darks:
            shape = np.empty((self.header.rows, self.header.columns))[rows, columns].shape
            return np.zeros((len(self.header.exposures_s), *shape), np.float32)
        frames = self._read(DARK, rows, columns)
        # sums of fewer than 256 words of 16 bits are exact in float32
        mean = frames.mean(axis=1, dtype=np.float64 if frames.dtype.kind == "f" else np.float32)
        return np.asarray(mean, np.float32)

    def _array(self, name: str) -> zarr.Array[Any]:
        if name not in self._arrays:
            shape, dtype = self.header.shape(name), self.header.dtype
            self._arrays[name] = get_array(self._group, self.path, name, shape, dtype)
        return self._arrays[name]

    def _complete_array(self, name: str) -> zarr.Array[Any]:
        array = self._array(name)
        require_frames(array, self.path, name)
        try:
            # metadata that are possible, and not those that were written
            require_sealed(self.path)
        except ValueError as error:
            raise InputError(self.path, "zarr.json", f"is damaged ({error})", "restore zarr.json") from None
        return array

    def _read(self, name: str, rows: slice, columns: slice) -> NDArray[Any]:
        array = self._complete_array(name)
        return decode(array, self.path, name, slice(0, array.shape[0]), rows, columns)

    def _read_each(
        self, name: str, rows: slice, columns: slice, into: Sequence[NDArray[Any]] = ()
    ) -> Iterator[NDArray[Any]]:
        """Windows of an array's frames, along its first axis; `into` as for `read_states`."""
        array = self._complete_array(name)
        at_once = len(into[0]) if into else 1
        for turn, first in enumerate(range(0, array.shape[0], at_once)):
            last = min(first + at_once, array.shape[0])
            memory = into[turn % len(into)][: last - first] if into else None
            yield decode(array, self.path, name, slice(first, last), rows, columns, memory)


def band_name(band_nm: int) -> str:
    """Name of a band's array and files: ``450nm``."""
    return f"{band_nm}nm"


def reference_name(band_nm: int) -> str:
    """Name of the array of a band's repeats of one state: ``450nm_reference``."""
    return band_name(band_nm) + REFERENCE


def _header(path: Path, attributes: Mapping[str, Any]) -> FramesHeader:
    """Header of a store with these attributes; raises `InputError` if they are not those of one."""
    # older stores have no repeats, or repeat the first state; none is metered
    older = {"references": [], "reference_state": 0, "metered_dn_per_s": None, "darks_at_ends": False}
    attributes = {**older, **attributes}
    metered = attributes["metered_dn_per_s"]
    try:
        header = FramesHeader(
            material=str(attributes["material"]),
            light=str(attributes["light"]),
            source=str(attributes["source"]),
            angle_deg=float(attributes["angle_deg"]),
            bands_nm=tuple(int(band_nm) for band_nm in attributes["bands_nm"]),
            states_deg=tuple(tuple(float(angle) for angle in state) for state in attributes["states_deg"]),
            exposures_s=tuple(float(time) for time in attributes["exposures_s"]),
            darks=int(attributes["darks"]),
            rows=int(attributes["rows"]),
            columns=int(attributes["columns"]),
            dtype=str(attributes["dtype"]),
            adc_bits=int(attributes["adc_bits"]),
            shift=int(attributes["shift"]),
            saturation=float(attributes["saturation"]),
            references=tuple(int(before) for before in attributes["references"]),
            reference_state=int(attributes["reference_state"]),
            metered_dn_per_s=None if metered is None else float(metered),
            darks_at_ends=bool(attributes["darks_at_ends"]),
        )
    except KeyError as error:
        raise InputError(path, f"attributes.{error.args[0]}", "is missing", "restore zarr.json") from None
    except (TypeError, ValueError) as error:
        raise InputError(path, "attributes", f"are damaged ({error})", "restore zarr.json") from None
    for name, value in header.attributes().items():
        if name != "schema" and attributes[name] != value:
            raise InputError(path, f"attributes.{name}", f"is {attributes[name]!r}", "restore zarr.json")
    if header.reference_state not in range(max(1, len(header.states_deg))):
        problem = f"is {header.reference_state} with {len(header.states_deg)} states"
        raise InputError(path, "attributes.reference_state", problem, "restore zarr.json")
    return header
