"""What the Mueller matrices of an image say, one number a pixel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pbrdf.optics import stokes
from pbrdf.reconstruction.decomposition import lu_chipman
from pbrdf.reconstruction.physicality import coherency_eigenvalues, is_physical, nearest_physical
from pbrdf.report.figures import Float

CERTAIN = 3.0
"""Standard errors above zero from which on a length is taken for real, and its angle drawn."""


@dataclass(frozen=True)
class ScalarMaps:
    """Numbers drawn from Mueller matrices, each of shape (rows, cols), float64, NaN where missing.

    Those of light and the eigenvalue are of the matrices as measured. Those of the decomposition are
    of the nearest physical matrices: the same where the matrix is physical.

    Attributes
    ----------
    dolp, docp : ndarray
        Degree of linear and of circular polarisation of the light that comes back when unpolarised
        light falls in. Noise may bring them above one.
    aolp : ndarray
        Angle of linear polarisation of that light, radians in [0, π), in the analyser's frame.
    dolp_error : ndarray
        Standard error of `dolp`; NaN too where the variances are.
    depolarisation : ndarray
        Lu and Chipman's power Δ: 0 for a mirror, 1 for an ideal depolariser.
    depolarisation_index : ndarray
        Gil and Bernabeu's: 1 for a mirror, 0 for an ideal depolariser.
    diattenuation : ndarray
        Lu and Chipman's D.
    retardance : ndarray
        Lu and Chipman's R, radians in [0, π].
    smallest_eigenvalue : ndarray
        Of the coherency matrix, divided by M00: negative where the matrix is not physical.
    eigenvalue_error : ndarray
        Standard error of an eigenvalue, the noise of all elements being alike; NaN too where the
        variances are.
    physical : ndarray, bool
        Whether the smallest eigenvalue is not negative beyond rounding; False where missing.
    aolp_weak, retardance_weak : ndarray, bool
        Where the angle is noise: `dolp`, or what the depolariser keeps of one direction of the Poincaré
        sphere, is not above `CERTAIN` standard errors. False where missing, and everywhere where the
        variances are not known.
    """

    dolp: Float
    aolp: Float
    docp: Float
    dolp_error: Float
    depolarisation: Float
    depolarisation_index: Float
    diattenuation: Float
    retardance: Float
    smallest_eigenvalue: Float
    eigenvalue_error: Float
    physical: NDArray[np.bool_]
    aolp_weak: NDArray[np.bool_]
    retardance_weak: NDArray[np.bool_]

    @property
    def known(self) -> NDArray[np.bool_]:
        """Pixels that have a matrix, with light in it."""
        return np.isfinite(self.dolp)

    def share_of_known(self, mask: NDArray[np.bool_]) -> float:
        """Share of the known pixels at which a mask holds; NaN if none is known."""
        count = int(np.count_nonzero(self.known))
        return int(np.count_nonzero(mask & self.known)) / count if count else float("nan")


def scalar_maps(mueller: NDArray[np.floating], variance: NDArray[np.floating]) -> ScalarMaps:
    """Decompose an image.

    Parameters
    ----------
    mueller, variance : ndarray, shape (rows, cols, 4, 4)
        Elements and their variances, in any one unit. A pixel is missing where an element is not
        finite or M00 is not positive. Where variances are NaN, nothing counts as weak.
    """
    known = np.isfinite(mueller).all(axis=(-2, -1)) & (mueller[..., 0, 0] > 0)
    scale = np.where(known, mueller[..., 0, 0], np.nan)[..., None, None]
    # planes of elements, as images are stored, would be copied for every kernel
    relative = np.divide(mueller, scale, order="C")
    relative_variance = variance / scale**2

    light = stokes.of_unpolarised_light(relative)
    dolp = stokes.degree_of_linear_polarisation(light)
    dolp_error = _dolp_error(light, relative_variance[..., :, 0].astype(np.float64))
    decomposed = lu_chipman(nearest_physical(relative))
    element_error = np.sqrt(relative_variance[..., 1:, 1:].mean(axis=(-2, -1)))
    return ScalarMaps(
        dolp=dolp,
        aolp=stokes.angle_of_linear_polarisation(light),
        docp=stokes.degree_of_circular_polarisation(light),
        dolp_error=dolp_error,
        depolarisation=decomposed.depolarisation_power.astype(np.float64),
        depolarisation_index=decomposed.depolarisation_index.astype(np.float64),
        diattenuation=decomposed.diattenuation.astype(np.float64),
        retardance=decomposed.retardance.astype(np.float64),
        smallest_eigenvalue=coherency_eigenvalues(relative)[..., 0].astype(np.float64),
        # λ = ¼ Σ M_ij J_ij with J the Mueller matrix of the eigenvector, and Σ J_ij² = 4 for J_00 = 1
        eigenvalue_error=0.5 * np.sqrt(relative_variance.mean(axis=(-2, -1), dtype=np.float64)),
        physical=is_physical(relative),
        # comparisons with NaN are False: nothing is weak where the noise is not known
        aolp_weak=dolp <= CERTAIN * dolp_error,
        # a singular value that may have either sign takes a mirror's retarder for none
        retardance_weak=_least_kept(decomposed.depolariser[..., 1:, 1:]) <= CERTAIN * element_error,
    )


def _dolp_error(light: Float, variance: Float) -> Float:
    """First-order standard error of √(s1² + s2²) / s0, for s0 = 1 and uncorrelated components.

    Where nothing is polarised, that of a component in the mean of the two directions.
    """
    square = light[..., 1] ** 2 + light[..., 2] ** 2
    along = np.full(square.shape, 0.5)
    np.divide(light[..., 1] ** 2, square, out=along, where=square > 0)
    linear = along * variance[..., 1] + (1 - along) * variance[..., 2]
    error: Float = np.sqrt(linear + square * variance[..., 0])
    return error


def _least_kept(depolariser: NDArray[np.floating]) -> NDArray[np.floating]:
    """Smallest singular value of symmetric blocks (..., 3, 3); NaN where not known."""
    known = np.isfinite(depolariser).all(axis=(-2, -1))
    blocks = np.where(known[..., None, None], depolariser, 0)
    least = np.abs(np.linalg.eigvalsh(blocks)).min(axis=-1)
    return np.where(known, least, np.nan)
