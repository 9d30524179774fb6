"""Cloude's test against NumPy's eigenvalues, and the projection by what a projection does."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from pbrdf._kernels import physicality

from pbrdf.reconstruction.physicality import coherency_eigenvalues, is_physical, nearest_physical

Float = NDArray[np.float64]

PAULI = np.array([[[1, 0], [0, 1]], [[1, 0], [0, -1]], [[0, 1], [1, 0]], [[0, -1j], [1j, 0]]])
BASIS = np.array([[np.kron(a, b.conj()) for b in PAULI] for a in PAULI])
COUNT = 1003  # not a multiple of any block


def coherency(mueller: Float) -> NDArray[np.complex128]:
    return 0.25 * np.einsum("...ij,ijab->...ab", mueller, BASIS)


def of_coherency(h: NDArray[np.complex128]) -> Float:
    return np.ascontiguousarray(np.einsum("...ab,ijba->...ij", h, BASIS).real)


def with_eigenvalues(eigenvalues: Float, seed: int) -> Float:
    """Mueller matrices whose coherency matrices have these eigenvalues (n, 4) and random eigenvectors."""
    random = np.random.default_rng(seed)
    n = len(eigenvalues)
    vectors = np.linalg.qr(random.normal(size=(n, 4, 4)) + 1j * random.normal(size=(n, 4, 4)))[0]
    return of_coherency(np.einsum("nij,nj,nkj->nik", vectors, eigenvalues, vectors.conj()))


def jones_generated(n: int, seed: int) -> Float:
    """Mueller matrices of random Jones matrices, M00 = 1."""
    random = np.random.default_rng(seed)
    jones = random.normal(size=(n, 2, 2)) + 1j * random.normal(size=(n, 2, 2))
    mueller = 0.5 * np.einsum("iab,nbc,jcd,nad->nij", PAULI, jones, PAULI, jones.conj(), optimize=True).real
    return np.ascontiguousarray(mueller / mueller[:, :1, :1])


def measured(n: int, seed: int) -> Float:
    """Matrices of which some are physical: a depolariser with noise."""
    return np.diag([1.0, 0.8, 0.7, 0.6]) + np.random.default_rng(seed).normal(0, 0.04, (n, 4, 4))


@pytest.mark.parametrize("scale", [1e-30, 1.0, 1e30])
def test_eigenvalues_are_those_of_numpy(scale: float) -> None:
    mueller = np.random.default_rng(1).normal(size=(COUNT, 4, 4))
    expected = np.linalg.eigvalsh(coherency(mueller))
    np.testing.assert_allclose(coherency_eigenvalues(scale * mueller) / scale, expected, atol=1e-12)


def test_equal_eigenvalues_are_found() -> None:
    for eigenvalues in ([0, 0, 0, 1], [0, 0, 1, 1], [1, 1, 1, 1], [-1, -1, 2, 2], [0, 0, 0, 0]):
        mueller = with_eigenvalues(np.tile(np.array(eigenvalues, float), (50, 1)), seed=2)
        np.testing.assert_allclose(coherency_eigenvalues(mueller), np.tile(eigenvalues, (50, 1)), atol=1e-13)


def test_textbook_eigenvalues() -> None:
    np.testing.assert_allclose(coherency_eigenvalues(np.eye(4)), [0, 0, 0, 1], atol=1e-16)
    np.testing.assert_allclose(coherency_eigenvalues(np.diag([1.0, 0, 0, 0])), [0.25] * 4, atol=1e-16)
    np.testing.assert_allclose(
        coherency_eigenvalues(np.diag([1.0, 1, 1, -1])), [-0.5, 0.5, 0.5, 0.5], atol=1e-16
    )


def test_eigenvalues_add_to_m00() -> None:
    mueller = measured(COUNT, 3)
    np.testing.assert_allclose(coherency_eigenvalues(mueller).sum(axis=-1), mueller[:, 0, 0], rtol=1e-13)


@pytest.mark.parametrize("tolerance", [0.0, 1e-9, 1e-3])
def test_the_mask_is_the_verdict_of_eigvalsh_near_the_border(tolerance: float) -> None:
    random = np.random.default_rng(4)
    n = 100_000
    eigenvalues = random.uniform(0.01, 1, (n, 4))
    # from 1e-13 to 1e-2 on either side of the border, whose place is that of M00
    offset = random.choice([-1.0, 1.0], n) * 10.0 ** random.uniform(-13, -2, n)
    rest = eigenvalues[:, 1:].sum(axis=-1)
    eigenvalues[:, 0] = (offset - tolerance * rest) / (1 + tolerance)
    mueller = with_eigenvalues(eigenvalues, seed=5)
    lowest = np.linalg.eigvalsh(coherency(mueller))[:, 0]
    np.testing.assert_array_equal(is_physical(mueller, tolerance), lowest >= -tolerance * mueller[:, 0, 0])


def test_what_jones_matrices_make_is_physical() -> None:
    mueller = jones_generated(COUNT, 6)
    assert is_physical(mueller).all()
    assert is_physical(mueller.astype(np.float32)).all()
    assert is_physical(np.zeros((4, 4)), 0.0)
    assert is_physical(np.diag([1.0, 1.0, 0.0, 0.0]), 0.0)


def test_matrices_that_no_surface_has_are_not_physical() -> None:
    unphysical = [
        np.diag([1.0, 1.0, 1.0, -1.0]),
        np.diag([1.0, 1.1, 0.0, 0.0]),
        -np.eye(4),
        np.diag([0.0, 0.1, 0.0, 0.0]),
    ]
    assert not is_physical(np.array(unphysical), 1e-6).any()


def test_the_nearest_matrix_is_the_clipped_one() -> None:
    mueller = np.random.default_rng(7).normal(size=(COUNT, 4, 4))
    values, vectors = np.linalg.eigh(coherency(mueller))
    clipped = np.einsum("nij,nj,nkj->nik", vectors, np.maximum(values, 0), vectors.conj())
    np.testing.assert_allclose(nearest_physical(mueller), of_coherency(clipped), atol=1e-12)


def test_projection_is_idempotent_and_gives_physical_matrices() -> None:
    once = nearest_physical(measured(COUNT, 8))
    assert is_physical(once, 1e-14).all()
    np.testing.assert_allclose(nearest_physical(once), once, atol=1e-14)


def test_projection_leaves_jones_generated_matrices_alone() -> None:
    mueller = jones_generated(COUNT, 9)
    np.testing.assert_allclose(nearest_physical(mueller), mueller, atol=1e-12)


def test_a_physical_matrix_comes_back_bit_for_bit() -> None:
    mueller = measured(COUNT, 10)
    physical = is_physical(mueller, 0.0)
    assert 0 < physical.sum() < COUNT
    np.testing.assert_array_equal(nearest_physical(mueller)[physical], mueller[physical])


def test_no_other_physical_matrix_is_nearer() -> None:
    """The way to the projection makes an obtuse angle with that to any other point of the convex set."""
    mueller = measured(COUNT, 11)
    nearest = nearest_physical(mueller)
    for other in (jones_generated(COUNT, 12), nearest_physical(measured(COUNT, 13))):
        turn = np.sum((mueller - nearest) * (other - nearest), axis=(-2, -1))
        assert (turn <= 1e-13).all()


def test_float32_agrees_with_float64() -> None:
    mueller = measured(COUNT, 14)
    single = mueller.astype(np.float32)
    for function in (coherency_eigenvalues, nearest_physical):
        result = function(single)
        assert result.dtype == np.float32
        np.testing.assert_allclose(result, function(mueller), atol=2e-6)
    lowest = coherency_eigenvalues(mueller)[:, 0]
    clear = np.abs(lowest) > 1e-6
    np.testing.assert_array_equal(is_physical(single, 0.0)[clear], lowest[clear] >= 0)


@pytest.mark.parametrize("unknown", [np.nan, np.inf, -np.inf])
def test_what_is_not_a_number_stays_so_and_leaves_its_neighbours_alone(unknown: float) -> None:
    mueller = measured(COUNT, 15)
    expected = coherency_eigenvalues(mueller), nearest_physical(mueller)
    mueller[500, 2, 3] = unknown
    assert not is_physical(mueller)[500]
    for found, whole in zip(
        (coherency_eigenvalues(mueller), nearest_physical(mueller)), expected, strict=True
    ):
        assert np.isnan(found[500]).all()
        np.testing.assert_array_equal(np.delete(found, 500, axis=0), np.delete(whole, 500, axis=0))


def test_a_pixel_alone_has_the_result_that_it_has_among_others() -> None:
    mueller = measured(COUNT, 16)
    for function in (coherency_eigenvalues, nearest_physical, is_physical):
        whole = function(mueller)
        np.testing.assert_array_equal(np.array([function(m) for m in mueller]), whole)


def test_images_keep_their_shape() -> None:
    image = measured(24, 17).reshape(2, 3, 4, 4, 4)
    assert coherency_eigenvalues(image).shape == (2, 3, 4, 4)
    assert is_physical(image).shape == (2, 3, 4)
    assert nearest_physical(image).shape == image.shape
    swapped = np.swapaxes(image, 0, 1)
    np.testing.assert_array_equal(nearest_physical(swapped), np.swapaxes(nearest_physical(image), 0, 1))
    assert coherency_eigenvalues(np.empty((0, 4, 4))).shape == (0, 4)


def test_projection_into_a_buffer_and_in_place() -> None:
    mueller = measured(COUNT, 18)
    expected = nearest_physical(mueller)
    assert nearest_physical(mueller, out=mueller) is mueller
    np.testing.assert_array_equal(mueller, expected)
    for wrong in (np.empty((COUNT, 4, 4), np.float32), np.empty((COUNT, 4, 8))[..., ::2], np.empty((4, 4))):
        with pytest.raises(ValueError, match="out is"):
            nearest_physical(mueller, out=wrong)


BYTES_OF_A_PROJECTION = """
import hashlib, numpy as np
from pbrdf.reconstruction.physicality import coherency_eigenvalues, is_physical, nearest_physical
mueller = np.diag([1.0, 0.8, 0.7, 0.6]) + np.random.default_rng(19).normal(0, 0.04, (50_001, 4, 4))
results = [f(mueller).tobytes() for f in (coherency_eigenvalues, is_physical, nearest_physical)]
print(hashlib.sha256(b"".join(results)).hexdigest())
"""


def test_same_bytes_for_any_number_of_threads(printed_by_threads: Callable[[str], set[str]]) -> None:
    assert len(printed_by_threads(BYTES_OF_A_PROJECTION)) == 1


def test_wrong_shapes_types_and_tolerances_are_refused() -> None:
    with pytest.raises(ValueError, match=r"shape \(4, 3\), expected \(..., 4, 4\)"):
        coherency_eigenvalues(np.zeros((4, 3)))
    for tolerance in (-1e-3, np.nan):
        with pytest.raises(ValueError, match="tolerance"):
            is_physical(np.eye(4), tolerance)
    mueller = np.zeros((5, 4, 4))
    with pytest.raises(ValueError, match=r"out has shape \(4, 4\), expected \(5, 4\)"):
        physicality.coherency_eigenvalues(mueller, np.zeros((4, 4)))
    with pytest.raises(TypeError):
        physicality.coherency_eigenvalues(mueller, np.zeros((5, 4), np.float32))
    with pytest.raises(TypeError):
        physicality.physicality_mask(mueller, 0.0, np.zeros(5, np.uint8))
