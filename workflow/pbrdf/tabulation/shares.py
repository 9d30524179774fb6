"""Shares of single lights in a table: matrices of bins that no other light gives, and their file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.formats.table_data import Origin
from pbrdf.tabulation.axes import Axes
from pbrdf.tabulation.band import Band, possible_nodes
from pbrdf.tabulation.light_store import LightStore, StoreKind, write_store

KIND = StoreKind("pbrdf/share/2", "share", shared=("nodes", "shape"))


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
    arrays = {name: getattr(share, name) for name in ("nodes", "mueller", "variance", "count")}
    arrays["shape"] = np.array(share.shape, np.int64)
    write_store(path, KIND, share.angle_deg, share.bands_nm, arrays)


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
        If the share is missing or damaged, or its nodes are none of its table's; so does its method.
    """

    def __init__(self, path: str | Path) -> None:
        self._store = LightStore(path, KIND)
        self.path, self.angle_deg, self.bands_nm = path, self._store.angle_deg, self._store.bands_nm
        self.nodes: NDArray[np.int64] = self._store.content("nodes")
        halves, differences, azimuths = self._lengths()
        self.shape = halves, differences, azimuths
        if self.nodes.ndim != 1 or np.any((self.nodes < 0) | (self.nodes >= np.prod(self.shape))):
            raise self._store.refusal("nodes", f"are not those of a table of {self.shape}")

    def _lengths(self) -> list[int]:
        lengths = self._store.content("shape")
        if lengths.shape != (3,):
            raise self._store.refusal("shape", f"has {lengths.size} numbers, not 3")
        return [int(length) for length in lengths]

    def band(self, index: int) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.uint16]]:
        """Mueller matrices, variances (n, 4, 4) and count (n,) of one band."""
        return self._store.band(index, self.nodes.shape)


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
