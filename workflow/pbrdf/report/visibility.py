"""Which nodes of a table light and camera can see, and where their values come from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pbrdf.formats.table_data import Origin, TableData
from pbrdf.tabulation.band import possible_nodes

ORIGIN_NAMES = {
    Origin.NEVER_VISIBLE: "never visible",
    Origin.UNSEEN: "unseen",
    Origin.MEASURED: "measured",
    Origin.MIRRORED: "mirrored",
    Origin.RECIPROCAL: "reciprocal",
    Origin.INPAINTED: "inpainted",
}


@dataclass(frozen=True)
class Coverage:
    """How much of a table is known, over all its bands.

    Attributes
    ----------
    visible : int
        Nodes with light and camera above the horizon.
    known : float
        Share of them that holds finite values.
    origins : dict of Origin to float
        Share of each origin among the visible nodes; empty where the table does not tell.
    """

    visible: int
    known: float
    origins: dict[Origin, float]

    @property
    def headline(self) -> tuple[float, str]:
        """Share for the verdict, and what it is a share of: measured nodes, or known ones."""
        if self.origins:
            return self.origins[Origin.MEASURED], "measured"
        return self.known, "known"


def visible_nodes(table: TableData, band: int) -> NDArray[np.bool_]:
    """Nodes of a band that can be seen, shape (H, D, P): by the table's origin map, else by geometry."""
    if table.origin is not None:
        return np.asarray(table.origin[band] != Origin.NEVER_VISIBLE)
    return possible_nodes(table)


def coverage(table: TableData) -> Coverage:
    """Count a table's known nodes and their origins."""
    visible = known = 0
    counted = np.zeros(len(Origin), dtype=np.int64)
    for band in range(len(table.wavelengths_nm)):
        seen = visible_nodes(table, band)
        visible += int(np.count_nonzero(seen))
        known += int(np.count_nonzero(np.isfinite(table.mueller[band, ..., 0, 0]) & seen))
        if table.origin is not None:
            counted += np.bincount(table.origin[band][seen], minlength=len(Origin))[: len(Origin)]
    share = 1.0 / max(visible, 1)
    origins: dict[Origin, float] = {}
    if table.origin is not None:
        origins = {o: float(counted[o] * share) for o in Origin if o is not Origin.NEVER_VISIBLE}
    return Coverage(visible, known * share, origins)
