"""Known elements multiplied and taken apart again, and what happens where nothing can be taken apart."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pbrdf._kernels import decomposition
from scipy.spatial.transform import Rotation

from pbrdf.optics.mueller import linear_polariser, linear_retarder
from pbrdf.reconstruction.decomposition import Guard, LuChipman, lu_chipman
from pbrdf.reconstruction.physicality import is_physical

Float = NDArray[np.float64]

COUNT = 1003  # not a multiple of any block


def bordered(block: Float, column: Float | None = None) -> Float:
    """Mueller matrices [1 0; column block]."""
    matrices = np.zeros((len(block), 4, 4))
    matrices[:, 0, 0] = 1.0
    matrices[:, 1:, 1:] = block
    if column is not None:
        matrices[:, 1:, 0] = column
    return matrices


def diattenuators(vectors: Float) -> Float:
    """M00 = 1 and first row (1, D); Lu & Chipman 1996, eq. 18."""
    d2 = np.sum(vectors**2, axis=-1)[:, None, None]
    a = np.sqrt(1 - d2)
    outer = vectors[:, :, None] * vectors[:, None, :]
    matrices = bordered(a * np.eye(3) + (1 - a) * outer / np.where(d2 == 0, 1, d2), vectors)
    matrices[:, 0, 1:] = vectors
    return matrices


def rotations(seed: int, n: int = COUNT) -> Float:
    return np.asarray(Rotation.random(n, random_state=seed).as_matrix())


def directions(seed: int, n: int = COUNT) -> Float:
    vectors = np.random.default_rng(seed).normal(size=(n, 3))
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def symmetric(eigenvalues: Float, seed: int) -> Float:
    axes = rotations(seed, len(eigenvalues))
    return np.einsum("nij,nj,nkj->nik", axes, eigenvalues, axes)


def elements(seed: int = 1, strongest: float = 0.95) -> tuple[Float, Float, Float]:
    """Depolarisers, retarders and diattenuators of every kind, the last with M00 from 0.1 to 5."""
    random = np.random.default_rng(seed)
    polarizance = random.uniform(-0.05, 0.05, (COUNT, 3))
    depolariser = bordered(symmetric(random.uniform(0.05, 0.9, (COUNT, 3)), seed + 1), polarizance)
    diattenuation = random.uniform(0, strongest, (COUNT, 1)) * directions(seed + 3)
    brightness = random.uniform(0.1, 5, (COUNT, 1, 1))
    return depolariser, bordered(rotations(seed + 2)), brightness * diattenuators(diattenuation)


def product(found: LuChipman) -> NDArray[Any]:
    return found.depolariser @ found.retarder @ found.diattenuator


def assert_factors(found: LuChipman, expected: tuple[Float, Float, Float], atol: float) -> None:
    for factor, known in zip((found.depolariser, found.retarder, found.diattenuator), expected, strict=True):
        np.testing.assert_allclose(factor, known, atol=atol)


def test_a_product_of_known_elements_decomposes_to_them() -> None:
    known = elements()
    found = lu_chipman(known[0] @ known[1] @ known[2])
    assert_factors(found, known, atol=1e-10)
    assert (found.guard == Guard.NONE).all()


def test_a_depolariser_with_a_negative_determinant_keeps_its_sign() -> None:
    depolariser, retarder, diattenuator = elements(11)
    depolariser[:, 1:, 1:] *= -1
    assert_factors(
        lu_chipman(depolariser @ retarder @ diattenuator), (depolariser, retarder, diattenuator), atol=1e-10
    )


def test_what_the_factors_say() -> None:
    random = np.random.default_rng(21)
    angles = random.uniform(0, np.pi, COUNT)
    angles[:3] = 0.0, 1e-9, np.pi
    strengths = random.uniform(0, 0.95, COUNT)
    eigenvalues = random.uniform(0.05, 1, (COUNT, 3))
    turn = bordered(Rotation.from_rotvec(angles[:, None] * directions(22)).as_matrix())
    depolariser = bordered(symmetric(eigenvalues, 23))
    mueller = depolariser @ turn @ diattenuators(strengths[:, None] * directions(24))
    found = lu_chipman(mueller)
    np.testing.assert_allclose(found.retardance, angles, atol=1e-12)
    np.testing.assert_allclose(found.diattenuation, strengths, atol=1e-12)
    np.testing.assert_allclose(found.depolarisation_power, 1 - eigenvalues.mean(axis=-1), atol=1e-12)
    np.testing.assert_allclose(
        found.polarizance, np.linalg.norm(mueller[:, 1:, 0], axis=-1) / mueller[:, 0, 0], rtol=1e-14
    )
    squares = np.sum(mueller**2, axis=(-2, -1)) / mueller[:, 0, 0] ** 2
    np.testing.assert_allclose(found.depolarisation_index, np.sqrt((squares - 1) / 3), rtol=1e-12)


def test_a_retarder_has_its_retardance_and_nothing_else() -> None:
    found = lu_chipman(0.3 * linear_retarder([0.2, np.pi / 2, 3.0], [0.1, 1.0, -0.4]))
    np.testing.assert_allclose(found.retardance, [0.2, np.pi / 2, 3.0], atol=1e-14)
    np.testing.assert_allclose(found.diattenuation, 0.0, atol=1e-15)
    np.testing.assert_allclose(found.depolarisation_power, 0.0, atol=1e-14)
    np.testing.assert_allclose(found.depolarisation_index, 1.0, rtol=1e-14)


def test_a_mirror_is_half_a_wave() -> None:
    mirror = lu_chipman(np.diag([1.0, 1.0, -1.0, -1.0]))
    assert mirror.retardance == pytest.approx(np.pi)
    assert mirror.depolarisation_power == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize(
    ("dtype", "epsilon", "rounding"), [("float64", 2.3e-16, 1e-12), ("float32", 1.2e-7, 2e-6)]
)
@pytest.mark.parametrize("decades", [3, 6, 9, 16])
def test_the_retarder_is_as_exact_as_the_matrix_tells_it(
    dtype: str, epsilon: float, rounding: float, decades: int
) -> None:
    """Rounding of M turns the polar factor of m' by about ε / (σ2 + σ3): no algorithm does better."""
    random = np.random.default_rng(31)
    singular = 10.0 ** -np.sort(random.uniform(0, decades, (20_000, 3)), axis=-1)
    sign = random.choice([-1.0, 1.0], (20_000, 1, 1))
    depolariser = bordered(sign * symmetric(singular, 32))
    retarder = bordered(rotations(33, 20_000))
    mueller = depolariser @ retarder
    found = lu_chipman(mueller.astype(dtype))
    turn = found.retarder[:, 1:, 1:].astype(np.float64)
    np.testing.assert_allclose(
        np.swapaxes(turn, -1, -2) @ turn, np.tile(np.eye(3), (20_000, 1, 1)), atol=rounding
    )
    assert (np.linalg.det(turn) > 0).all()
    np.testing.assert_allclose(product(found), mueller, atol=rounding)
    plain = found.guard == Guard.NONE
    error = np.abs(found.retarder - retarder).max(axis=(-2, -1)) * (singular[:, 1] + singular[:, 2])
    assert error[plain].max() < 10 * epsilon


