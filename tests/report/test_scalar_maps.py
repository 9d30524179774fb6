from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.optics.mueller import linear_polariser, linear_retarder
from pbrdf.report.scalar_maps import CERTAIN, ScalarMaps, scalar_maps

Float = NDArray[np.float64]

MIRROR = np.diag([1.0, 1.0, -1.0, -1.0])
AIR = np.eye(4)
DEPOLARISER = np.diag([1.0, 0.0, 0.0, 0.0])
NO_NOISE = 1e-12


def _maps_of(matrices: Float, noise: float = NO_NOISE) -> ScalarMaps:
    """Maps of one row of pixels, each element with the standard deviation `noise`."""
    row = np.asarray(matrices)[None]
    return scalar_maps(row, np.full_like(row, noise**2))


@pytest.mark.parametrize("brightness", [1e-3, 1.0, 5e3])
def test_polarisers_give_wholly_polarised_light_along_their_axis(brightness: float) -> None:
    axes = np.radians([0.0, 20.0, 45.0, 90.0, 135.0, 179.0])
    maps = _maps_of(brightness * linear_polariser(axes))
    np.testing.assert_allclose(maps.dolp, 1.0, atol=1e-12)
    np.testing.assert_allclose(maps.aolp[0], axes, atol=1e-12)
    np.testing.assert_allclose(maps.docp, 0.0, atol=1e-12)
    np.testing.assert_allclose(maps.diattenuation, 1.0, atol=1e-12)
    np.testing.assert_allclose(maps.depolarisation_index, 1.0, atol=1e-12)
    assert not maps.aolp_weak.any()


def test_circular_polariser_gives_circular_light_without_an_axis() -> None:
    maps = _maps_of((linear_retarder(np.pi / 2, np.pi / 4) @ linear_polariser(0.0))[None], noise=1e-6)
    assert maps.docp == pytest.approx(1.0)
    assert maps.dolp == pytest.approx(0.0, abs=1e-12)
    assert maps.aolp_weak.all()


def test_only_a_depolariser_depolarises() -> None:
    maps = _maps_of(np.stack([DEPOLARISER, MIRROR, AIR]))
    np.testing.assert_allclose(maps.depolarisation[0], [1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(maps.depolarisation_index[0], [0, 1, 1], atol=1e-12)
    np.testing.assert_allclose(maps.smallest_eigenvalue[0], [0.25, 0, 0], atol=1e-12)
    assert maps.physical.all()


def test_a_mirror_turns_the_sphere_by_half_and_air_does_not() -> None:
    quarter_wave = linear_retarder(np.pi / 2, 0.3)
    maps = _maps_of(np.stack([MIRROR, AIR, quarter_wave]))
    np.testing.assert_allclose(maps.retardance[0], [np.pi, 0, np.pi / 2], atol=1e-7)
    np.testing.assert_allclose(maps.diattenuation, 0.0, atol=1e-12)
    assert not maps.retardance_weak.any()
    assert _maps_of(DEPOLARISER[None]).retardance_weak.all()


def test_missing_pixels_stay_missing() -> None:
    matrices = np.stack([MIRROR, MIRROR, MIRROR, MIRROR])
    matrices[1] = np.nan
    matrices[2, 3, 3] = np.inf
    matrices[3] *= -1.0
    maps = _maps_of(matrices)
    assert maps.known.tolist() == [[True, False, False, False]]
    for name in ("dolp", "docp", "dolp_error", "depolarisation", "depolarisation_index", "diattenuation"):
        assert np.isfinite(getattr(maps, name)).tolist() == maps.known.tolist(), name
    for name in ("retardance", "smallest_eigenvalue"):
        assert np.isfinite(getattr(maps, name)).tolist() == maps.known.tolist(), name
    for mask in (maps.physical, maps.aolp_weak, maps.retardance_weak):
        assert not mask[0, 1:].any()
    assert maps.share_of_known(maps.physical) == 1.0


def test_shares_of_nothing_are_not_known() -> None:
    maps = _maps_of(np.full((2, 4, 4), np.nan))
    assert np.isnan(maps.share_of_known(maps.physical))


def test_what_is_not_physical_is_told_and_decomposed_as_its_nearest() -> None:
    gaining = np.diag([1.0, 1.2, 1.2, 1.2])
    maps = _maps_of(gaining[None])
    assert maps.smallest_eigenvalue < 0
    assert not maps.physical.any()
    assert maps.depolarisation_index == pytest.approx(1.0)
    assert maps.depolarisation == pytest.approx(0.0, abs=1e-12)


def test_single_precision_is_kept_apart_from_what_is_not_physical() -> None:
    axes = np.linspace(0, np.pi, 50)
    matrices = (linear_retarder(0.7, axes) @ linear_polariser(axes + 0.2)).astype(np.float32)
    assert _maps_of(matrices).physical.all()


def test_standard_error_of_the_dolp_is_that_of_repeated_noise() -> None:
    random = np.random.default_rng(3)
    truth = np.diag([1.0, 0.5, 0.5, 0.5])
    truth[1:3, 0] = 0.3, 0.2
    noise = 0.01 * np.sqrt(np.arange(1, 17)).reshape(4, 4)
    matrices = 40 * (truth + noise * random.standard_normal((20000, 4, 4)))
    maps = scalar_maps(matrices[None], np.broadcast_to((40 * noise) ** 2, (1, 20000, 4, 4)))
    assert np.median(maps.dolp_error) == pytest.approx(float(np.std(maps.dolp)), rel=0.03)


def test_standard_error_of_an_eigenvalue_is_that_of_repeated_noise() -> None:
    truth = np.diag([1.0, 0.6, 0.4, 0.1])
    matrices = truth + 0.002 * np.random.default_rng(4).standard_normal((20000, 4, 4))
    maps = _maps_of(matrices, noise=0.002)
    assert np.median(maps.eigenvalue_error) == pytest.approx(
        float(np.std(maps.smallest_eigenvalue)), rel=0.05
    )


def test_angles_are_weak_where_their_length_is_below_its_noise() -> None:
    matrices = np.stack([np.diag([1.0, 0.6, 0.6, 0.6])] * 2)
    matrices[:, 1, 0] = 0.9 * CERTAIN * 0.01, 1.1 * CERTAIN * 0.01
    assert _maps_of(matrices, noise=0.01).aolp_weak.tolist() == [[True, False]]


def test_the_retarder_is_weak_where_a_direction_is_lost_in_noise() -> None:
    matrices = np.stack([np.diag([1.0, 0.3, -0.3, -kept]) for kept in (0.02, 0.04)])
    assert _maps_of(matrices, noise=0.01).retardance_weak.tolist() == [[True, False]]


def test_nothing_is_weak_where_the_noise_is_not_known() -> None:
    maps = scalar_maps(DEPOLARISER[None, None], np.full((1, 1, 4, 4), np.nan))
    assert np.isnan(maps.dolp_error).all()
    assert not maps.aolp_weak.any()
    assert not maps.retardance_weak.any()
