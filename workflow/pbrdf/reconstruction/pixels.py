"""Mueller images as the kernels take them: a contiguous list of matrices."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


def matrix_list(mueller: ArrayLike) -> tuple[NDArray[Any], tuple[int, ...]]:
    """Matrices of an image of any shape, and that shape.

    Parameters
    ----------
    mueller : array_like, shape (..., 4, 4)

    Returns
    -------
    matrices : ndarray, shape (n, 4, 4)
        C-contiguous; float32 stays float32, anything else becomes float64.
    shape : tuple of int
        The shape (...) of the image.

    Raises
    ------
    ValueError
        If the last two axes are not 4 × 4.
    """
    values = np.asarray(mueller)
    if values.shape[-2:] != (4, 4):
        raise ValueError(f"Mueller matrices have shape {values.shape}, expected (..., 4, 4)")
    dtype = np.float32 if values.dtype == np.float32 else np.float64
    contiguous = np.ascontiguousarray(values, dtype=dtype)
    return contiguous.reshape(-1, 4, 4), values.shape[:-2]


def same_list(image: NDArray[Any], matrices: NDArray[Any]) -> NDArray[Any]:
    """View of `image` (..., 4, 4) as the list that results for `matrices` are written to.

    Raises
    ------
    ValueError
        If it has another type, holds another number of matrices, or is not C-contiguous.
    """
    if image.dtype != matrices.dtype or image.size != matrices.size or not image.flags.c_contiguous:
        raise ValueError(
            f"out is {image.dtype} {image.shape}, expected C-contiguous {matrices.dtype} "
            f"with {len(matrices)} matrices"
        )
    return image.reshape(-1, 4, 4)
