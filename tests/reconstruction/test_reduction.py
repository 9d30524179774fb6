"""The data reduction matrix undoes the measurement, or says why it cannot."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.reconstruction.reduction import data_reduction

POLARIMETER = Polarimeter(np.deg2rad(91.0), np.deg2rad(88.0), (0.0, 0.02, -0.01, 0.005))


def rotating(count: int, step_deg: float) -> NDArray[np.float64]:
    slow = step_deg * np.arange(count)
    return np.stack([0 * slow, slow, 5 * slow, 0 * slow], axis=-1)


def four_by_six() -> NDArray[np.float64]:
    generator, analyser = np.meshgrid([30, -45, 60, -90], [0, 30, 60, 90, 120, 150], indexing="ij")
    zero = np.zeros(24)
    return np.stack([zero, generator.ravel(), analyser.ravel(), zero], axis=-1)


def scattered() -> NDArray[np.float64]:
    return np.random.default_rng(1).uniform(-180, 180, (20, 4))


@pytest.mark.parametrize("states", [rotating(36, 5), four_by_six(), scattered()], ids=["1:5", "4 × 6", "any"])
def test_what_was_measured_comes_back(states: NDArray[np.float64]) -> None:
    solution = data_reduction(POLARIMETER, states, "here")
    mueller = np.random.default_rng(2).uniform(-1, 1, (16, 50))
    mueller[0] = 1.0
    found = solution.reduction @ (solution.measurement @ mueller)
    assert np.abs(found - mueller).max() < 1e-10
    np.testing.assert_allclose(solution.reduction, np.linalg.pinv(solution.measurement), atol=1e-11)
    assert solution.condition == pytest.approx(np.linalg.cond(solution.measurement), rel=1e-9)


@pytest.mark.parametrize(("states", "condition"), [(rotating(36, 5), 13.05), (four_by_six(), 13.10)])
def test_condition_with_quarter_waves(states: NDArray[np.float64], condition: float) -> None:
    ideal = Polarimeter(np.pi / 2, np.pi / 2)
    assert data_reduction(ideal, states, "here").condition == pytest.approx(condition, abs=0.005)


@pytest.mark.parametrize(
    ("states", "rank"), [(rotating(36, 10), 14), (rotating(12, 5), 12), (four_by_six()[:4], 3)]
)
def test_states_that_do_not_determine_all_elements_are_refused_with_their_rank(
    states: NDArray[np.float64], rank: int
) -> None:
    with pytest.raises(InputError) as caught:
        data_reduction(Polarimeter(np.pi / 2, np.pi / 2), states, "frames.zarr")
    assert caught.value.source == "frames.zarr"
    assert caught.value.field == "states_deg"
    assert f"{len(states)} states are of rank {rank}" in str(caught.value)
