"""Whether measurements of one matrix agree: the best test of geometry and frames that a table holds.

Nodes that a mirror or an exchange of light and camera makes equal are measured by different pixels.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf._kernels import symmetry
from pbrdf.formats.documents import member, read_document, write_document
from pbrdf.tabulation.band import Band

Float = NDArray[np.float64]

DOCUMENT = "consistency/1"
KINDS = ("mirror", "exchange")
_SUMS = 50


def disagreement(band: Band) -> Float:
    """Sums over pairs of measured partners, before they are pooled.

    Returns
    -------
    ndarray, shape (D, 2, 50), float64
        For each θd, mirror and exchange; bands add. θh = 0, whose azimuths are one measurement, is left out.
    """
    sums = np.empty((len(band.axes.theta_d), len(KINDS), _SUMS))
    symmetry.compare(band.mueller, band.variance, band.origin, sums)
    return sums


def none_compared(differences: int) -> Float:
    """What `disagreement` gives where there is nothing to compare."""
    return np.zeros((differences, len(KINDS), _SUMS))


def write_consistency(
    path: str | Path, sums: Sequence[Float], bands_nm: Sequence[float], theta_d: Float, *, pooled: bool
) -> None:
    """Write what the symmetries say of a table, along θd and band by band.

    Parameters
    ----------
    path : str or Path
    sums : sequence of ndarray
        `disagreement` of each band.
    bands_nm : sequence of float
    theta_d : ndarray, shape (D,)
        Radians.
    pooled : bool
        Whether the table holds means over partners.

    Notes
    -----
    ``pairs`` counts them; ``relative`` (16 elements) is the mean of |difference| over the mean of M00;
    ``standard_errors`` the root mean square of the difference in its standard errors, about 1 where noise
    alone makes it. None stands where nothing is known.
    """
    along = np.sum(sums, axis=0)
    content: dict[str, Any] = {"pooled": pooled, "theta_d_deg": np.degrees(theta_d).round(6).tolist()}
    for index, kind in enumerate(KINDS):
        by_band = {
            f"{nm:g}": _told(band[:, index].sum(axis=0)) for nm, band in zip(bands_nm, sums, strict=True)
        }
        rows = [_told(row) for row in along[:, index]]
        content[kind] = {
            "along_theta_d": {name: [row[name] for row in rows] for name in rows[0]},
            "by_band_nm": by_band,
        }
    write_document(path, DOCUMENT, content)


def read_consistency(path: str | Path) -> dict[str, Any]:
    """Read a document of `write_consistency`; raises `InputError` if it is none."""
    content = read_document(path, DOCUMENT)
    for kind in KINDS:
        for field in ("pairs", "relative", "standard_errors"):
            member(path, content, f"{kind}.along_theta_d.{field}")
    return content


def _told(sums: Float) -> dict[str, Any]:
    pairs, m00, absolute, known, squares = sums[0], sums[1], sums[2:18], sums[18:34], sums[34:]
    with np.errstate(invalid="ignore", divide="ignore"):
        return {
            "pairs": int(pairs),
            "relative": _rounded(absolute / (0.5 * m00)),
            "standard_errors": _rounded(np.sqrt(squares / known)),
        }


def _rounded(values: Float) -> list[float | None]:
    """Four digits: a page shows no more."""
    return [float(f"{value:.4g}") if np.isfinite(value) else None for value in values]
