"""Matrices in another order of axes: what NumPy's transposition gives, to the bit."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from pbrdf._kernels import items

WHOLE = np.random.default_rng(1).normal(size=(3, 5, 2, 7, 4, 4)).astype(np.float32)


@pytest.mark.parametrize("order", list(permutations(range(4))))
def test_any_order_of_the_axes(order: tuple[int, ...]) -> None:
    view = WHOLE.transpose(*order, 4, 5)
    out = np.empty(view.shape, np.float32)
    items.gather(view, out)
    np.testing.assert_array_equal(out, view)


def test_steps_and_backward_views() -> None:
    view = WHOLE[::-1, ::2, :, 1:6:3].transpose(3, 2, 1, 0, 4, 5)
    out = np.empty(view.shape, np.float32)
    items.gather(view, out)
    np.testing.assert_array_equal(out, view)


def test_matrices_that_are_not_in_one_piece_are_refused() -> None:
    with pytest.raises(ValueError, match="in one piece"):
        items.gather(WHOLE.transpose(0, 1, 2, 3, 5, 4), np.empty_like(WHOLE))
    with pytest.raises(ValueError, match="out has shape"):
        items.gather(WHOLE, np.empty((3, 5, 2, 6, 4, 4), np.float32))