def test_near_the_polariser_the_product_still_holds() -> None:
    """The error of the factors grows as ε / (1 − D²); their product does not feel it until D = 1."""
    depolariser, retarder, _ = elements(41)
    for short_of_one in (1e-3, 1e-6, 1e-9, 1e-12):
        diattenuator = diattenuators((1 - short_of_one) * directions(42))
        mueller = depolariser @ retarder @ diattenuator
        found = lu_chipman(mueller)
        assert (found.guard == Guard.NONE).all()
        np.testing.assert_allclose(product(found), mueller, atol=1e-15 / short_of_one + 1e-13)
        np.testing.assert_allclose(found.retarder, retarder, atol=1e-13 / short_of_one)


@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_polarisers_have_the_retarder_that_turns_least(dtype: str) -> None:
    into, out = directions(51), directions(52)
    out[:3] = into[0], -into[1], -into[2]
    degree = np.random.default_rng(53).uniform(0, 1, COUNT)
    ones = np.ones((COUNT, 1))
    mueller = np.hstack([ones, degree[:, None] * out])[:, :, None] * np.hstack([ones, into])[:, None, :]
    found = lu_chipman(mueller.astype(dtype))
    assert (found.guard == Guard.POLARISER).all()
    rounding = 1e-13 if dtype == "float64" else 2e-6
    np.testing.assert_allclose(product(found), mueller, atol=rounding)
    np.testing.assert_allclose((found.retarder[:, 1:, 1:] @ into[:, :, None])[..., 0], out, atol=rounding)
    np.testing.assert_allclose(found.depolarisation_power, 1 - degree, atol=rounding)
    angle = np.arctan2(np.linalg.norm(np.cross(into, out), axis=-1), np.sum(into * out, axis=-1))
    np.testing.assert_allclose(found.retardance, angle, atol=10 * np.sqrt(rounding))


