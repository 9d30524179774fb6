"""Our elements and frames equal those of Mitsuba's ``mueller`` namespace."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.optics.frames import angle_between, change_frames, normalised, transverse
from pbrdf.optics.mueller import circular_polariser, linear_polariser, linear_retarder, rotator, turned

mi = pytest.importorskip("mitsuba", reason="Mitsuba is not installed: pip install 'pbrdf[mitsuba]'")

Float = NDArray[np.float64]
ANGLES = np.random.default_rng(1).uniform(-np.pi, np.pi, 40)
ROUNDING = 2e-6  # Mitsuba computes in float32


@pytest.fixture(autouse=True)
def variant() -> None:
    mi.set_variant("scalar_spectral_polarized")


def matrix(values: object) -> Float:
    return np.array(values, dtype=np.float64)


@pytest.mark.parametrize("angle", ANGLES)
def test_elements(angle: float) -> None:
    m, delta = mi.mueller, 0.3 + abs(float(angle))
    np.testing.assert_allclose(matrix(m.rotator(angle)), rotator(angle), atol=ROUNDING)
    np.testing.assert_allclose(matrix(m.linear_retarder(delta)), linear_retarder(delta), atol=ROUNDING)
    polariser, retarder = m.linear_polarizer(1.0), m.linear_retarder(delta)
    np.testing.assert_allclose(
        matrix(m.rotated_element(angle, polariser)), linear_polariser(angle), atol=ROUNDING
    )
    np.testing.assert_allclose(
        matrix(m.rotated_element(angle, retarder)), linear_retarder(delta, angle), atol=ROUNDING
    )


def test_elements_along_x() -> None:
    m = mi.mueller
    np.testing.assert_allclose(matrix(m.linear_polarizer(1.0)), linear_polariser(), atol=ROUNDING)
    np.testing.assert_allclose(
        matrix(m.right_circular_polarizer()), circular_polariser(right=True), atol=ROUNDING
    )
    np.testing.assert_allclose(
        matrix(m.left_circular_polarizer()), circular_polariser(right=False), atol=ROUNDING
    )


def test_an_element_of_any_kind_turns_alike() -> None:
    element = np.random.default_rng(2).normal(size=(4, 4))
    scalar = mi.mueller.rotated_element(0.7, type(mi.mueller.rotator(0.0))(element.tolist()))
    np.testing.assert_allclose(matrix(scalar), turned(element, 0.7), atol=ROUNDING)


def test_rotate_mueller_basis() -> None:
    random = np.random.default_rng(3)
    z_in, z_out = normalised(random.normal(size=(2, 100, 3)))
    x = [transverse(normalised(random.normal(size=(100, 3))), z) for z in (z_in, z_in, z_out, z_out)]
    mueller = random.uniform(-1, 1, size=(100, 4, 4))
    ours = change_frames(mueller, angle_between(x[0], x[1], z_in), angle_between(x[2], x[3], z_out))
    matrix_type = type(mi.mueller.rotator(0.0))
    for index in range(100):
        z_i, x_i, x_i_new, z_o, x_o, x_o_new = (
            mi.Vector3f(v[index].tolist()) for v in (z_in, x[0], x[1], z_out, x[2], x[3])
        )
        found = mi.mueller.rotate_mueller_basis(
            matrix_type(mueller[index].tolist()), z_i, x_i, x_i_new, z_o, x_o, x_o_new
        )
        np.testing.assert_allclose(matrix(found), ours[index], atol=1e-5)
