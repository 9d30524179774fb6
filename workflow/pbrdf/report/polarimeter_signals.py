"""What references showed a polarimeter, what its document predicts, and the matrices that both make of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf.calibration.lamp_signal import lamp_signal
from pbrdf.calibration.polarimeter import ELEMENTS
from pbrdf.calibration.polarimeter_signal import Drift, Elements, SignalModel, lamp_functions
from pbrdf.calibration.session_polarimeter import reference
from pbrdf.capture.frames import in_order
from pbrdf.formats.capture_store import FrameStore
from pbrdf.formats.documents import member, number, numbers, wavelengths
from pbrdf.optics.elements import IDEAL
from pbrdf.optics.frames import change_frames
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.report.figures import Float
from pbrdf.report.polarimeter_maps import disc_residuals

QUARTER_WAVES = Polarimeter(np.pi / 2, np.pi / 2)
"""What a rig is meant to be, before it was calibrated."""

_TO_HORIZONTAL = -np.pi / 2


@dataclass(frozen=True)
class ReferenceSignals:
    """Signals of references in the order they were taken, R references in B bands of N states.

    Attributes
    ----------
    names : list of str
    bands_nm : list of int
    repeats : ndarray of bool, shape (N,)
        Which of the states are repeats.
    signal, noise, predicted : ndarray, shape (R, B, N)
        DN/s.
    discs : list of list of ndarray, shape (rows, columns)
        By reference and band, each pixel's residual over its noise (`disc_residuals`).
    before, after : dict of int to list of ndarray
        By band, a matrix (4, 4) a reference, divided by M00, in horizontal frames.
    ideal : list of ndarray
    """

    names: list[str]
    bands_nm: list[int]
    repeats: NDArray[np.bool_]
    signal: Float
    noise: Float
    predicted: Float
    discs: list[list[Float]]
    before: dict[int, list[Float]]
    after: dict[int, list[Float]]
    ideal: list[Float]

    @property
    def pulls(self) -> Float:
        """Found less predicted in units of the noise, shape (R, B, N)."""
        pulls: Float = (self.signal - self.predicted) / self.noise
        return pulls


def read_signals(
    document: str | Path, content: Mapping[str, Any], manifests: Mapping[str, str | Path]
) -> ReferenceSignals:
    """Read the references' photographs, and predict them from a document.

    Parameters
    ----------
    document : str or Path
        ``polarimeter.json``.
    content : mapping
        What it holds.
    manifests : mapping
        By reference its manifest.

    Raises
    ------
    InputError
        If a photograph cannot be used, or the document does not hold its reference or band.
    """
    bands = list(wavelengths(document, content, "bands"))
    stores = {name: FrameStore.open(Path(path).parent / "frames.zarr") for name, path in manifests.items()}
    found = [[lamp_signal(store, nm) for nm in bands] for store in stores.values()]
    states = np.deg2rad(found[0][0].states_deg)
    signal = np.array([[one.signal for one in by_band] for by_band in found])
    names = list(manifests)
    elements = document_elements(document, content, names)
    model = SignalModel(
        states,
        [reference(name) for name in names],
        len(bands),
        free_frame=True,
        frame=0.0,
        extinction=True,
        drift=_drift(document, content),
    )
    predicted = model.signal(elements)
    steady = signal / model.lamp_power(elements)
    return ReferenceSignals(
        names,
        bands,
        np.array([repeat for _, repeat in in_order(next(iter(stores.values())).header)], np.bool_),
        signal,
        np.array([[one.noise for one in by_band] for by_band in found]),
        predicted,
        [
            [
                disc_residuals(store, nm, one, expected)
                for nm, one, expected in zip(bands, by_band, of_reference, strict=True)
            ]
            for store, by_band, of_reference in zip(stores.values(), found, predicted, strict=True)
        ],
        {nm: _matrices(QUARTER_WAVES, states, steady[:, b]) for b, nm in enumerate(bands)},
        {nm: _matrices(_polarimeter(elements, b), states, steady[:, b]) for b, nm in enumerate(bands)},
        [IDEAL[name] / IDEAL[name][0, 0] for name in names],
    )


def document_elements(document: str | Path, content: Mapping[str, Any], names: Sequence[str]) -> Elements:
    """Values of a document as the model of signals takes them; raises `InputError` where one is missing."""
    bands = wavelengths(document, content, "bands").values()

    def each(field: str) -> Float:
        return np.array([number(document, content, f"bands.{band}.{field}") for band in bands])

    def cells(read: Callable[..., Any], field: str, *form: Any) -> Float:
        places = [[f"bands.{band}.references.{name}.{field}" for band in bands] for name in names]
        return np.array([[read(document, content, place, *form) for place in row] for row in places])

    leaks = [member(document, content, f"bands.{band}").get("extinction_ratio", 0.0) for band in bands]
    return Elements(
        zeros=np.deg2rad([number(document, content, f"zeros_deg.{name}") for name in ELEMENTS]),
        generator_retardances=np.deg2rad(each("generator_retardance_deg")),
        analyser_retardances=np.deg2rad(each("analyser_retardance_deg")),
        extinctions=np.array(leaks, dtype=np.float64),
        amplitudes=cells(number, "amplitude"),
        drifts=cells(numbers, "lamp_drift", lamp_functions(_drift(document, content), 1).shape[1]),
    )


def _drift(document: str | Path, content: Mapping[str, Any]) -> Drift:
    """What a document tells of the lamp's drift: a straight line, or its power at places of the run."""
    places = member(document, content, "lamp_known_at")
    return True if places is None else tuple(places)


def _polarimeter(elements: Elements, band: int) -> Polarimeter:
    first, second, third, fourth = elements.zeros.tolist()
    return Polarimeter(
        float(elements.generator_retardances[band]),
        float(elements.analyser_retardances[band]),
        (first, second, third, fourth),
        float(elements.extinctions[band]),
    )


def _matrices(polarimeter: Polarimeter, states: Float, signals: Float) -> list[Float]:
    """Matrices (4, 4) of signals (R, N) by least squares, over M00, in horizontal frames."""
    inverse = np.linalg.pinv(polarimeter.measurement_matrix(states))
    matrices = change_frames((signals @ inverse.T).reshape(-1, 4, 4), _TO_HORIZONTAL, _TO_HORIZONTAL)
    return [matrix / matrix[0, 0] for matrix in matrices]
