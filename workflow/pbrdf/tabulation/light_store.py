"""What one light says of a table, on the disk: a Zarr store of arrays by band and of some for all bands."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import zarr
import zarr.codecs
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.formats.folders import replace_folder
from pbrdf.formats.zarr_claims import require_backed, require_sealed, seal


@dataclass(frozen=True)
class StoreKind:
    """What lies in a store.

    Attributes
    ----------
    schema, what : str
        Its schema, and what messages call it.
    shared : tuple of str
        Names of the arrays that hold for all bands; the others have a band's values in each row.
    """

    schema: str
    what: str
    shared: tuple[str, ...]

    @property
    def remedy(self) -> str:
        """What to do about a damaged one."""
        return f"make the {self.what} again"


def write_store(
    path: str | Path,
    kind: StoreKind,
    angle_deg: float,
    bands_nm: tuple[int, ...],
    arrays: Mapping[str, NDArray[Any]],
) -> None:
    """Write a store beside its place, then rename it there."""
    with replace_folder(path) as beside:
        attributes: dict[str, Any] = {
            "schema": kind.schema,
            "angle_deg": angle_deg,
            "bands_nm": list(bands_nm),
        }
        group = zarr.open_group(beside, mode="w", attributes=attributes)
        squeeze = [zarr.codecs.ZstdCodec(level=1), zarr.codecs.Crc32cCodec()]
        for name, array in arrays.items():
            # a store has no chunks without length
            whole = tuple(max(length, 1) for length in array.shape)
            chunk = whole if name in kind.shared else (1, *whole[1:])
            # a chunk that is always there is one whose loss can be noticed
            group.create_array(
                name, data=array, chunks=chunk, compressors=squeeze, config={"write_empty_chunks": True}
            )
        seal(group, beside)


class LightStore:
    """A store that `write_store` has written, of which one array at a time is read.

    Attributes
    ----------
    path : str or Path
    kind : StoreKind
    angle_deg : float
        Angle of the arm.
    bands_nm : tuple of int

    Raises
    ------
    InputError
        If it is missing, damaged or of another kind; so do its methods.
    """

    def __init__(self, path: str | Path, kind: StoreKind) -> None:
        self.path, self.kind = path, kind
        try:
            self._group = zarr.open_group(Path(path), mode="r", zarr_format=3)
        # JSON and Zarr's metadata raise many types
        except Exception as error:
            raise self.refusal("store", f"cannot be opened ({error})") from None
        attributes = self._group.attrs
        if attributes.get("schema") != kind.schema:
            raise self.refusal("schema", f"is not {kind.schema}")
        angle_deg, bands_nm = attributes.get("angle_deg"), attributes.get("bands_nm")
        if not isinstance(angle_deg, int | float) or not np.isfinite(angle_deg):
            raise self.refusal("angle_deg", f"is {angle_deg}, not an angle")
        if not isinstance(bands_nm, list) or not all(isinstance(nm, int) for nm in bands_nm):
            raise self.refusal("bands_nm", f"is {bands_nm}, not a list of whole nm")
        self.angle_deg, self.bands_nm = float(angle_deg), tuple(bands_nm)

    def refusal(self, field: str, problem: str) -> InputError:
        """Build the error that names this store and its remedy."""
        return InputError(self.path, field, problem, self.kind.remedy)

    def content(self, name: str, band: int | None = None) -> NDArray[Any]:
        """Values of an array whose chunks are all there, all or those of one band."""
        try:
            array = self._group[name]
            if not isinstance(array, zarr.Array):
                raise TypeError("not an array")
            require_backed(array, Path(self.path) / name)
            lost = array.nchunks - array.nchunks_initialized
            content: NDArray[Any] = np.asarray(array[...] if band is None else array[band])
        # a missing array, JSON, Zarr's metadata, the codec and the checksum each raise a type of their own
        except Exception as error:
            raise self.refusal(name, f"is damaged ({type(error).__name__}: {error})") from error
        if lost:
            raise self.refusal(name, f"has lost {lost} of {array.nchunks} chunks")
        if name not in self.kind.shared and array.shape[:1] != (len(self.bands_nm),):
            raise self.refusal(name, f"has shape {array.shape} where there are {len(self.bands_nm)} bands")
        return content

    def _require_written(self) -> None:
        """Refuse metadata that are possible and not those that were written."""
        try:
            require_sealed(Path(self.path))
        except ValueError as error:
            raise self.refusal("zarr.json", f"is damaged ({error})") from None

    def band(
        self, index: int, nodes: tuple[int, ...]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.uint16]]:
        """Mueller matrices, variances (…, 4, 4) and count (…) of one band, over `nodes`."""
        mueller, variance, count = (self.content(name, index) for name in ("mueller", "variance", "count"))
        for name, array, shape in (
            ("mueller", mueller, (*nodes, 4, 4)),
            ("variance", variance, (*nodes, 4, 4)),
            ("count", count, nodes),
        ):
            if array.shape != shape:
                raise self.refusal(name, f"has shape {array.shape} a band where its nodes say {shape}")
        self._require_written()
        return mueller, variance, count
