"""The fit finds what is true, as well as the noise allows, and says how well."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.calibration.polarimeter_fit import PolarimeterFit, fit_polarimeter
from pbrdf.calibration.polarimeter_signal import Drift, Reference
from pbrdf.errors import InputError
from pbrdf.optics.elements import IDEAL
from pbrdf.optics.polarimeter import Polarimeter

Float = NDArray[np.float64]
Signals = Callable[..., Float]

AIR = [Reference("air", np.eye(4))]
MIRROR = [Reference("mirror", np.diag([1.0, 1.0, -1.0, -1.0]))]
WAVES = np.array([[0.2431, 0.2509, 0.2464], [0.2442, 0.2516, 0.2460]])
ZEROS_DEG = (0.0, 1.3, -0.8, 0.25)
DRAWS = 200


def rig(
    zeros_deg: tuple[float, ...] = ZEROS_DEG, extinction: float = 0.0, bands: int = 3
) -> list[Polarimeter]:
    zeros = tuple(np.deg2rad(zeros_deg).tolist())
    return [Polarimeter(g, a, zeros, extinction) for g, a in 2 * np.pi * WAVES.T[:bands]]


def four_by_six() -> Float:
    """The states of Moon et al. 2025."""
    generator, analyser = np.meshgrid([30.0, -45, 60, -90], [0.0, 30, 60, 90, 120, 150], indexing="ij")
    zero = np.zeros(24)
    return np.stack([zero, generator.ravel(), analyser.ravel(), zero], axis=-1)


def assert_found(fit: PolarimeterFit, truth: list[Polarimeter], tolerance: float = 1e-9) -> None:
    for found, true in zip(fit.polarimeters(), truth, strict=True):
        np.testing.assert_allclose(found.zeros, true.zeros, atol=tolerance)
        assert found.generator_retardance == pytest.approx(true.generator_retardance, abs=tolerance)
        assert found.analyser_retardance == pytest.approx(true.analyser_retardance, abs=tolerance)
        assert found.extinction == pytest.approx(true.extinction, abs=tolerance)


@pytest.mark.parametrize("references", [AIR, MIRROR], ids=["air", "mirror"])
@pytest.mark.parametrize(
    "layout", ["analyser fast", "generator fast", "four by six", "mixed waves", "all turn"]
)
def test_without_noise_the_elements_are_exact(
    references: list[Reference], layout: str, slow_and_fast_deg: Float, signals: Signals
) -> None:
    states = {
        "analyser fast": slow_and_fast_deg,
        "generator fast": slow_and_fast_deg[:, [0, 2, 1, 3]],
        "four by six": four_by_six(),
        "mixed waves": 2 * slow_and_fast_deg[:24],
        "all turn": np.random.default_rng(1).uniform(-180, 180, (40, 4)),
    }[layout]
    fit = fit_polarimeter(states, signals(rig(), states, references), references)
    assert_found(fit, rig())
    np.testing.assert_allclose(fit.elements.amplitudes, 1000.0, rtol=1e-9)


def test_extinction_and_drift_are_found(slow_and_fast_deg: Float, signals: Signals) -> None:
    truth = rig(extinction=0.013)
    seen = signals(truth, slow_and_fast_deg, AIR, drift=-0.03)
    fit = fit_polarimeter(slow_and_fast_deg, seen, AIR, extinction=True, drift=True)
    assert_found(fit, truth)
    np.testing.assert_allclose(fit.elements.drifts, -0.03, atol=1e-9)


def test_a_bent_drift_is_found_beside_the_elements(slow_and_fast_deg: Float, signals: Signals) -> None:
    """Through references that let no light pass in the states between which the lamp is known."""
    references = [Reference("air", np.eye(4)), Reference("LPH", IDEAL["LPH"])]
    place = np.arange(36) / 35
    power = 1.0 + 0.03 * place - 0.05 * place**2 + 0.02 * place**3
    seen = power * signals(rig(), slow_and_fast_deg, references)
    places = (0, 9, 18, 27, 35)
    fit = fit_polarimeter(slow_and_fast_deg, seen, references, drift=places)
    assert_found(fit, rig())
    expected = np.broadcast_to(power[list(places[1:])] - 1.0, (2, 3, 4))
    np.testing.assert_allclose(fit.elements.drifts, expected, atol=1e-9)


@pytest.mark.parametrize(
    ("names", "zeros_deg"),
    [
        (["air", "LPH"], (2.0, 1.3, -0.8, 30.25)),
        (["air", "LPV", "CPR"], (-3.0, 80.0, -70.0, 0.25)),
        (["LPH", "CPL"], (2.0, -31.3, 40.8, 30.25)),
    ],
)
def test_references_of_known_axis_and_hand_tell_frame_and_sign(
    names: list[str], zeros_deg: tuple[float, ...], slow_and_fast_deg: Float, signals: Signals
) -> None:
    references = [Reference(name, IDEAL[name]) for name in names]
    fit = fit_polarimeter(
        slow_and_fast_deg, signals(rig(zeros_deg), slow_and_fast_deg, references), references
    )
    assert_found(fit, rig(zeros_deg))
    assert fit.frame_rotation.settled
    assert fit.s3_sign.settled == any(name.startswith("CP") for name in names)


def test_gold_alone_tells_frame_and_sign(slow_and_fast_deg: Float, signals: Signals) -> None:
    """A metal at an oblique angle has an axis, its plane of incidence, and turns the phase one way only."""
    psi, phase = np.deg2rad([43.0, 135.0])
    s, c = np.sin(2 * psi), np.cos(2 * psi)
    gold = np.array(
        [
            [1.0, -c, 0.0, 0.0],
            [-c, 1.0, 0.0, 0.0],
            [0.0, 0.0, s * np.cos(phase), s * np.sin(phase)],
            [0.0, 0.0, -s * np.sin(phase), s * np.cos(phase)],
        ]
    )
    references = [Reference("gold", gold)]
    zeros_deg = (2.0, 31.3, -25.8, 10.25)
    seen = signals(rig(zeros_deg), slow_and_fast_deg, references)
    fit = fit_polarimeter(slow_and_fast_deg, seen, references)
    assert_found(fit, rig(zeros_deg))
    assert (fit.frame_rotation.by, fit.s3_sign.by) == ("gold", "gold")


def test_what_air_leaves_open_follows_the_intended_zeros(slow_and_fast_deg: Float, signals: Signals) -> None:
    """The same signal, once told that everything is turned by 10° and fast axes are exchanged."""
    seen = signals(rig(), slow_and_fast_deg, AIR)
    intended = (10.0, 100.0, -80.0, 10.0)
    fit = fit_polarimeter(slow_and_fast_deg, seen, AIR, intended_zeros_deg=intended)
    assert_found(fit, rig((10.0, 101.3, -80.8, 10.25)))
    assert not fit.frame_rotation.settled
    assert "10°" in fit.frame_rotation.by
    assert not fit.s3_sign.settled


def bound(fit: PolarimeterFit, truth: Float, sigma: Float) -> Float:
    """Cramér-Rao bound of every parameter, from derivatives at the truth."""
    jacobian = (fit.model.jacobian(fit.model.unpack(truth)) / sigma[..., None]).reshape(-1, fit.model.size)
    return np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))


@pytest.mark.parametrize(
    ("extinction", "drift"),
    [(False, False), (True, True), (False, (0, 12, 24, 35))],
    ids=["plain", "with extinction and drift", "with a lamp known at places"],
)
def test_errors_are_those_of_the_cramer_rao_bound_and_are_told(
    extinction: bool, drift: Drift, slow_and_fast_deg: Float, signals: Signals
) -> None:
    truth = rig(extinction=0.01 if extinction else 0.0, bands=2)
    clean = signals(truth, slow_and_fast_deg, AIR, drift=0.02 if drift else 0.0)
    sigma = np.broadcast_to(clean.mean(axis=-1, keepdims=True) / 1000, clean.shape)
    options: Any = {"extinction": extinction, "drift": drift}
    exact = fit_polarimeter(slow_and_fast_deg, clean, AIR, noise=sigma, **options)
    expected = exact.model.pack(exact.elements)
    random = np.random.default_rng(11)
    off, told = np.empty((2, DRAWS, len(expected)))
    for draw in range(DRAWS):
        seen = clean + sigma * random.normal(size=clean.shape)
        fit = fit_polarimeter(slow_and_fast_deg, seen, AIR, noise=sigma, **options)
        off[draw] = fit.model.pack(fit.elements) - expected
        told[draw] = np.sqrt(np.diag(fit.covariance))
    rms = np.sqrt((off**2).mean(axis=0))
    limit = bound(exact, expected, sigma)
    assert (rms <= 1.2 * limit).all(), rms / limit
    # three times the deviation of the binomial law about the normal law's own shares
    for width, share in ((1.0, 0.6827), (2.0, 0.9545)):
        covered = (np.abs(off) <= width * told).mean(axis=0)
        allowed = 3 * np.sqrt(share * (1 - share) / DRAWS)
        np.testing.assert_allclose(covered, share, atol=allowed)


def test_without_known_noise_the_residual_tells_the_same_errors(
    slow_and_fast_deg: Float, signals: Signals
) -> None:
    clean = signals(rig(), slow_and_fast_deg, AIR)
    sigma = np.broadcast_to(clean.mean(axis=-1, keepdims=True) / 1000, clean.shape)
    seen = clean + sigma * np.random.default_rng(2).normal(size=clean.shape)
    known = fit_polarimeter(slow_and_fast_deg, seen, AIR, noise=sigma)
    unknown = fit_polarimeter(slow_and_fast_deg, seen, AIR)
    ratio = np.sqrt(np.diag(unknown.covariance) / np.diag(known.covariance))
    np.testing.assert_allclose(ratio, 1.0, atol=0.25)
    assert unknown.chi_square == pytest.approx(unknown.freedom, rel=0.01)


def test_a_residual_beyond_the_noise_widens_the_errors(slow_and_fast_deg: Float, signals: Signals) -> None:
    seen = signals(rig(extinction=0.01), slow_and_fast_deg, AIR)
    sigma = np.full(seen.shape, 1e-4 * seen.mean())
    fit = fit_polarimeter(slow_and_fast_deg, seen, AIR, noise=sigma)
    same = fit_polarimeter(slow_and_fast_deg, seen, AIR, noise=7 * sigma)
    assert fit.chi_square / fit.freedom > 100
    np.testing.assert_allclose(fit.standard_errors.zeros, same.standard_errors.zeros, rtol=1e-5)


def refusal(states: Float, seen: Float, references: list[Reference] = AIR, **options: object) -> InputError:
    with pytest.raises(InputError) as refused:
        fit_polarimeter(states, seen, references, source="targets", **options)  # type: ignore[arg-type]
    assert refused.value.source == "targets"
    assert "\n" not in str(refused.value)
    return refused.value


def test_too_few_states_are_refused(slow_and_fast_deg: Float, signals: Signals) -> None:
    states = slow_and_fast_deg[:4]
    assert refusal(states, signals(rig(), states, AIR)).field == "states"


def test_states_that_leave_an_element_open_are_refused_by_its_name(signals: Signals) -> None:
    """The analyser's retarder never turns: nothing tells where its axis is."""
    turn = 5.0 * np.arange(36)
    states = np.stack([0 * turn, turn, 0 * turn, 0 * turn], axis=-1)
    refused = refusal(states, signals(rig(bands=1), states, AIR))
    assert refused.field == "states"
    assert "analyser" in refused.problem


