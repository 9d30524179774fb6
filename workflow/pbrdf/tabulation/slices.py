"""What one light says of the table: a slice over θh and φd at nearly constant θd.

The camera and the light stand still during a light's photographs, so the half vector hardly changes
over the image, and every pixel shows nearly the same θd: one light is one slice.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import zarr
import zarr.codecs
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.formats.folders import replace_folder
from pbrdf.formats.zarr_claims import require_backed

SCHEMA = "pbrdf/slice/1"
_ARRAYS = ("mueller", "variance", "count", "theta_d")
_MAKE_AGAIN = "make the slice again"
Float = NDArray[np.float64]


@dataclass(frozen=True)
class Slice:
    """One light's share of the table.

    Attributes
    ----------
    angle_deg : float
        Angle of the arm.
    bands_nm : tuple of int
    mueller, variance : ndarray, shape (B, H, P, 4, 4), float32
        1/sr, table frames; NaN where the light shows nothing of the node.
    count : ndarray, shape (B, H, P), uint16
        Pixels behind each node; 0 where it is not seen.
    theta_d : ndarray, shape (H, P), float64
        θd at which the node is actually seen, radians.
    """

    angle_deg: float
    bands_nm: tuple[int, ...]
    mueller: NDArray[np.float32]
    variance: NDArray[np.float32]
    count: NDArray[np.uint16]
    theta_d: Float


def write_slice(path: str | Path, part: Slice) -> None:
    """Write a slice as a Zarr store, beside and then renamed."""
    with replace_folder(path) as beside:
        attributes: dict[str, Any] = {
            "schema": SCHEMA,
            "angle_deg": part.angle_deg,
            "bands_nm": list(part.bands_nm),
        }
        group = zarr.open_group(beside, mode="w", attributes=attributes)
        squeeze = [zarr.codecs.ZstdCodec(level=1), zarr.codecs.Crc32cCodec()]
        for name in _ARRAYS:
            array = getattr(part, name)
            chunk = array.shape if name == "theta_d" else (1, *array.shape[1:])
            # a chunk that is always there is one whose loss can be noticed
            group.create_array(
                name, data=array, chunks=chunk, compressors=squeeze, config={"write_empty_chunks": True}
            )


def read_slice(path: str | Path) -> Slice:
    """Read a slice; raises `InputError` if it is missing or damaged."""
    group = _opened(path)
    angle_deg, bands_nm = _header(path, group)
    arrays = {name: _content(path, group, name) for name in _ARRAYS}
    grid = (len(bands_nm), *arrays["theta_d"].shape)
    for name, shape in (("mueller", (*grid, 4, 4)), ("variance", (*grid, 4, 4)), ("count", grid)):
        if arrays[name].shape != shape:
            problem = f"has shape {arrays[name].shape} where bands and nodes say {shape}"
            raise InputError(path, name, problem, _MAKE_AGAIN)
    return Slice(angle_deg, bands_nm, **arrays)


class SliceFile:
    """A slice on the disk, of which one band at a time is read.

    Attributes
    ----------
    path : str or Path
    angle_deg : float
        Angle of the arm.
    bands_nm : tuple of int
    theta_d : ndarray, shape (H, P), float64
        As in `Slice`.

    Raises
    ------
    InputError
        If the slice is missing or damaged; so do its methods.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = path
        self._group = _opened(path)
        self.angle_deg, self.bands_nm = _header(path, self._group)
        self.theta_d: Float = _content(path, self._group, "theta_d")

    def band(self, index: int) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.uint16]]:
        """Mueller matrices, variances (H, P, 4, 4) and count (H, P) of one band."""
        mueller, variance, count = (
            _content(self.path, self._group, name, index) for name in ("mueller", "variance", "count")
        )
        grid = self.theta_d.shape
        for name, array, shape in (
            ("mueller", mueller, (*grid, 4, 4)),
            ("variance", variance, (*grid, 4, 4)),
            ("count", count, grid),
        ):
            if array.shape != shape:
                problem = f"has shape {array.shape} a band where its nodes say {shape}"
                raise InputError(self.path, name, problem, _MAKE_AGAIN)
        return mueller, variance, count


def _opened(path: str | Path) -> zarr.Group:
    try:
        group = zarr.open_group(Path(path), mode="r", zarr_format=3)
    # JSON and Zarr's metadata raise many types
    except Exception as error:
        raise InputError(path, "store", f"cannot be opened ({error})", _MAKE_AGAIN) from None
    if group.attrs.get("schema") != SCHEMA:
        raise InputError(path, "schema", f"is not {SCHEMA}", _MAKE_AGAIN)
    return group


def _header(path: str | Path, group: zarr.Group) -> tuple[float, tuple[int, ...]]:
    """Angle of the arm and bands."""
    angle_deg, bands_nm = group.attrs.get("angle_deg"), group.attrs.get("bands_nm")
    if not isinstance(angle_deg, int | float) or not np.isfinite(angle_deg):
        raise InputError(path, "angle_deg", f"is {angle_deg}, not an angle", _MAKE_AGAIN)
    if not isinstance(bands_nm, list) or not all(isinstance(nm, int) for nm in bands_nm):
        raise InputError(path, "bands_nm", f"is {bands_nm}, not a list of whole nm", _MAKE_AGAIN)
    return float(angle_deg), tuple(bands_nm)


def _content(path: str | Path, group: zarr.Group, name: str, band: int | None = None) -> NDArray[Any]:
    """Values of an array whose chunks are all there, all or those of one band."""
    try:
        array = group[name]
        if not isinstance(array, zarr.Array):
            raise TypeError("not an array")
        require_backed(array, Path(path) / name)
        lost = array.nchunks - array.nchunks_initialized
        content: NDArray[Any] = np.asarray(array[...] if band is None else array[band])
    # a missing array, JSON, Zarr's metadata, the codec and the checksum each raise a type of their own
    except Exception as error:
        problem = f"is damaged ({type(error).__name__}: {error})"
        raise InputError(path, name, problem, _MAKE_AGAIN) from error
    if lost:
        raise InputError(path, name, f"has lost {lost} of {array.nchunks} chunks", _MAKE_AGAIN)
    return content
