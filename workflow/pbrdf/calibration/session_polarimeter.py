"""A session's photographs of the lamp through known elements to its ``polarimeter.json``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from pbrdf.calibration.lamp_signal import LampSignal, lamp_signal
from pbrdf.calibration.polarimeter import KIND
from pbrdf.calibration.polarimeter_fit import PolarimeterFit, fit_polarimeter
from pbrdf.calibration.polarimeter_result import measured_polarimeter
from pbrdf.calibration.polarimeter_signal import Drift, Reference
from pbrdf.capture.frames import in_order, open_frames
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FramesHeader
from pbrdf.formats.documents import write_document
from pbrdf.formats.receipt import digests
from pbrdf.optics.arm import Vector
from pbrdf.optics.elements import IDEAL
from pbrdf.optics.frames import change_frames

UP: Vector = (0.0, -1.0, 0.0)
"""X axis of both modules' frames, in the camera's frame: the references' horizontal lies across it."""

FEWEST_REPEATS = 2
"""Repeats of a state, beside its own turn in the list, that tell more of the lamp than a straight line."""

_FROM_HORIZONTAL = np.pi / 2


def calibrate_polarimeter(manifests: Mapping[str, str | Path], document: str | Path) -> None:
    """Measure zeros and retardances.

    Parameters
    ----------
    manifests : mapping
        By reference (`pbrdf.optics.elements.IDEAL`) the manifest of its only light; frames lie beside it.
    document : str or Path
        What is written.

    Raises
    ------
    InputError
        If the photographs cannot be used, differ in bands or states, or do not tell the elements.
    """
    first, signals = _signals(manifests)
    bands = first.bands_nm
    fit = _fit(signals, run_drift(first))
    content = measured_polarimeter(fit, bands, UP, "DN/s")
    lamp = {
        name: {
            str(nm): {"exposure_s": one.exposure_s, "pixels": one.pixels}
            for nm, one in zip(bands, by_band, strict=True)
        }
        for name, by_band in signals.items()
    }
    write_document(document, KIND, {**content, "lamp": lamp, "inputs": digests(manifests)})


def reference(name: str) -> Reference:
    """A known element in the modules' frames."""
    return Reference(name, change_frames(IDEAL[name], _FROM_HORIZONTAL, _FROM_HORIZONTAL))


def run_drift(header: FramesHeader) -> Drift:
    """What is fitted of the lamp's drift: its power wherever a state was taken again, if that was often.

    The repeated state may be a dark one of some reference: it says only how finely the drift is told.
    """
    if len(header.references) < FEWEST_REPEATS:
        return True
    order = in_order(header)
    return tuple(
        place for place, (state, repeat) in enumerate(order) if repeat or state == header.reference_state
    )


def _signals(manifests: Mapping[str, str | Path]) -> tuple[FramesHeader, dict[str, list[LampSignal]]]:
    """Header of the first reference, and by reference the signals of each band."""
    stores = {name: open_frames(manifest) for name, manifest in manifests.items()}
    first = next(iter(stores.values())).header
    for store in stores.values():
        for field in ("bands_nm", "states_deg", "references"):
            if getattr(store.header, field) != getattr(first, field):
                problem = f"are others than those of {first.material}"
                raise InputError(store.path, field, problem, "take all references with one plan")
    signals = {name: [lamp_signal(store, nm) for nm in first.bands_nm] for name, store in stores.items()}
    return first, signals


def _fit(signals: Mapping[str, list[LampSignal]], drift: Drift) -> PolarimeterFit:
    return fit_polarimeter(
        next(iter(signals.values()))[0].states_deg,
        np.array([[one.signal for one in by_band] for by_band in signals.values()]),
        [reference(name) for name in signals],
        noise=np.array([[one.noise for one in by_band] for by_band in signals.values()]),
        drift=drift,
    )
