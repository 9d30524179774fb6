"""The closed form is exact for every list of states that tells the waves apart."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.calibration.air_harmonics import closed_form
from pbrdf.optics.polarimeter import Polarimeter

Float = NDArray[np.float64]

AIR, MIRROR = np.eye(4), np.diag([1.0, 1.0, -1.0, -1.0])


def together(count: int, step_deg: float, generator: float, analyser: float, polariser: float = 0.0) -> Float:
    """States of retarders that turn together, radians."""
    turn = np.deg2rad(step_deg) * np.arange(count)
    return np.stack([0 * turn, generator * turn, analyser * turn, 0 * turn + polariser], axis=-1)


LISTS = {
    "analyser fast": together(36, 5, 1, 5),
    "generator fast": together(36, 5, 5, 1),
    "crossed": together(36, 5, 1, 5, np.pi / 2),
    "whole turn, odd count": together(61, 6, 1, 5),
    "one to 4.91": together(64, 360 / 64, 1, 4.91),
    "backwards": together(40, 4, -1, 5),
    "all four turn": np.random.default_rng(5).uniform(-np.pi, np.pi, (40, 4)),
}


@pytest.mark.parametrize("states", LISTS.values(), ids=LISTS)
@pytest.mark.parametrize(("matrix", "mirrored"), [(AIR, False), (MIRROR, True)], ids=["air", "mirror"])
def test_closed_form_is_exact(states: Float, matrix: Float, mirrored: bool) -> None:
    random = np.random.default_rng(7)
    for _ in range(20):
        zeros = np.array([0.0, *random.uniform(-np.pi / 2, np.pi / 2, 3)])
        retardances = random.uniform(0.4, 2.7, (2, 3))
        seen = np.stack(
            [
                random.uniform(1, 100)
                * (Polarimeter(g, a, tuple(zeros)).measurement_matrix(states) @ matrix.ravel())
                for g, a in retardances.T
            ]
        )
        found = closed_form(states, seen, mirrored=mirrored)
        assert found is not None
        np.testing.assert_allclose(found.generator_retardances, retardances[0], atol=1e-9)
        np.testing.assert_allclose(found.analyser_retardances, retardances[1], atol=1e-9)
        # fast axes of both retarders may be exchanged together: the signal does not tell
        off = (found.zeros - zeros) % np.pi
        exchanged = np.array([0, np.pi / 2, np.pi / 2, 0])
        assert min(
            np.abs((off - e + np.pi / 2) % np.pi - np.pi / 2).max() for e in (np.zeros(4), exchanged)
        ) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    "states",
    [together(36, 10, 1, 5), together(20, 9, 1, 5), together(10, 5, 1, 5)],
    ids=["36 over a whole turn", "20 over half a turn", "too few"],
)
def test_lists_that_mix_two_waves_have_no_closed_form(states: Float) -> None:
    seen = Polarimeter(1.5, 1.6).measurement_matrix(states) @ AIR.ravel()
    assert closed_form(states, seen[None]) is None