def test_an_ideal_polariser_is_a_diattenuator_alone() -> None:
    polariser = linear_polariser(np.linspace(0, np.pi, 20))
    assert_factors(
        lu_chipman(polariser),
        (np.tile(np.eye(4), (20, 1, 1)), np.tile(np.eye(4), (20, 1, 1)), polariser),
        atol=1e-14,
    )


def test_an_ideal_depolariser_has_no_retarder() -> None:
    found = lu_chipman(np.diag([2.0, 0.0, 0.0, 0.0]))
    assert found.guard == Guard.RANK_ONE
    np.testing.assert_array_equal(found.retarder, np.eye(4))
    assert found.depolarisation_power == 1.0


def test_a_surface_that_depolarises_between_two_interfaces_has_no_retarder() -> None:
    """The diffuse term of a dielectric, p dᵀ: m' vanishes but for rounding."""
    p, d = 0.4 * directions(61), 0.7 * directions(62)
    ones = np.ones((COUNT, 1))
    mueller = np.hstack([ones, p])[:, :, None] * np.hstack([ones, d])[:, None, :]
    found = lu_chipman(mueller)
    assert (found.guard == Guard.RANK_ONE).all()
    np.testing.assert_array_equal(found.retarder, np.tile(np.eye(4), (COUNT, 1, 1)))
    np.testing.assert_allclose(found.depolariser[:, 1:, 0], p, atol=1e-14)
    np.testing.assert_allclose(product(found), mueller, atol=1e-14)


def test_of_the_retarders_that_fit_a_rank_one_block_the_weakest_is_taken() -> None:
    u, v = directions(71), directions(72)
    v[:2] = u[0], -u[1]
    mueller = bordered(0.5 * u[:, :, None] * v[:, None, :])
    found = lu_chipman(mueller)
    assert (found.guard == Guard.RANK_ONE).all()
    np.testing.assert_allclose(product(found), mueller, atol=1e-14)
    angle = np.arctan2(np.linalg.norm(np.cross(v, u), axis=-1), np.sum(u * v, axis=-1))
    np.testing.assert_allclose(found.retardance, angle, atol=1e-7)


def test_a_singular_block_has_a_rotation_for_its_retarder() -> None:
    random = np.random.default_rng(81)
    singular = np.concatenate([random.uniform(0.1, 0.9, (COUNT, 2)), np.zeros((COUNT, 1))], axis=-1)
    depolariser, retarder = bordered(symmetric(singular, 82)), bordered(rotations(83))
    mueller = depolariser @ retarder @ diattenuators(0.5 * directions(84))
    found = lu_chipman(mueller)
    assert (found.guard == Guard.SINGULAR).all()
    np.testing.assert_allclose(found.retarder, retarder, atol=1e-13)
    np.testing.assert_allclose(product(found), mueller, atol=1e-13)


@pytest.mark.parametrize(
    "matrix",
    [
        np.full((4, 4), np.nan),
        np.zeros((4, 4)),
        -np.eye(4),
        np.array([[1.0, 1.1, 0, 0], [1, 1, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0]]),
        np.diag([1.0, 1.0, 1.0, np.inf]),
    ],
    ids=["nan", "zero", "negative", "diattenuation above one", "infinite"],
)
@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_what_has_no_decomposition_is_not_a_number_and_is_told(matrix: Float, dtype: str) -> None:
    mueller = np.tile(np.diag([1.0, 0.5, 0.4, 0.3]), (40, 1, 1))
    mueller[33] = matrix
    found = lu_chipman(mueller.astype(dtype))
    assert found.guard.tolist() == [Guard.UNDEFINED if i == 33 else Guard.NONE for i in range(40)]
    for values in (
        found.depolariser,
        found.retarder,
        found.diattenuator,
        found.retardance,
        found.diattenuation,
        found.polarizance,
        found.depolarisation_power,
        found.depolarisation_index,
    ):
        assert np.isnan(values[33]).all()
        assert np.isfinite(np.delete(values, 33, axis=0)).all()