def test_references_that_do_not_tie_the_modules_are_refused(
    slow_and_fast_deg: Float, signals: Signals
) -> None:
    depolariser = [Reference("white tile", np.diag([1.0, 0, 0, 0]))]
    refused = refusal(slow_and_fast_deg, signals(rig(), slow_and_fast_deg, depolariser), depolariser)
    assert refused.field == "references"


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_signals_that_are_not_finite_are_refused(
    value: float, slow_and_fast_deg: Float, signals: Signals
) -> None:
    seen = signals(rig(), slow_and_fast_deg, AIR)
    seen[0, 1, 3] = value
    refused = refusal(slow_and_fast_deg, seen)
    assert refused.field == "signal"
    assert "band 1, state 3" in refused.problem


def test_other_arrays_are_refused(slow_and_fast_deg: Float, signals: Signals) -> None:
    seen = signals(rig(), slow_and_fast_deg, AIR)
    assert refusal(slow_and_fast_deg[:30], seen).field == "signal"
    assert refusal(slow_and_fast_deg[:, :3], seen).field == "states_deg"
    assert refusal(slow_and_fast_deg, 0 * seen).field == "signal"
    assert refusal(slow_and_fast_deg, seen, noise=0 * seen).field == "noise"
    assert refusal(slow_and_fast_deg, seen, noise=seen[:, :1]).field == "noise"
    assert refusal(slow_and_fast_deg, seen, references=[]).field == "references"
    broken = [Reference("broken", np.full((4, 4), np.nan))]
    assert refusal(slow_and_fast_deg, seen, references=broken).field == "references.broken"
