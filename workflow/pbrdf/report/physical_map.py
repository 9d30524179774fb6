"""Which nodes of a table hold physical Mueller matrices."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from pbrdf.formats.table_data import TableData
from pbrdf.reconstruction.physicality import coherency_eigenvalues
from pbrdf.report.coverage_maps import mean_over_phi, node_map
from pbrdf.report.figures import Float, Picture, number, picture
from pbrdf.report.scales import from_zero
from pbrdf.report.table_view import filled_nodes
from pbrdf.report.visibility import visible_nodes

_ROUNDING = 1e-6
"""A Jones matrix in float32 may come out with an eigenvalue this far below zero, of M00."""
_CERTAIN = 2.0
"""Standard errors by which an eigenvalue must lie below zero to be no noise."""


def physicality_view(table: TableData, shown: int) -> dict[str, Any]:
    """Gather what the page shows of physicality: figures of each band, and a map of one.

    An eigenvalue of the coherency matrix below zero makes a matrix unphysical: no sum of Jones matrices has
    it. Where the table holds variances, one counts as certain if noise alone would bring it there in 2 %.
    """
    bands = []
    for band, wavelength in enumerate(table.wavelengths_nm):
        least, error = _least_eigenvalues(table, band)
        known = np.isfinite(least)
        unphysical = least[known] < -_ROUNDING
        certain = None
        if error is not None:
            certain = 100 * float(np.mean(least[known] < -_ROUNDING - _CERTAIN * error[known]))
        bands.append(
            {
                "wavelength": float(wavelength),
                "nodes": int(known.sum()),
                "physical_percent": 100 * (1 - float(np.mean(unphysical))) if known.any() else float("nan"),
                "certain_percent": certain if known.any() else None,
                "median": float(np.median(least[known])) if known.any() else float("nan"),
            }
        )
    return {"bands": bands, "of": _nodes(table), "picture": _map(table, shown)}


def _nodes(table: TableData) -> str:
    """Which nodes are judged: a table that tells no origins may hold filled ones among them."""
    return "measured nodes" if table.origin is not None else "known nodes with M00 above 0"


def _least_eigenvalues(table: TableData, band: int) -> tuple[Float, Float | None]:
    """Smallest eigenvalue over M00 at measured nodes, (H, D, P), and its standard error; NaN elsewhere."""
    mueller = table.mueller[band]
    first = mueller[..., 0, 0]
    used = visible_nodes(table, band) & ~filled_nodes(table, band) & (first > 0)
    least = np.full(first.shape, np.nan)
    error = None if table.variance is None else np.full(first.shape, np.nan)
    # slab by slab: a whole band and its eigenvalues need not be in memory twice
    for half in range(len(first)):
        at = used[half]
        scale = first[half][at].astype(np.float64)
        least[half][at] = coherency_eigenvalues(np.ascontiguousarray(mueller[half][at]))[:, 0] / scale
        if error is not None and table.variance is not None:
            # λ = ¼ Σ M_ij J_ij with Σ J_ij² = 4 for the eigenvector's Mueller matrix J
            mean = table.variance[band, half][at].mean(axis=(-2, -1), dtype=np.float64)
            error[half][at] = 0.5 * np.sqrt(mean) / scale
    return least, error


def _map(table: TableData, band: int) -> Picture:
    least, _ = _least_eigenvalues(table, band)
    known = np.isfinite(least)
    percent = mean_over_phi(np.where(least >= -_ROUNDING, 100.0, 0.0), known)
    visible = np.asarray(visible_nodes(table, band).any(axis=-1))
    scale = from_zero(100.0, f"physical matrices, % of the {_nodes(table)} over φd")
    nm = number(float(table.wavelengths_nm[band]), 4)

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        figure.subplots_adjust(left=0.12, right=0.975, top=0.88, bottom=0.3)
        figure.text(0.12, 0.975, f"Physicality at {nm} nm", fontsize=8.5, weight="bold", va="top")
        node_map(axes, scale.paint(percent, visible), table.theta_h, table.theta_d)
        box = axes.get_position()
        scale.draw_bar(figure, box.x0, 0.13, box.width, 0.03)

    text = f"Map over θh and θd at {nm} nm of the share of {_nodes(table)} whose matrix is physical"
    return picture((5.4, 4.4), draw, f"{text}{_middle(percent)}.")


def _middle(percent: Float) -> str:
    known = percent[np.isfinite(percent)]
    return f": median {number(float(np.median(known)))} %" if known.size else ": nothing known"
