"""Whether measurements of one matrix agree: the best test of geometry and frames that a table holds.

Nodes that a mirror or an exchange of light and camera makes equal are measured by different pixels.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf._kernels import symmetry
from pbrdf.formats.documents import member, read_document, write_document
from pbrdf.tabulation.band import Band
from pbrdf.tabulation.symmetry import is_circle

Float = NDArray[np.float64]

DOCUMENT = "consistency/2"
KINDS = ("mirror", "exchange")
_SUMS = 50


def disagreement(band: Band) -> Float:
    """Sums over pairs of measured partners, before they are pooled.

    Returns
    -------
    ndarray, shape (H, D, 2, 50), float64
        For each θh and θd, mirror and exchange; they add, over nodes and bands. θh = 0, whose azimuths are
        one measurement, has none, nor has a table whose azimuths do not run evenly around.
    """
    sums = none_compared(len(band.axes.theta_h), len(band.axes.theta_d))
    if is_circle(band.axes):
        symmetry.compare(band.mueller, band.variance, band.origin, sums)
    return sums


def none_compared(halves: int, differences: int) -> Float:
    """What `disagreement` gives where there is nothing to compare."""
    return np.zeros((halves, differences, len(KINDS), _SUMS))


@dataclass
class Disagreements:
    """What the symmetries say of a table, gathered band by band.

    Attributes
    ----------
    theta_h, theta_d : ndarray, shape (H,) and (D,)
        Radians.
    sums : ndarray, shape (H, D, 2, 50)
        `disagreement` of all bands.
    by_band : dict of float to ndarray, shape (2, 50)
        Sum over the nodes of each band, by its wavelength in nm.
    """

    theta_h: Float
    theta_d: Float
    sums: Float = field(init=False)
    by_band: dict[float, Float] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        self.sums = none_compared(len(self.theta_h), len(self.theta_d))

    def add(self, wavelength_nm: float, of_band: Float) -> None:
        """Add the `disagreement` of a band."""
        self.sums += of_band
        self.by_band[wavelength_nm] = of_band.sum(axis=(0, 1))


def write_consistency(path: str | Path, found: Disagreements, *, pooled: bool) -> None:
    """Write what the symmetries say of a table: along θd, band by band, and node by node.

    Parameters
    ----------
    path : str or Path
    found : Disagreements
    pooled : bool
        Whether the table holds means over partners.

    Notes
    -----
    ``pairs`` counts them; ``relative`` (16 elements) is the mean of |difference| over the mean of M00;
    ``standard_errors`` the root mean square of the difference in its standard errors, about 1 where noise
    alone makes it. By node, over φd and bands, stand those of M00 and over all elements, as rows of θh.
    None stands where nothing is known.
    """
    along = found.sums.sum(axis=0)
    content: dict[str, Any] = {
        "pooled": pooled,
        "theta_h_deg": np.degrees(found.theta_h).round(6).tolist(),
        "theta_d_deg": np.degrees(found.theta_d).round(6).tolist(),
    }
    for index, kind in enumerate(KINDS):
        rows = [_told(row) for row in along[:, index]]
        content[kind] = {
            "along_theta_d": {name: [row[name] for row in rows] for name in rows[0]},
            "by_band_nm": {f"{nm:g}": _told(band[index]) for nm, band in found.by_band.items()},
            "by_node": _told_by_node(found.sums[:, :, index]),
        }
    write_document(path, DOCUMENT, content)


def read_consistency(path: str | Path) -> dict[str, Any]:
    """Read a document of `write_consistency`; raises `InputError` if it is none."""
    content = read_document(path, DOCUMENT)
    for kind in KINDS:
        for name in ("pairs", "relative", "standard_errors"):
            member(path, content, f"{kind}.along_theta_d.{name}")
        for name in ("m00_relative", "standard_errors"):
            member(path, content, f"{kind}.by_node.{name}")
    return content


def _told(sums: Float) -> dict[str, Any]:
    pairs, m00, absolute, known, squares = sums[0], sums[1], sums[2:18], sums[18:34], sums[34:]
    with np.errstate(invalid="ignore", divide="ignore"):
        return {
            "pairs": int(pairs),
            "relative": _rounded(absolute / (0.5 * m00)),
            "standard_errors": _rounded(np.sqrt(squares / known)),
        }


def _told_by_node(sums: Float) -> dict[str, Any]:
    with np.errstate(invalid="ignore", divide="ignore"):
        relative = sums[..., 2] / (0.5 * sums[..., 1])
        errors = np.sqrt(sums[..., 34:].sum(axis=-1) / sums[..., 18:34].sum(axis=-1))
    return {
        "m00_relative": [_rounded(row) for row in relative],
        "standard_errors": [_rounded(row) for row in errors],
    }


def _rounded(values: Float) -> list[float | None]:
    """Four digits: a page shows no more."""
    return [float(f"{value:.4g}") if np.isfinite(value) else None for value in values]