def test_factors_of_physical_matrices_are_physical() -> None:
    random = np.random.default_rng(91)
    eigenvalues = random.uniform(0.3, 0.5, (COUNT, 3))
    mueller = (
        bordered(symmetric(eigenvalues, 92)) @ bordered(rotations(93)) @ diattenuators(0.6 * directions(94))
    )
    assert is_physical(mueller).all()
    found = lu_chipman(mueller)
    for factor in (found.depolariser, found.retarder, found.diattenuator):
        assert is_physical(factor, 1e-13).all()


def test_float32_agrees_with_float64() -> None:
    depolariser, retarder, diattenuator = elements(101, strongest=0.8)
    mueller = depolariser @ retarder @ diattenuator
    single, double = lu_chipman(mueller.astype(np.float32)), lu_chipman(mueller)
    for name in ("depolariser", "retarder", "diattenuator"):
        assert getattr(single, name).dtype == np.float32
        np.testing.assert_allclose(getattr(single, name), getattr(double, name), atol=5e-6)
    assert single.retardance.dtype == np.float32
    assert single.depolarisation_index.dtype == np.float32


def test_a_pixel_alone_has_the_factors_that_it_has_among_others() -> None:
    known = elements(111)
    mueller = known[0] @ known[1] @ known[2]
    whole = lu_chipman(mueller)
    alone = [lu_chipman(m) for m in mueller[:100]]
    for name in ("depolariser", "retarder", "diattenuator"):
        np.testing.assert_array_equal(np.array([getattr(f, name) for f in alone]), getattr(whole, name)[:100])


def test_images_keep_their_shape_and_buffers_are_used() -> None:
    known = elements(121)
    image = (known[0] @ known[1] @ known[2])[:24].reshape(4, 6, 4, 4)
    buffers = [np.empty_like(image) for _ in range(3)]
    found = lu_chipman(image, out=buffers)
    assert found.depolariser is buffers[0]
    assert found.diattenuator is buffers[2]
    assert found.guard.shape == found.retardance.shape == found.depolarisation_index.shape == (4, 6)
    np.testing.assert_array_equal(found.retarder, lu_chipman(image).retarder)
    with pytest.raises(ValueError, match="out is float32"):
        lu_chipman(image, out=[b.astype(np.float32) for b in buffers])
    with pytest.raises(ValueError, match="not enough values"):
        lu_chipman(image, out=buffers[:2])


BYTES_OF_A_DECOMPOSITION = """
import hashlib, numpy as np
from pbrdf.reconstruction.decomposition import lu_chipman
mueller = np.diag([1.0, 0.8, 0.7, 0.6]) + np.random.default_rng(131).normal(0, 0.1, (50_001, 4, 4))
found = lu_chipman(mueller)
results = [a.tobytes() for a in (found.depolariser, found.retarder, found.diattenuator, found.guard)]
print(hashlib.sha256(b"".join(results)).hexdigest())
"""


def test_same_bytes_for_any_number_of_threads(printed_by_threads: Callable[[str], set[str]]) -> None:
    assert len(printed_by_threads(BYTES_OF_A_DECOMPOSITION)) == 1


def test_wrong_shapes_and_types_are_refused() -> None:
    mueller, guard = np.tile(np.eye(4), (5, 1, 1)), np.empty(5, np.uint8)
    outputs = [np.empty_like(mueller) for _ in range(3)]
    with pytest.raises(ValueError, match=r"retarder has shape \(4, 4, 4\), expected \(5, 4, 4\)"):
        decomposition.lu_chipman(mueller, outputs[0], outputs[1][:4], outputs[2], guard)
    with pytest.raises(ValueError, match="guard"):
        decomposition.lu_chipman(mueller, *outputs, guard[:4])
    with pytest.raises(TypeError):
        decomposition.lu_chipman(mueller.astype(np.float32), *outputs, guard)
    with pytest.raises(ValueError, match="expected"):
        lu_chipman(np.zeros((4, 3)))
