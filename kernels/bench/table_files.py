"""A table of the paper's size to and from the disk: our Zarr read, Mitsuba's file written.

`table-read` reads all matrices of the Zarr table; its peer is NumPy reading the same bytes from one file, its
limit a gigabyte a second. Both fill new memory, which a virtual machine may first have to get from its
host (seen: 0.4 GB/s for memory alone), hence three readings in a row. `pbsdf-write` is held against a plain
copy of its file. The cache is warm; the files (4 GB) lie in a temporary folder and go again.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import zarr

from bench.measure import interleaved, peak_mb, row
from pbrdf.formats.pbsdf import write_pbsdf
from pbrdf.formats.table_data import TableData
from pbrdf.formats.table_zarr import write_table
from pbrdf.tabulation.axes import table_axes

BANDS_NM = (450.0, 500.0, 550.0, 600.0, 650.0)
BYTES_A_SECOND = 1e9
ROUNDS = 3


def run() -> list[dict[str, Any]]:
    """Rows `table-read`, `table-node` (one matrix of an open table; limit 20 ms) and `pbsdf-write`."""
    table = noisy_table()
    with tempfile.TemporaryDirectory() as folder:
        store, plain = Path(folder) / "table.zarr", Path(folder) / "table.npy"
        ours, copied = Path(folder) / "table.pbsdf", Path(folder) / "copy.pbsdf"
        write_table(store, table, {})
        np.save(plain, table.mueller)
        matrices = zarr.open_group(store, mode="r")["mueller"]
        assert isinstance(matrices, zarr.Array)
        # what the kernel has still to write would be measured as ours
        os.sync()
        seconds = interleaved(
            {
                "read": (lambda: matrices[...], 3),
                "node": (lambda: matrices[2, 40, 30, 100], 5),
                "plain": (lambda: np.load(plain), 3),
            },
            ROUNDS,
        )
        seconds |= interleaved(
            {
                "write": (lambda: write_pbsdf(ours, table), 1),
                "copy": (lambda: shutil.copyfile(ours, copied), 1),
            },
            ROUNDS,
        )
    rows = (
        ("table-read", "read", "numpy.load", "plain", table.mueller.nbytes / BYTES_A_SECOND),
        ("table-node", "node", "numpy.load of the table", "plain", 0.02),
        ("pbsdf-write", "write", "copy of the file", "copy", seconds["copy"]),
    )
    return [
        row(name, ours_s=seconds[key], peer=peer, peer_s=seconds[other], limit_s=limit, peak_mb=peak_mb())
        for name, key, peer, other, limit in rows
    ]


def noisy_table() -> TableData:
    """Five bands of the published grid, with a lobe that falls with θh and 1 % of noise."""
    axes = table_axes()
    random = np.random.default_rng(1)
    lobe = np.exp(-((axes.theta_h / 0.3) ** 2)).astype(np.float32)[:, None, None, None]
    slab = lobe * (1 + 0.01 * random.normal(size=(91, 361, 4, 4)).astype(np.float32))
    mueller = np.empty((len(BANDS_NM), *axes.shape, 4, 4), np.float32)
    for band in range(len(BANDS_NM)):
        for d in range(axes.shape[1]):
            mueller[band, :, d] = np.roll(slab, 7 * d + band, axis=1)
    return TableData("bench", np.array(BANDS_NM), axes.theta_h, axes.theta_d, axes.phi_d, mueller)
