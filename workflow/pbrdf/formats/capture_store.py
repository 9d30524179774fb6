"""The photographs of one light: a Zarr store of raw frames, one frame one chunk.

``frames.zarr`` holds an array (state, exposure, row, column) a band, named ``450nm``, and the dark
frames ``dark`` (exposure, repeat, row, column), all of the camera's own type.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import zarr
import zarr.codecs
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.formats.folders import replace_folder

SCHEMA = "pbrdf/frames/1"
TAKE_AGAIN = "run `pbrdf capture` for that material: it takes what is missing"
DTYPES = ("uint8", "uint16", "float32")
DARK = "dark"
BAND_AXES = ("state", "exposure")
DARK_AXES = ("exposure", "repeat")


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

    def attributes(self) -> dict[str, Any]:
        """As JSON holds it: lists for tuples."""
        content = asdict(self)
        content["bands_nm"] = list(self.bands_nm)
        content["states_deg"] = [list(state) for state in self.states_deg]
        content["exposures_s"] = list(self.exposures_s)
        return {"schema": SCHEMA, **content}

    def shape(self, name: str) -> tuple[int, int, int, int]:
        """Shape of the array of a band or of the dark frames."""
        exposures = len(self.exposures_s)
        first = (exposures, self.darks) if name == DARK else (len(self.states_deg), exposures)
        return (*first, self.rows, self.columns)


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
            for band_nm in header.bands_nm:
                _add(group, band_name(band_nm), header)
            if header.darks:
                _add(group, DARK, header)
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
            group = zarr.open_group(path, mode="r+" if writable else "r")
            attributes = dict(group.attrs)
        # JSON and Zarr's metadata raise many types
        except Exception as error:
            raise InputError(path, "store", f"cannot be opened ({error})", "restore its zarr.json") from None
        if attributes.pop("schema", None) != SCHEMA:
            raise InputError(path, "schema", f"is not {SCHEMA}", "give a capture written by this program")
        return cls(path, group, _header(path, attributes))

    def write_frame(self, band_nm: int, state: int, exposure: int, frame: NDArray[Any]) -> None:
        """Store a frame (rows, columns)."""
        self._array(band_name(band_nm))[state, exposure] = frame

    def write_dark(self, exposure: int, repeat: int, frame: NDArray[Any]) -> None:
        """Store a dark frame (rows, columns)."""
        self._array(DARK)[exposure, repeat] = frame

    def holds(self, band_nm: int | None, state: int, exposure: int) -> bool:
        """Whether a frame, or without a band a dark frame of repeat `state`, lies on the disk."""
        if band_nm is None:
            return self._chunk(DARK, (exposure, state)).is_file()
        return self._chunk(band_name(band_nm), (state, exposure)).is_file()

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

    def read_states(self, band_nm: int, rows: slice, columns: slice) -> Iterator[NDArray[Any]]:
        """Windows of a band's frames, state by state: shape (exposure, row, column), type of the camera.

        Raises
        ------
        InputError
            If a frame is missing, before the first is read; or if one is damaged or not finite.
        """
        name = band_name(band_nm)
        array = self._complete_array(name)
        for state in range(array.shape[0]):
            yield self._decode(array, name, slice(state, state + 1), rows, columns)[0]

    def mean_dark(self, rows: slice, columns: slice) -> NDArray[np.float32]:
        """Mean dark frame of each exposure, shape (exposure, row, column), DN; zero where none was taken."""
        if not self.header.darks:
            shape = np.empty((self.header.rows, self.header.columns))[rows, columns].shape
            return np.zeros((len(self.header.exposures_s), *shape), np.float32)
        mean: NDArray[np.float64] = self._read(DARK, rows, columns).mean(axis=1, dtype=np.float64)
        return mean.astype(np.float32)

    def _array(self, name: str) -> zarr.Array[Any]:
        if name not in self._arrays:
            try:
                array = self._group.get(name)
            # JSON and Zarr's metadata raise many types
            except Exception as error:
                raise InputError(
                    self.path, name, f"cannot be opened ({error})", "restore its zarr.json"
                ) from None
            if not isinstance(array, zarr.Array):
                raise InputError(self.path, name, "is missing", TAKE_AGAIN)
            shape, dtype = self.header.shape(name), self.header.dtype
            if array.shape != shape or array.dtype != dtype:
                problem = f"is {array.dtype} {array.shape} where the attributes say {dtype} {shape}"
                raise InputError(self.path, name, problem, "restore its zarr.json")
            self._arrays[name] = array.with_config({"write_empty_chunks": True})
        return self._arrays[name]

    def _read(self, name: str, rows: slice, columns: slice) -> NDArray[Any]:
        array = self._complete_array(name)
        return self._decode(array, name, slice(0, array.shape[0]), rows, columns)

    def _complete_array(self, name: str) -> zarr.Array[Any]:
        array = self._array(name)
        lost = array.nchunks - array.nchunks_initialized
        if lost:
            first = next(
                place for place in np.ndindex(array.shape[:2]) if not self._chunk(name, place).is_file()
            )
            problem = f"is missing: the array lacks {lost} of {array.nchunks} frames"
            raise InputError(self.path, _frame(name, first), problem, TAKE_AGAIN)
        return array

    def _decode(
        self, array: zarr.Array[Any], name: str, outer: slice, rows: slice, columns: slice
    ) -> NDArray[Any]:
        try:
            frames = np.asarray(array[outer, :, rows, columns])
        # Zarr, Blosc and the checksum each raise a type of their own
        except Exception as error:
            places = np.ndindex(outer.stop - outer.start, array.shape[1])
            frames_of = ((outer.start + place[0], place[1]) for place in places)
            first = next((place for place in frames_of if not _is_whole(array, place)), (outer.start, 0))
            raise InputError(
                self.path,
                _frame(name, first),
                f"is damaged ({error})",
                "delete that frame's file and " + TAKE_AGAIN,
            ) from None
        if frames.dtype.kind == "f":
            refuse_not_finite(self.path, name, frames, outer.start)
        return frames

    def _chunk(self, name: str, place: tuple[int, ...]) -> Path:
        """File of a frame, by Zarr's default names of chunks."""
        return self.path.joinpath(name, "c", *map(str, place), "0", "0")


