"""The fit's model of the signal is the polarimeter's own, and its derivatives are its derivatives."""

from __future__ import annotations

import numpy as np
import pytest

from pbrdf.calibration.polarimeter_signal import Reference, SignalModel, lamp_functions, polarised_light
from pbrdf.optics.polarimeter import Polarimeter

RANDOM = np.random.default_rng(3)
STATES = RANDOM.uniform(-np.pi, np.pi, (9, 4))
REFERENCES = [Reference("air", np.eye(4)), Reference("any", RANDOM.normal(size=(4, 4)))]
BANDS = 3


def model(**options: object) -> SignalModel:
    chosen = {"free_frame": True, "frame": 0.0, "extinction": True, "drift": True} | options
    return SignalModel(STATES, REFERENCES, BANDS, **chosen)  # type: ignore[arg-type]


def test_generated_light_is_the_polarimeters() -> None:
    retardance, leak = np.array([1.4, 2.0]), np.array([0.0, 0.03])
    vectors, _ = polarised_light(STATES[:, 0], STATES[:, 1], retardance, leak)
    for band in range(2):
        expected = Polarimeter(retardance[band], 1.0, extinction=leak[band]).generated(STATES)
        np.testing.assert_allclose(vectors[band], expected, atol=1e-15)


def test_signals_are_the_polarimeters_times_amplitude_and_lamp() -> None:
    signal_model = model()
    elements = signal_model.unpack(RANDOM.uniform(0.1, 0.9, signal_model.size))
    time = np.linspace(-0.5, 0.5, len(STATES))
    for r, reference in enumerate(REFERENCES):
        for b in range(BANDS):
            polarimeter = Polarimeter(
                elements.generator_retardances[b],
                elements.analyser_retardances[b],
                tuple(elements.zeros),
                elements.extinctions[b],
            )
            lamp = elements.amplitudes[r, b] * (1 + elements.drifts[r, b] * time)
            expected = lamp * (polarimeter.measurement_matrix(STATES) @ reference.mueller.ravel())
            np.testing.assert_allclose(signal_model.signal(elements)[r, b], expected, atol=1e-14)


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"free_frame": False, "frame": 0.4},
        {"extinction": False, "drift": False},
        {"drift": (0, 2, 5, 8)},
        {"peaks": np.full((len(REFERENCES), BANDS), 7.0)},
    ],
    ids=["everything free", "fixed frame", "ideal", "lamp known at places", "kept at the peak"],
)
def test_derivatives_are_those_of_central_differences(options: dict[str, object]) -> None:
    signal_model = model(**options)
    vector = RANDOM.uniform(0.2, 1.0, signal_model.size)
    step = 1e-6

    def at(shift: np.ndarray) -> np.ndarray:
        return signal_model.signal(signal_model.unpack(vector + shift))

    differences = [(at(h) - at(-h)) / (2 * step) for h in step * np.eye(signal_model.size)]
    found = signal_model.jacobian(signal_model.unpack(vector))
    np.testing.assert_allclose(found, np.stack(differences, axis=-1), atol=1e-8, rtol=1e-8)


def test_the_lamp_takes_its_values_at_the_places_and_is_smooth_between() -> None:
    places = (2, 9, 20, 33)
    functions = lamp_functions(places, 36)
    changes = np.array([0.1, -0.2, 0.05])
    power = 1.0 + functions @ changes
    np.testing.assert_allclose(power[list(places)], [1.0, 1.1, 0.8, 1.05], atol=1e-12)
    np.testing.assert_allclose(np.diff(power[2:34], 4), 0.0, atol=1e-12)
    np.testing.assert_allclose(power[[0, 1, 34, 35]], [1.0, 1.0, 1.05, 1.05], atol=1e-12)


def test_two_places_make_a_straight_line() -> None:
    line, between = lamp_functions(True, 36), lamp_functions((0, 35), 36)
    np.testing.assert_allclose(between, line + 0.5, atol=1e-12)
    assert lamp_functions(False, 36).shape == (36, 0)


def test_a_vector_and_its_values_are_the_same() -> None:
    plain = model(free_frame=False, extinction=False)
    for signal_model in (model(), plain, model(drift=False), model(drift=(0, 4, 8))):
        vector = RANDOM.uniform(0.1, 1.0, signal_model.size)
        np.testing.assert_array_equal(signal_model.pack(signal_model.unpack(vector)), vector)


def test_a_signal_kept_at_its_peak_reaches_it() -> None:
    signal_model = SignalModel(
        STATES,
        REFERENCES[:1],
        BANDS,
        free_frame=False,
        frame=0.0,
        extinction=False,
        drift=False,
        peaks=np.array([[3.0, 4.0, 5.0]]),
    )
    elements = signal_model.unpack(RANDOM.uniform(0.5, 1.0, signal_model.size))
    np.testing.assert_allclose(signal_model.signal(elements).max(axis=-1), [[3.0, 4.0, 5.0]])
