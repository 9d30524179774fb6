"""Our decomposition and physicality test equal muellerkit's on physical matrices."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.reconstruction.decomposition import Guard, lu_chipman
from pbrdf.reconstruction.physicality import coherency_eigenvalues, is_physical, nearest_physical

mk = pytest.importorskip("muellerkit", reason="muellerkit is not installed: pip install muellerkit")

Float = NDArray[np.float64]


@pytest.fixture(scope="module")
def physical() -> Float:
    """Physical matrices of every brightness, nearest to noise about a depolariser."""
    random = np.random.default_rng(1)
    noisy = np.diag([1.0, 0.6, 0.5, 0.4]) + random.normal(0, 0.12, (5000, 4, 4))
    return nearest_physical(noisy) * random.uniform(0.01, 10, (5000, 1, 1))


def test_factors_are_the_same(physical: Float) -> None:
    ours = lu_chipman(physical)
    assert (ours.guard == Guard.NONE).all()
    theirs = mk.decompose_depolarizer_retarder_diattenuator(physical)
    for found, expected in zip((ours.depolariser, ours.retarder, ours.diattenuator), theirs, strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-10)


def test_numbers_are_the_same(physical: Float) -> None:
    ours = lu_chipman(physical)
    theirs = mk.extract_parameters(*mk.decompose_depolarizer_retarder_diattenuator(physical))
    np.testing.assert_allclose(ours.diattenuation, theirs.diattenuation, atol=1e-13)
    np.testing.assert_allclose(ours.depolarisation_power, theirs.total_depolarization, atol=1e-11)
    # acos of theirs loses half of the digits near 0 and π
    np.testing.assert_allclose(np.cos(ours.retardance), np.cos(theirs.total_retardance), atol=1e-10)
    np.testing.assert_allclose(ours.depolarisation_index, mk.depolarization_index_image(physical), rtol=1e-12)


def test_verdicts_and_eigenvalues_are_the_same() -> None:
    mueller = np.diag([1.0, 0.8, 0.7, 0.6]) + np.random.default_rng(2).normal(0, 0.05, (5000, 4, 4))
    theirs = mk.physical_realizability(mueller, atol=0.0, rtol=0.0)
    assert 0 < theirs.is_realizable.sum() < len(mueller)
    np.testing.assert_array_equal(is_physical(mueller, 0.0), theirs.is_realizable)
    np.testing.assert_allclose(coherency_eigenvalues(mueller), theirs.eigenvalues, atol=1e-13)
