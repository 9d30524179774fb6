"""Two tables in figures: by how much their Mueller matrices differ where both are known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.formats.documents import write_document
from pbrdf.formats.table_data import Origin, TableData
from pbrdf.models.table import Table
from pbrdf.optics.rusinkiewicz import directions
from pbrdf.optics.stokes import degree_of_linear_polarisation, of_unpolarised_light
from pbrdf.report.figures import Float
from pbrdf.report.visibility import visible_nodes

KIND = "table-comparison/1"
MOST_NODES = (46, 46, 91)
"""Nodes of θh, θd and φd that are looked at: a finer table is taken in steps."""

_SAME_BAND_NM = 0.5
_LEAST_THETA_D = 1e-6


@dataclass(frozen=True)
class BandDifference:
    """How one band of a table differs from another's.

    Attributes
    ----------
    wavelength_nm : float
    nodes : int
        Nodes known in both, no inpainted ones.
    scale : float
        Median of the other's M00 over the first's, a pure number.
    m00_percent : float
        Median of the absolute difference of M00, in % of the first's.
    m00_scaled_percent : float
        The same after the other has been divided by `scale`.
    elements_rms : tuple of 4 tuples of 4 floats
        Root mean square of the difference of Mij/M00, pure numbers; 0 for M00 itself.
    dolp_rms : float
        Root mean square of the difference of the DoLP that unpolarised light is given.
    """

    wavelength_nm: float
    nodes: int
    scale: float
    m00_percent: float
    m00_scaled_percent: float
    elements_rms: tuple[tuple[float, ...], ...]
    dolp_rms: float


def common_bands(first: TableData, other: TableData) -> list[int]:
    """Bands of the first table that the other has too; `InputError` if there is none."""
    nearest = np.abs(first.wavelengths_nm[:, None] - other.wavelengths_nm[None, :]).min(axis=1)
    bands = [int(band) for band in np.flatnonzero(nearest <= _SAME_BAND_NM)]
    if not bands:
        theirs = ", ".join(f"{nm:g}" for nm in first.wavelengths_nm)
        problem = f"has no band of {first.source} ({theirs} nm)"
        raise InputError(other.source, "wavelength", problem, "give tables that share a band")
    return bands


def at_nodes_of(
    first: TableData, other: TableData, band: int, nodes: tuple[NDArray[np.intp], ...]
) -> NDArray[np.floating]:
    """The other table's matrices at nodes of the first, shape (h, d, p, 4, 4), 1/sr.

    Read where the grids are the same, interpolated where not.

    Parameters
    ----------
    first, other : TableData
    band : int
        Of the first.
    nodes : tuple of three ndarrays
        Indices of θh, θd, φd of the first.
    """
    wavelength = first.wavelengths_nm[band]
    axes = ("theta_h", "theta_d", "phi_d")
    if all(_same_axis(getattr(first, name), getattr(other, name)) for name in axes):
        own = int(np.abs(other.wavelengths_nm - wavelength).argmin())
        read: NDArray[np.floating] = other.mueller[own][np.ix_(*nodes)]
        return read
    theta_h, theta_d, phi_d = (getattr(first, name)[at] for name, at in zip(axes, nodes, strict=True))
    grid = np.meshgrid(theta_h, np.maximum(theta_d, _LEAST_THETA_D), phi_d, indexing="ij")
    return Table(other).evaluate(*directions(*grid), wavelength)


def compare_tables(first: TableData, other: TableData) -> list[BandDifference]:
    """Compare the bands that two tables share; `InputError` if they share none, or no known node."""
    found = [_band_difference(first, other, band) for band in common_bands(first, other)]
    if not any(each.nodes for each in found):
        raise InputError(other.source, "mueller", f"is nowhere known where {first.source} is", "give others")
    return found


def write_comparison(
    path: str | Path, names: tuple[str, str], digests: Mapping[str, str], found: list[BandDifference]
) -> None:
    """Write a comparison as a document of schema ``pbrdf/table-comparison/1``."""
    content = {
        "of": f"{names[1]} - {names[0]}, where both are known",
        "tables": {"first": names[0], "other": names[1]},
        "inputs": dict(digests),
        "units": {"wavelength_nm": "nm", "m00_percent": "%", "elements_rms": "1", "dolp_rms": "1"},
        "bands": [asdict(band) for band in found if band.nodes],
    }
    write_document(path, KIND, content)


def looked_at(table: TableData) -> tuple[NDArray[np.intp], ...]:
    """Indices of the nodes of θh, θd, φd that a comparison looks at."""
    lengths = (len(table.theta_h), len(table.theta_d), len(table.phi_d))
    return tuple(
        np.arange(0, length, -(-length // most)) for length, most in zip(lengths, MOST_NODES, strict=True)
    )


def _band_difference(first: TableData, other: TableData, band: int) -> BandDifference:
    nodes = looked_at(first)
    grid = np.ix_(*nodes)
    ours = first.mueller[band][grid].astype(np.float64)
    theirs = at_nodes_of(first, other, band, nodes).astype(np.float64)
    used = visible_nodes(first, band)[grid] & (ours[..., 0, 0] > 0) & (theirs[..., 0, 0] > 0)
    used &= np.isfinite(ours).all(axis=(-2, -1)) & np.isfinite(theirs).all(axis=(-2, -1))
    if first.origin is not None:
        used &= first.origin[band][grid] != Origin.INPAINTED
    a, b = ours[used], theirs[used]
    wavelength = float(first.wavelengths_nm[band])
    if not len(a):
        nothing = float("nan")
        return BandDifference(wavelength, 0, nothing, nothing, nothing, ((nothing,) * 4,) * 4, nothing)
    ratio = b[:, 0, 0] / a[:, 0, 0]
    scale = float(np.median(ratio))
    difference = b / b[:, :1, :1] - a / a[:, :1, :1]
    dolp = [degree_of_linear_polarisation(of_unpolarised_light(m)) for m in (a, b)]
    return BandDifference(
        wavelength_nm=wavelength,
        nodes=len(a),
        scale=scale,
        m00_percent=float(100 * np.median(np.abs(ratio - 1))),
        m00_scaled_percent=float(100 * np.median(np.abs(ratio / scale - 1))),
        elements_rms=tuple(tuple(float(v) for v in row) for row in _rms(difference)),
        dolp_rms=float(_rms(dolp[1] - dolp[0])),
    )


def _rms(values: Float) -> Float:
    rms: Float = np.sqrt(np.mean(values**2, axis=0))
    return rms


def _same_axis(one: Float, two: Float) -> bool:
    # float32 at π resolves 2.4e-7 rad
    return one.shape == two.shape and bool(np.allclose(one, two, rtol=0, atol=1e-6))
