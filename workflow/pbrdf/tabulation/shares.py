"""Shares of single lights in a table: matrices of bins that no other light gives, and their file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
import zarr
import zarr.codecs
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.formats.folders import replace_folder
from pbrdf.formats.table_data import Origin
from pbrdf.tabulation.axes import Axes
from pbrdf.tabulation.band import Band, possible_nodes

SCHEMA = "pbrdf/share/1"
_ARRAYS = ("nodes", "mueller", "variance", "count")
_MAKE_AGAIN = "make the share again"


@dataclass(frozen=True)
class Share:
    """What one light gives to a table, as the supplement divides it.

    Attributes
    ----------
    angle_deg : float
        Angle of the arm.
    bands_nm : tuple of int
    shape : tuple of int
        Numbers of nodes of θh, θd, φd of the table.
    nodes : ndarray, shape (n,), int64
        Flat indices of the nodes, ascending.
    mueller, variance : ndarray, shape (B, n, 4, 4), float32
        1/sr, table frames; NaN where the photograph does not show the node.
    count : ndarray, shape (B, n), uint16
        Pixels behind each.
    """

    angle_deg: float
    bands_nm: tuple[int, ...]
    shape: tuple[int, int, int]
    nodes: NDArray[np.int64]
    mueller: NDArray[np.float32]
    variance: NDArray[np.float32]
    count: NDArray[np.uint16]


def write_share(path: str | Path, share: Share) -> None:
    """Write a share as a Zarr store, beside and then renamed."""
    with replace_folder(path) as beside:
        attributes: dict[str, Any] = {
            "schema": SCHEMA,
            "angle_deg": share.angle_deg,
            "bands_nm": list(share.bands_nm),
            "shape": list(share.shape),
        }
        group = zarr.open_group(beside, mode="w", attributes=attributes)
        squeeze = [zarr.codecs.ZstdCodec(level=1), zarr.codecs.Crc32cCodec()]
        for name in _ARRAYS:
            array = getattr(share, name)
            # a store has no chunks without length
            whole = tuple(max(length, 1) for length in array.shape)
            chunk = whole if name == "nodes" else (1, *whole[1:])
            group.create_array(
                name, data=array, chunks=chunk, compressors=squeeze, config={"write_empty_chunks": True}
            )


class ShareFile:
    """A share on the disk, of which one band at a time is read.

    Attributes
    ----------
    path : str or Path
    angle_deg, bands_nm, shape, nodes
        As in `Share`.

    Raises
    ------
    InputError
        If the share is missing or damaged; so does its method.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = path
        with _damage_told(path):
            self._group = cast(Any, zarr.open_group(Path(path), mode="r"))
            attributes: dict[str, Any] = dict(self._group.attrs)
        if attributes.get("schema") != SCHEMA:
            raise InputError(path, "schema", f"is not {SCHEMA}", _MAKE_AGAIN)
        with _damage_told(path):
            self.angle_deg = float(attributes["angle_deg"])
            self.bands_nm: tuple[int, ...] = tuple(attributes["bands_nm"])
            self.shape: tuple[int, int, int] = tuple(attributes["shape"])
            self.nodes: NDArray[np.int64] = np.asarray(self._group["nodes"][...])

    def band(self, index: int) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.uint16]]:
        """Mueller matrices, variances (n, 4, 4) and count (n,) of one band."""
        with _damage_told(self.path):
            mueller, variance, count = (
                np.asarray(self._group[name][index]) for name in ("mueller", "variance", "count")
            )
        return mueller, variance, count


def open_shares(paths: Sequence[str | Path], axes: Axes, source: str) -> list[ShareFile]:
    """Shares of a table.

    Parameters
    ----------
    paths : sequence of paths
    axes : Axes
        Nodes of the table.
    source : str
        What the table is called in messages.

    Raises
    ------
    InputError
        If there is none, one is damaged, or they differ in bands or nodes.
    """
    if not paths:
        raise InputError(source, "shares", "there are none", "photograph some lights")
    shares = [ShareFile(path) for path in paths]
    for share in shares:
        if (share.bands_nm, share.shape) != (shares[0].bands_nm, axes.shape):
            problem = f"has bands {share.bands_nm} nm and nodes {share.shape}, unlike the table"
            raise InputError(share.path, "bands_nm, shape", problem, "make it again with one config")
    return shares


def merge_shares(shares: Sequence[ShareFile], index: int, axes: Axes) -> Band:
    """One band of a table, share by share; NaN where no photograph shows a node."""
    mueller, variance = np.full((2, int(np.prod(axes.shape)), 4, 4), np.nan, np.float32)
    count = np.zeros(int(np.prod(axes.shape)), np.uint16)
    for share in shares:
        mueller[share.nodes], variance[share.nodes], count[share.nodes] = share.band(index)
    count = count.reshape(axes.shape)
    origin = np.full(axes.shape, Origin.NEVER_VISIBLE, np.uint8)
    origin[possible_nodes(axes)] = Origin.UNSEEN
    origin[count > 0] = Origin.MEASURED
    whole = (*axes.shape, 4, 4)
    return Band(axes, mueller.reshape(whole), variance.reshape(whole), count, origin)


@contextmanager
def _damage_told(path: str | Path) -> Iterator[None]:
    """Tell in a line what store, array, JSON, codec and checksum each raise in a type of their own."""
    try:
        yield
    except Exception as error:
        problem = f"is damaged ({type(error).__name__}: {error})"
        raise InputError(path, "share", problem, _MAKE_AGAIN) from error
