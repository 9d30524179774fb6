"""Light of known polarisation, and what is undefined about light without any."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.optics.mueller import circular_polariser, linear_polariser, linear_retarder, rotator
from pbrdf.optics.stokes import (
    angle_of_linear_polarisation,
    degree_of_circular_polarisation,
    degree_of_linear_polarisation,
    degree_of_polarisation,
    ellipticity,
    of_unpolarised_light,
    type_of_polarisation,
)

Float = NDArray[np.float64]

RANDOM = np.random.default_rng(1)
ANGLES = RANDOM.uniform(0, np.pi, 100)
CHIS = RANDOM.uniform(-np.pi / 4, np.pi / 4, 100)
DEGREES = RANDOM.uniform(0.01, 1, 100)


def elliptical(intensity: float) -> Float:
    """Light of degree DEGREES whose ellipse lies at ANGLES with ellipticity CHIS (Goldstein, eq. 5.41)."""
    part = intensity * DEGREES
    return np.stack(
        [
            np.full_like(ANGLES, intensity),
            part * np.cos(2 * CHIS) * np.cos(2 * ANGLES),
            part * np.cos(2 * CHIS) * np.sin(2 * ANGLES),
            part * np.sin(2 * CHIS),
        ],
        axis=-1,
    )


@pytest.mark.parametrize("intensity", [1.0, 3e-5, 6e4])
def test_an_ellipse_is_found_again(intensity: float) -> None:
    light = elliptical(intensity)
    np.testing.assert_allclose(degree_of_polarisation(light), DEGREES, rtol=1e-13)
    np.testing.assert_allclose(degree_of_linear_polarisation(light), DEGREES * np.cos(2 * CHIS), atol=1e-14)
    np.testing.assert_allclose(
        degree_of_circular_polarisation(light), DEGREES * np.abs(np.sin(2 * CHIS)), atol=1e-14
    )
    np.testing.assert_allclose(angle_of_linear_polarisation(light), ANGLES, atol=1e-12)
    np.testing.assert_allclose(ellipticity(light), CHIS, atol=1e-14)


def test_shares_of_the_polarised_part_are_those_of_its_ellipse() -> None:
    linear, circular = type_of_polarisation(elliptical(2.0))
    np.testing.assert_allclose(linear, np.cos(2 * CHIS), atol=1e-13)
    np.testing.assert_allclose(circular, np.abs(np.sin(2 * CHIS)), atol=1e-13)
    np.testing.assert_allclose(linear**2 + circular**2, 1.0, rtol=1e-14)


def test_degrees_and_ellipticity_do_not_depend_on_the_frame() -> None:
    light = elliptical(1.0)
    seen = (rotator(0.4) @ light[..., None])[..., 0]
    for quantity in (
        degree_of_polarisation,
        degree_of_linear_polarisation,
        degree_of_circular_polarisation,
        ellipticity,
    ):
        np.testing.assert_allclose(quantity(seen), quantity(light), atol=1e-14)
    turned_back = np.mod(angle_of_linear_polarisation(seen) + 0.4, np.pi)
    np.testing.assert_allclose(turned_back, ANGLES, atol=1e-12)


def test_a_polariser_leaves_light_along_its_axis() -> None:
    light = of_unpolarised_light(linear_polariser(ANGLES))
    np.testing.assert_allclose(degree_of_linear_polarisation(light), 1.0, rtol=1e-14)
    np.testing.assert_allclose(angle_of_linear_polarisation(light), ANGLES, atol=1e-12)
    np.testing.assert_allclose(ellipticity(light), 0.0, atol=1e-15)


@pytest.mark.parametrize(("right", "chi"), [(True, np.pi / 4), (False, -np.pi / 4)])
def test_right_circular_light_has_positive_ellipticity(right: bool, chi: float) -> None:
    light = of_unpolarised_light(circular_polariser(right=right))
    assert ellipticity(light) == pytest.approx(chi, abs=1e-15)
    assert degree_of_circular_polarisation(light) == pytest.approx(1.0)
    assert np.isnan(angle_of_linear_polarisation(light))
    assert [float(share) for share in type_of_polarisation(light)] == [0.0, 1.0]


def test_a_retarder_makes_nothing_of_unpolarised_light() -> None:
    light = of_unpolarised_light(linear_retarder(1.0, ANGLES))
    np.testing.assert_allclose(degree_of_polarisation(light), 0.0, atol=1e-15)


def test_unpolarised_light_has_no_angle_no_ellipticity_and_no_share() -> None:
    light = np.array([2.0, 0.0, 0.0, 0.0])
    assert degree_of_polarisation(light) == 0.0
    assert np.isnan(angle_of_linear_polarisation(light))
    assert np.isnan(ellipticity(light))
    assert [float(share) for share in type_of_polarisation(light)] == [0.0, 0.0]


def test_where_there_is_no_light_degrees_are_unknown() -> None:
    dark = np.zeros((2, 3, 4))
    for degree in (degree_of_polarisation, degree_of_linear_polarisation, degree_of_circular_polarisation):
        assert degree(dark).shape == (2, 3)
        assert np.isnan(degree(dark)).all()


def test_the_angle_lies_below_half_a_turn() -> None:
    almost = np.array([[1.0, 1.0, -1e-300, 0.0], [1.0, 1.0, 0.0, 0.0], [1.0, -1.0, -0.0, 0.0]])
    np.testing.assert_allclose(angle_of_linear_polarisation(almost), [0.0, 0.0, np.pi / 2], atol=1e-15)
    assert (angle_of_linear_polarisation(almost) < np.pi).all()


def test_unknown_light_stays_unknown() -> None:
    unknown = np.full(4, np.nan)
    for quantity in (degree_of_polarisation, angle_of_linear_polarisation, ellipticity):
        assert np.isnan(quantity(unknown))
