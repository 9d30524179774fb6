"""One light, from its capture to its Mueller images on the disk."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.flat_field import FlatField
from pbrdf.calibration.polarimeter import PolarimeterCalibration
from pbrdf.calibration.radiometry import Radiometry
from pbrdf.calibration.sphere import Sphere
from pbrdf.capture.frames import open_frames
from pbrdf.formats.capture_store import FramesHeader, band_name
from pbrdf.formats.folders import replace_folder
from pbrdf.formats.mueller_exr import write_mueller_exr
from pbrdf.formats.receipt import write_receipt
from pbrdf.reconstruction.dark import darkness
from pbrdf.reconstruction.mueller_image import reconstruct
from pbrdf.reconstruction.physicality import is_physical
from pbrdf.reconstruction.streaming import Workspace

SAMPLE = 1 << 20
"""Pixels from which the share of physical matrices is told."""

FRAMES = "from the generator's frame to the analyser's; conventions of Mitsuba 3"


def reconstruct_light(
    manifest: str | Path,
    calibrations: Mapping[str, str | Path],
    folder: str | Path,
    receipt: str | Path,
    *,
    margin_px: int,
    code: str,
) -> None:
    """Make the Mueller images of a light, one EXR a band, and their receipt.

    Parameters
    ----------
    manifest : str or Path
        The light's manifest; the frames lie beside it.
    calibrations : mapping
        Documents by kind: ``polarimeter`` always; ``radiometry`` for the noise; ``flat``;
        ``camera`` and ``sphere`` to crop to the sphere.
    folder : str or Path
        Where the images go, as ``550nm.exr``.
    receipt : str or Path
        Where the receipt goes; its summary holds the figures of each band.
    margin_px : int
        Pixels kept around the sphere.
    code : str
        Digest of the code.

    Raises
    ------
    InputError
        If the capture or a calibration cannot be used.
    """
    store = open_frames(manifest)
    polarimeter = PolarimeterCalibration.read(calibrations["polarimeter"])
    radiometry = Radiometry.read(calibrations["radiometry"]) if "radiometry" in calibrations else None
    flat = FlatField.read(calibrations["flat"]) if "flat" in calibrations else None
    window = _window(store.header, calibrations, margin_px)
    frame = (store.header.rows, store.header.columns)
    bands = {nm: polarimeter.at(nm, calibrations["polarimeter"]) for nm in store.header.bands_nm}
    store.require_complete()
    summary: dict[str, Any] = {}
    dark = darkness(store if radiometry is None else store.saturating_at(radiometry.saturation_dn), window)
    workspace = Workspace.of(store.header, window)
    with replace_folder(folder) as beside:
        for band_nm, elements in bands.items():
            response = flat.at(band_nm, window, frame) if flat else None
            image = reconstruct(store, band_nm, elements, radiometry, window, response, workspace, dark)
            write_mueller_exr(
                beside / f"{band_name(band_nm)}.exr",
                image.mueller,
                image.variance,
                image.missing,
                (image.first_row, image.first_column),
                {
                    "material": store.header.material,
                    "light": store.header.light,
                    "band": f"{band_nm} nm",
                    "units": "DN/s",
                    "frames": FRAMES,
                },
            )
            summary[band_name(band_nm)] = {**image.summary, "physical_share": _physical_share(image.mueller)}
    write_receipt(
        receipt,
        outputs=[folder],
        inputs={"manifest": [manifest], **{kind: [path] for kind, path in calibrations.items()}},
        settings={"margin_px": margin_px, "code": code},
        summary=summary,
    )


def _physical_share(mueller: NDArray[np.float32]) -> float | None:
    """Share of the known pixels whose matrix is physical, of large images from evenly spread pixels."""
    elements = mueller.reshape(16, -1)
    chosen = elements[:, :: max(1, elements.shape[1] // SAMPLE)].T.reshape(-1, 4, 4)
    known = np.isfinite(chosen[:, 0, 0])
    return float(is_physical(chosen[known]).mean()) if known.any() else None


def _window(
    header: FramesHeader, calibrations: Mapping[str, str | Path], margin_px: int
) -> tuple[slice, slice]:
    if "sphere" not in calibrations:
        return slice(0, header.rows), slice(0, header.columns)
    return Sphere.read(calibrations["sphere"]).window(Camera.read(calibrations["camera"]), margin_px)
