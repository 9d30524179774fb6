"""The quick look at frames equals the least-squares solution."""

from __future__ import annotations

import numpy as np
import pytest

import pbrdf
from pbrdf.errors import InputError
from pbrdf.optics.polarimeter import Polarimeter

POLARIMETER = Polarimeter(np.deg2rad(91.0), np.deg2rad(88.0), (0.0, 0.02, -0.01, 0.005))
STATES = np.stack([np.zeros(36), 25.0 * np.arange(36), 5.0 * np.arange(36), np.full(36, 90.0)], axis=-1)
W = POLARIMETER.measurement_matrix(np.deg2rad(STATES))


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32"])
def test_frames_become_the_least_squares_solution(dtype: str) -> None:
    frames = np.random.default_rng(1).integers(0, 256, (36, 7, 9)).astype(dtype)
    mueller = pbrdf.mueller_of_frames(frames, STATES, POLARIMETER)
    expected = np.tensordot(np.linalg.pinv(W), frames.astype(np.float64), 1)
    np.testing.assert_allclose(mueller, expected, atol=2e-6 * np.abs(expected).max())


def test_the_output_is_the_caller_s_own() -> None:
    frames = np.random.default_rng(1).integers(0, 256, (36, 7, 9)).astype(np.uint16)
    out = np.empty((16, 7, 9), np.float32)
    assert pbrdf.mueller_of_frames(frames, STATES, POLARIMETER, out) is out
    np.testing.assert_array_equal(out, pbrdf.mueller_of_frames(frames, STATES, POLARIMETER))


def test_arrays_that_do_not_fit_are_refused() -> None:
    frames = np.zeros((36, 7, 9), np.uint16)
    with pytest.raises(ValueError, match=r"frames have shape \(35, 7, 9\)"):
        pbrdf.mueller_of_frames(frames[:35], STATES, POLARIMETER)
    for wrong in (
        np.empty((16, 9, 7), np.float32),
        np.empty((16, 7, 9)),
        np.empty((16, 7, 18), np.float32)[..., ::2],
    ):
        with pytest.raises(ValueError, match="expected C-contiguous float32"):
            pbrdf.mueller_of_frames(frames, STATES, POLARIMETER, wrong)


def test_equal_states_are_refused_in_words() -> None:
    states = STATES.copy()
    states[20] = states[3] + [0, 360, 0, 0]
    with pytest.raises(InputError, match=r"states_deg\[20\]: is the same as \[3\]"):
        pbrdf.mueller_of_frames(np.zeros((36, 2, 2), np.uint16), states, POLARIMETER)
