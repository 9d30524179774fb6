"""Mirror images and exchanged directions: what they say of a node that was measured, and of one that was not.

An isotropic surface without handedness looks the same in a mirror, M(−φd) = Q M(φd) Q with
Q = diag(1, 1, −1, −1), and light and camera may change places, M(φd ± π) = P M(φd)ᵀ P with
P = diag(1, 1, −1, 1) (van de Hulst, *Light Scattering by Small Particles*, chapter 5). Up to four nodes
of one θh and θd hold the same matrix. At θh = 0 all azimuths do, and are one photograph of one point.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pbrdf._kernels import symmetry
from pbrdf.errors import InputError
from pbrdf.formats.table_data import Origin
from pbrdf.optics.rusinkiewicz import cosines
from pbrdf.tabulation.axes import Axes
from pbrdf.tabulation.band import Band

Float = NDArray[np.float64]

MIRROR = np.array([1.0, 1.0, -1.0, -1.0])
EXCHANGE = np.array([1.0, 1.0, -1.0, 1.0])
_EVEN = 1e-6


def is_circle(axes: Axes) -> bool:
    """Whether azimuths run evenly from −π to π, both ends stored."""
    even = np.linspace(-np.pi, np.pi, len(axes.phi_d))
    return len(axes.phi_d) > 2 and bool(np.abs(axes.phi_d - even).max() < _EVEN)


def require_circle(axes: Axes, source: str) -> None:
    """Refuse azimuths that do not run evenly from −π to π (`InputError`)."""
    if not is_circle(axes):
        remedy = "give nodes of φd from −180° to 180°, both included"
        raise InputError(source, "phi_d", "does not run evenly around", remedy)


def pool_symmetric(band: Band) -> None:
    """Use partners as extra measurements: nodes of one matrix get the weighted mean of what was measured.

    A measurement weighs its pixels times n·L, to which the variance of photon noise is inversely
    proportional. The variances measured are no weights: where light happens to be dim, so are they, and
    the mean would be too dark. Pixels add; variances are those of a weighted mean of independent elements. An
    element of which symmetry makes zero keeps the variance of its measurement. Nodes that were not
    measured, but whose partner was, get the mean too.
    """
    axes = band.axes
    cos_light, _ = cosines(axes.theta_h[:, None, None], axes.theta_d[:, None], axes.phi_d)
    _settle_pole(band, symmetric=True)
    symmetry.pool(band.mueller, band.variance, band.count, band.origin, np.maximum(cos_light, 0.0))


def copy_symmetric(band: Band) -> None:
    """Fill unseen nodes from a measured partner: the mirror image, else the exchange, else both."""
    _settle_pole(band, symmetric=False)
    symmetry.copy(band.mueller, band.variance, band.count, band.origin)


def _settle_pole(band: Band, *, symmetric: bool) -> None:
    """Make θh = 0 constant in φd: the mean, weighted by pixels, with the variance of one measurement."""
    if band.axes.theta_h[0] != 0.0:
        return
    for d in range(len(band.axes.theta_d)):
        measured = band.origin[0, d, :-1] == Origin.MEASURED
        if not measured.any():
            continue
        pixels = band.count[0, d, :-1][measured].astype(np.float64)
        weights = pixels / pixels.sum() if pixels.any() else np.full(len(pixels), 1 / len(pixels))
        mueller, variance = (
            np.tensordot(weights, array[0, d, :-1][measured], 1) for array in (band.mueller, band.variance)
        )
        if symmetric:
            mueller, variance = _symmetric_matrix(mueller, variance)
        band.mueller[0, d], band.variance[0, d] = mueller, variance
        band.count[0, d] = int(pixels.max())
        band.origin[0, d] = Origin.MEASURED


def _symmetric_matrix(mueller: Float, variance: Float) -> tuple[Float, Float]:
    """Mean of a matrix over both symmetries, which leave it as it is, and the variance of that mean."""
    mirrored = 0.5 * (mueller + mueller * np.outer(MIRROR, MIRROR))
    mean = 0.5 * (mirrored + mirrored.T * np.outer(EXCHANGE, EXCHANGE))
    spread = 0.25 * (variance + variance.T)
    np.fill_diagonal(spread, np.diag(variance))
    return mean, spread
