"""Which measured matrices are Mueller matrices: Cloude's test, and the nearest that passes it.

The coherency matrix of M is H = ¼ Σ M_ij (σ_i ⊗ σ_j*) with the Pauli matrices in the order of the
Stokes parameters. M is a sum of Jones matrices' Mueller matrices exactly if H has no negative
eigenvalue (Cloude 1986, *Group theory and polarisation algebra*). tr H = M00, ‖M‖ = 2 ‖H‖.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf._kernels import physicality
from pbrdf.reconstruction.pixels import matrix_list, same_list


def coherency_eigenvalues(mueller: ArrayLike) -> NDArray[Any]:
    """Eigenvalues of the coherency matrices, ascending.

    Parameters
    ----------
    mueller : array_like, shape (..., 4, 4)
        In any unit; the frames do not matter.

    Returns
    -------
    ndarray, shape (..., 4)
        float32 for float32 input, else float64, in the unit of `mueller`; they add to M00. NaN
        where an element is not finite. A Jones matrix has three zeros, an ideal depolariser four
        equal ones.
    """
    matrices, shape = matrix_list(mueller)
    eigenvalues = np.empty((len(matrices), 4), matrices.dtype)
    physicality.coherency_eigenvalues(matrices, eigenvalues)
    return eigenvalues.reshape(*shape, 4)


def is_physical(mueller: ArrayLike, tolerance: float | None = None) -> NDArray[np.bool_]:
    """Whether the smallest eigenvalue of the coherency matrix is at least −tolerance · M00.

    Parameters
    ----------
    mueller : array_like, shape (..., 4, 4)
    tolerance : float, optional
        Not negative. By default what rounding alone may do to a Jones matrix's Mueller matrix:
        32 ε of the type that the kernel takes.

    Returns
    -------
    ndarray, shape (...), bool
        False where an element is not finite.

    Raises
    ------
    ValueError
        If the tolerance is negative or not a number.
    """
    matrices, shape = matrix_list(mueller)
    if tolerance is None:
        tolerance = 32 * float(np.finfo(matrices.dtype).eps)
    physical = np.empty(len(matrices), np.bool_)
    physicality.physicality_mask(matrices, float(tolerance), physical)
    return physical.reshape(shape)


def nearest_physical(mueller: ArrayLike, out: NDArray[Any] | None = None) -> NDArray[Any]:
    """Nearest physical matrices in Frobenius norm: coherency matrices without their negative eigenvalues.

    Parameters
    ----------
    mueller : array_like, shape (..., 4, 4)
    out : ndarray, shape (..., 4, 4), optional
        C-contiguous, of the result's type; `mueller` itself will do.

    Returns
    -------
    ndarray, shape (..., 4, 4)
        float32 for float32 input, else float64. M00 grows by the sum of what was taken away. A
        physical matrix comes back bit for bit; one with an element that is not finite is NaN.

    Raises
    ------
    ValueError
        If `out` does not fit.
    """
    matrices, shape = matrix_list(mueller)
    nearest = np.empty((*shape, 4, 4), matrices.dtype) if out is None else out
    physicality.nearest_physical(matrices, same_list(nearest, matrices))
    return nearest
