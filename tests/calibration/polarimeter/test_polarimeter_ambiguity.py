"""What references leave open is what their matrices do not change under."""

from __future__ import annotations

import numpy as np
import pytest

from pbrdf.calibration.polarimeter_ambiguity import exchanges, frame_rotation, free_turn, s3_sign, scale_sense
from pbrdf.calibration.polarimeter_signal import Reference
from pbrdf.errors import InputError
from pbrdf.optics.elements import IDEAL
from pbrdf.optics.mueller import linear_polariser
from pbrdf.optics.polarimeter import Polarimeter

GOLD = np.array([[1, 0.036, 0, 0], [0.036, 1, 0, 0], [0, 0, -0.696, -0.717], [0, 0, 0.717, -0.696]])
"""Reflection at 60°, index 0.183 − 3.43i."""

MATRICES = {
    **IDEAL,
    "mirror": np.diag([1.0, 1.0, -1.0, -1.0]),
    "gold": GOLD,
    "glass": np.array([[1, 0.4, 0, 0], [0.4, 1, 0, 0], [0, 0, -0.9, 0], [0, 0, 0, -0.9]]),
    "LP30": linear_polariser(np.deg2rad(30)),
}
STATES = np.random.default_rng(4).uniform(-np.pi, np.pi, (30, 4))


def named(names: str) -> list[Reference]:
    return [Reference(name, MATRICES[name]) for name in names.split()]


@pytest.mark.parametrize(
    ("names", "turn"),
    [
        ("air", 1.0),
        ("mirror", -1.0),
        ("air CPR", 1.0),
        ("air LPH", None),
        ("gold", None),
        ("air mirror", None),
    ],
)
def test_turn_that_no_reference_sees(names: str, turn: float | None) -> None:
    """Generator and analyser turned so leave every signal as it was."""
    found = free_turn(named(names), "test")
    if turn is None:
        assert found is None
        return
    np.testing.assert_allclose(found, [1.0, turn], atol=1e-12)
    zeros = np.array([0.1, 0.2, 0.3, 0.4])
    moved = zeros + 0.7 * np.array([1, 1, turn, turn])
    for reference in named(names):
        one, other = (
            Polarimeter(1.5, 1.6, tuple(z)).measurement_matrix(STATES) @ reference.mueller.ravel()
            for z in (zeros, moved)
        )
        np.testing.assert_allclose(one, other, atol=1e-14)


@pytest.mark.parametrize("names", ["CPR", "CPL"])
def test_a_circular_polariser_alone_ties_no_axes(names: str) -> None:
    with pytest.raises(InputError) as refused:
        free_turn(named(names), "test")
    assert refused.value.field == "references"


@pytest.mark.parametrize(
    "names", ["air", "mirror", "air LPH", "air CPR", "gold", "glass", "LPH", "air mirror"]
)
def test_exchanges_that_are_left_open_leave_every_signal_as_it_was(names: str) -> None:
    references = named(names)
    zeros = np.array([0.1, 0.2, 0.3, 0.4])
    for exchange in exchanges(free_frame=True):
        same = all(
            np.allclose(
                Polarimeter(1.5, 1.6, tuple(zeros)).measurement_matrix(STATES) @ r.mueller.ravel(),
                Polarimeter(1.5, 1.6, tuple(exchange.apply(zeros))).measurement_matrix(STATES)
                @ r.mueller.ravel(),
                atol=1e-9,
            )
            for r in references
        )
        assert same == exchange.leaves(references), exchange


@pytest.mark.parametrize(
    ("names", "frame", "sign", "sense"),
    [
        ("air", False, False, False),
        ("mirror", False, False, False),
        ("air LPH", True, False, False),
        ("air CPR", False, True, False),
        ("air LPH CPR", True, True, False),
        ("gold", True, True, False),
        ("glass", True, False, False),
        ("air mirror", False, False, False),
        ("air LP30", True, False, True),
        ("air LP30 CPL", True, True, True),
    ],
)
def test_what_is_settled_and_by_what(names: str, frame: bool, sign: bool, sense: bool) -> None:
    references = named(names)
    turn = free_turn(references, "test")
    still_open = [e for e in exchanges(free_frame=turn is None) if e.leaves(references)]
    found = (
        frame_rotation(references, turn, still_open, 0.0),
        s3_sign(references, still_open),
        scale_sense(references),
    )
    assert [ambiguity.settled for ambiguity in found] == [frame, sign, sense]
    for ambiguity in found:
        if ambiguity.settled:
            assert set(ambiguity.by.split(", ")) <= set(names.split())
            assert "air" not in ambiguity.by
        else:
            assert "taken" in ambiguity.by
