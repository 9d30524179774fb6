"""Each fault of a rig is told from the others, and what cannot be used is called so."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.calibration.polarimeter_fit import fit_polarimeter
from pbrdf.calibration.polarimeter_signal import Reference
from pbrdf.calibration.polarimeter_verdict import Verdict, judge
from pbrdf.optics.polarimeter import Polarimeter

Float = NDArray[np.float64]
Signals = Callable[..., Float]

AIR = [Reference("air", np.eye(4))]
BANDS_NM = [450, 550, 650]
RIG = [
    Polarimeter(2 * np.pi * g, 2 * np.pi * a, (0.0, 0.0227, -0.0140, 0.0044))
    for g, a in ((0.2431, 0.2442), (0.2509, 0.2516), (0.2464, 0.2460))
]


def verdict(states: Float, seen: Float, sigma: Float | None, **options: bool) -> Verdict:
    fit = fit_polarimeter(states, seen, AIR, noise=sigma, **options)
    found = judge(fit, BANDS_NM)
    assert "\n" not in found.words
    assert found.words.startswith("unusable") != found.usable
    return found


@pytest.fixture
def clean(slow_and_fast_deg: Float, signals: Signals) -> Float:
    return signals(RIG, slow_and_fast_deg, AIR)


@pytest.fixture
def sigma(clean: Float) -> Float:
    return np.broadcast_to(clean.mean(axis=-1, keepdims=True) / 1000, clean.shape)


def noisy(clean: Float, sigma: Float, seed: int = 5) -> Float:
    return clean + sigma * np.random.default_rng(seed).normal(size=clean.shape)


def test_a_faultless_rig_is_good(slow_and_fast_deg: Float, clean: Float, sigma: Float) -> None:
    for known in (sigma, None):
        found = verdict(slow_and_fast_deg, noisy(clean, sigma), known)
        assert found.usable
        assert found.words.startswith("good: residual 0.")


def test_numbers_without_noise_raise_no_suspicion(slow_and_fast_deg: Float, clean: Float) -> None:
    assert ";" not in verdict(slow_and_fast_deg, clean, None).words


def _wobble(index: int, harmonic: int) -> Callable[[Float, Float], Float]:
    return lambda seen, states: seen * (1 + 0.006 * np.cos(harmonic * np.deg2rad(states[:, index]) + 0.3))


def _one_state(seen: Float, states: Float) -> Float:
    changed = seen.copy()
    changed[..., 17] *= 1.02
    return changed


FAULTS: dict[str, tuple[Callable[[Float, Float], Float], str]] = {
    "wedge": (_wobble(1, 1), "turns with the generator retarder"),
    "tilt": (_wobble(1, 2), "turns with the generator retarder"),
    "far wedge": (_wobble(2, 1), "turns with the analyser retarder"),
    "far tilt": (_wobble(2, 2), "turns with the analyser retarder"),
    "drift": (lambda seen, states: seen * np.linspace(0.99, 1.01, len(states)), "the lamp drifts"),
    "background": (lambda seen, states: seen + 5.0, "background"),
    "one state": (_one_state, "state 17 of the list stands out"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_named(name: str, slow_and_fast_deg: Float, clean: Float, sigma: Float) -> None:
    fault, words = FAULTS[name]
    for known in (sigma, None):
        found = verdict(slow_and_fast_deg, noisy(fault(clean, slow_and_fast_deg), sigma), known)
        assert found.usable
        assert words in found.words
        assert found.words.split(":")[0] in ("fair", "poor")


def test_axes_that_turn_with_the_wavelength_are_named(
    slow_and_fast_deg: Float, signals: Signals, sigma: Float
) -> None:
    zeros = [(0.0, 0.0227, -0.0140 + off, 0.0044) for off in (-0.004, 0.0, 0.004)]
    rig = [
        Polarimeter(p.generator_retardance, p.analyser_retardance, z) for p, z in zip(RIG, zeros, strict=True)
    ]
    seen = noisy(signals(rig, slow_and_fast_deg, AIR), sigma)
    found = verdict(slow_and_fast_deg, seen, sigma)
    assert "the axis of the analyser's retarder turns with the wavelength" in found.words


@pytest.mark.parametrize(("extinction", "drift"), [(0.01, 0.0), (0.0, 0.03)])
def test_a_fault_that_is_fitted_is_none(
    extinction: float, drift: float, slow_and_fast_deg: Float, signals: Signals, sigma: Float
) -> None:
    rig = [Polarimeter(p.generator_retardance, p.analyser_retardance, p.zeros, extinction) for p in RIG]
    seen = noisy(signals(rig, slow_and_fast_deg, AIR, drift), sigma)
    assert not verdict(slow_and_fast_deg, seen, sigma).words.startswith("good")
    options = {"extinction": extinction > 0, "drift": drift > 0}
    assert verdict(slow_and_fast_deg, seen, sigma, **options).words.startswith("good")


def test_too_much_background_taken_off_is_told(slow_and_fast_deg: Float, clean: Float, sigma: Float) -> None:
    found = verdict(slow_and_fast_deg, noisy(clean - 5.0, sigma), sigma, extinction=True)
    assert found.words.startswith("fair")
    assert "too much background" in found.words


def test_a_scale_that_counts_the_other_way_is_named(
    slow_and_fast_deg: Float, clean: Float, sigma: Float
) -> None:
    found = verdict(slow_and_fast_deg * [1, 1, -1, 1], noisy(clean, sigma), sigma)
    assert not found.usable
    assert "the scale of the generator retarder" in found.words or "analyser retarder" in found.words
    assert "counts the other way" in found.words


def test_noise_alone_is_unusable(slow_and_fast_deg: Float, clean: Float, sigma: Float) -> None:
    seen = np.random.default_rng(0).uniform(50, 100, clean.shape)
    for known in (sigma, None):
        assert not verdict(slow_and_fast_deg, seen, known).usable


def test_a_residual_far_over_the_noise_is_unusable(
    slow_and_fast_deg: Float, clean: Float, sigma: Float
) -> None:
    seen = noisy(clean * (1 + 0.04 * np.sin(np.arange(36) ** 2)), sigma)
    found = verdict(slow_and_fast_deg, seen, sigma)
    assert not found.usable
    assert "times the noise" in found.words


def test_angles_that_the_noise_leaves_open_are_unusable(
    slow_and_fast_deg: Float, clean: Float, sigma: Float
) -> None:
    vague = verdict(slow_and_fast_deg, noisy(clean, 40 * sigma), 40 * sigma)
    assert vague.words.startswith("poor")
    assert "is known to" in vague.words
    few = slice(6, 20)
    found = verdict(slow_and_fast_deg[few], noisy(clean, 60 * sigma)[..., few], 60 * sigma[..., few])
    assert not found.usable
    assert "is known to" in found.words
