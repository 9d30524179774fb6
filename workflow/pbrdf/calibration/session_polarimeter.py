"""A session's photographs of the lamp through known elements to its ``polarimeter.json``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from pbrdf.calibration.lamp_signal import LampSignal, lamp_signal
from pbrdf.calibration.polarimeter import KIND
from pbrdf.calibration.polarimeter_fit import PolarimeterFit, fit_polarimeter
from pbrdf.calibration.polarimeter_result import measured_polarimeter
from pbrdf.calibration.polarimeter_signal import Reference
from pbrdf.capture.frames import read_manifest
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FrameStore
from pbrdf.formats.documents import write_document
from pbrdf.formats.receipt import digests
from pbrdf.optics.arm import Vector
from pbrdf.optics.elements import IDEAL
from pbrdf.optics.frames import change_frames

UP: Vector = (0.0, -1.0, 0.0)
"""X axis of both modules' frames, in the camera's frame: the references' horizontal lies across it."""

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
    bands, signals = _signals(manifests)
    fit = _fit(signals)
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


def _signals(manifests: Mapping[str, str | Path]) -> tuple[tuple[int, ...], dict[str, list[LampSignal]]]:
    """Bands, and by reference the signals of each."""
    stores = {}
    for name, manifest in manifests.items():
        read_manifest(manifest)
        stores[name] = FrameStore.open(Path(manifest).parent / "frames.zarr")
    first = next(iter(stores.values())).header
    for store in stores.values():
        for field in ("bands_nm", "states_deg", "references"):
            if getattr(store.header, field) != getattr(first, field):
                problem = f"are others than those of {first.material}"
                raise InputError(store.path, field, problem, "take all references with one plan")
    signals = {name: [lamp_signal(store, nm) for nm in first.bands_nm] for name, store in stores.items()}
    return first.bands_nm, signals


def _fit(signals: Mapping[str, list[LampSignal]]) -> PolarimeterFit:
    # what the lamp does within a run is fitted: the state that is repeated may be a dark one
    return fit_polarimeter(
        next(iter(signals.values()))[0].states_deg,
        np.array([[one.signal for one in by_band] for by_band in signals.values()]),
        [reference(name) for name in signals],
        noise=np.array([[one.noise for one in by_band] for by_band in signals.values()]),
        drift=True,
    )
