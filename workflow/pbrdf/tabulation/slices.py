"""What one light says of the table: a slice over θh and φd at nearly constant θd.

The camera and the light stand still during a light's photographs, so the half vector hardly changes
over the image, and every pixel shows nearly the same θd: one light is one slice.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pbrdf.tabulation.light_store import LightStore, StoreKind, write_store

KIND = StoreKind("pbrdf/slice/1", "slice", shared=("theta_d",))
_ARRAYS = ("mueller", "variance", "count", "theta_d")
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
    write_store(path, KIND, part.angle_deg, part.bands_nm, {name: getattr(part, name) for name in _ARRAYS})


def read_slice(path: str | Path) -> Slice:
    """Read a slice; raises `InputError` if it is missing or damaged."""
    stored = SliceFile(path)
    bands = [stored.band(index) for index in range(len(stored.bands_nm))]
    mueller, variance, count = (np.stack(arrays) for arrays in zip(*bands, strict=True))
    return Slice(stored.angle_deg, stored.bands_nm, mueller, variance, count, stored.theta_d)


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
        self._store = LightStore(path, KIND)
        self.path, self.angle_deg, self.bands_nm = path, self._store.angle_deg, self._store.bands_nm
        self.theta_d: Float = self._store.content("theta_d")

    def band(self, index: int) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.uint16]]:
        """Mueller matrices, variances (H, P, 4, 4) and count (H, P) of one band."""
        return self._store.band(index, self.theta_d.shape)