def band_name(band_nm: int) -> str:
    """Name of a band's array and files: ``450nm``."""
    return f"{band_nm}nm"


def refuse_not_finite(source: str | Path, name: str, frames: NDArray[Any], begin: int = 0) -> None:
    """Refuse frames of a band or dark frames, of shape (…, …, row, column), that hold NaN or infinity.

    `begin` is the place of the first of them along the first axis.

    Raises
    ------
    InputError
        Naming the first such frame.
    """
    bad = ~np.isfinite(frames).all(axis=(2, 3))
    if bad.any():
        outer, inner = (int(index) for index in np.argwhere(bad)[0])
        first = (begin + outer, inner)
        raise InputError(
            source,
            _frame(name, first),
            "holds values that are not finite",
            "take or export that frame again",
        )


def _frame(name: str, place: tuple[int, ...]) -> str:
    """A frame in words: ``450nm, state 7, exposure 1``."""
    axes = DARK_AXES if name == DARK else BAND_AXES
    return ", ".join([name, *(f"{axis} {index}" for axis, index in zip(axes, place, strict=True))])


def _is_whole(array: zarr.Array[Any], place: tuple[int, ...]) -> bool:
    try:
        np.asarray(array[place])
    except Exception:
        return False
    return True


def _add(group: zarr.Group, name: str, header: FramesHeader) -> None:
    # zstd 1 with bit shuffling wrote a 192² frame in 1.2 ms and read it in 0.24 ms; lz4 took 1.6 and
    # 0.48 ms and 8 % more room, no compression 1.6 and 0.67 ms and 1.7 times the room.
    typesize = np.dtype(header.dtype).itemsize
    squeeze = zarr.codecs.BloscCodec(cname="zstd", clevel=1, shuffle="bitshuffle", typesize=typesize)
    group.create_array(
        name,
        shape=header.shape(name),
        chunks=(1, 1, header.rows, header.columns),
        dtype=header.dtype,
        compressors=[squeeze, zarr.codecs.Crc32cCodec()],
        dimension_names=(*(DARK_AXES if name == DARK else BAND_AXES), "row", "column"),
        # a frame that is all zero is a frame all the same, not a missing one
        config={"write_empty_chunks": True},
    )


def _header(path: Path, attributes: Mapping[str, Any]) -> FramesHeader:
    """Header of a store with these attributes; raises `InputError` if they are not those of one."""
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
        )
    except KeyError as error:
        raise InputError(path, f"attributes.{error.args[0]}", "is missing", "restore zarr.json") from None
    except (TypeError, ValueError) as error:
        raise InputError(path, "attributes", f"are damaged ({error})", "restore zarr.json") from None
    for name, value in header.attributes().items():
        if name != "schema" and attributes[name] != value:
            raise InputError(path, f"attributes.{name}", f"is {attributes[name]!r}", "restore zarr.json")
    return header
