"""Our elements and reconstruction equal polanalyser's."""

from __future__ import annotations

import numpy as np
import pytest

from pbrdf.optics.mueller import linear_polariser, linear_retarder, rotator
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.reconstruction.reduction import data_reduction

pa = pytest.importorskip("polanalyser", reason="polanalyser is not installed: pip install polanalyser")

ANGLES = np.random.default_rng(1).uniform(-np.pi, np.pi, 40)


def test_polarisers_are_the_same() -> None:
    for angle in ANGLES:
        np.testing.assert_allclose(pa.polarizer(angle), linear_polariser(angle), atol=1e-14)


def test_retarders_are_the_same() -> None:
    for angle in ANGLES:
        np.testing.assert_allclose(pa.qwp(angle), linear_retarder(np.pi / 2, angle), atol=1e-14)
        np.testing.assert_allclose(pa.retarder(0.8, angle), linear_retarder(0.8, angle), atol=1e-14)


def test_rotators_are_the_same() -> None:
    for angle in ANGLES:
        np.testing.assert_allclose(pa.rotator(angle), rotator(angle), atol=1e-14)


def test_reconstruction_is_the_same() -> None:
    """The layout of polanalyser's example: crossed polarisers, the generator's retarder the fast one."""
    angle = np.linspace(0, np.pi, 36, endpoint=False)
    mueller = np.random.default_rng(2).uniform(-1, 1, size=(5, 4, 4))
    generator = [pa.qwp(5 * a) @ pa.polarizer(0) for a in angle]
    analyser = [pa.polarizer(np.pi / 2) @ pa.qwp(a) for a in angle]
    intensity = np.array([(a @ mueller @ g)[..., 0, 0] for a, g in zip(analyser, generator, strict=True)])

    states = np.rad2deg(np.stack([0 * angle, 5 * angle, angle, 0 * angle + np.pi / 2], axis=-1))
    solution = data_reduction(Polarimeter(np.pi / 2, np.pi / 2), states, "example")
    np.testing.assert_allclose(solution.measurement @ mueller.reshape(5, 16).T, intensity, atol=1e-14)
    found = (solution.reduction @ intensity).T.reshape(5, 4, 4)
    np.testing.assert_allclose(found, pa.calcMueller(intensity, generator, analyser), atol=1e-12)
