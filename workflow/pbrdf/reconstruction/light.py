"""One light, from its capture to its Mueller images on the disk."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.polarimeter import PolarimeterCalibration
from pbrdf.calibration.radiometry import Radiometry
from pbrdf.calibration.sphere import Sphere
from pbrdf.capture.frames import read_manifest
from pbrdf.formats.capture_store import FramesHeader, FrameStore, band_name
from pbrdf.formats.folders import replace_folder
from pbrdf.formats.mueller_exr import write_mueller_exr
from pbrdf.formats.receipt import write_receipt
from pbrdf.reconstruction.mueller_image import reconstruct

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
        Documents by kind: ``polarimeter`` always; ``radiometry`` for the noise; ``camera`` and
        ``sphere`` to crop to the sphere.
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
    read_manifest(manifest)
    store = FrameStore.open(Path(manifest).parent / "frames.zarr")
    polarimeter = PolarimeterCalibration.read(calibrations["polarimeter"])
    radiometry = Radiometry.read(calibrations["radiometry"]) if "radiometry" in calibrations else None
    window = _window(store.header, calibrations, margin_px)
    bands = {nm: polarimeter.at(nm, calibrations["polarimeter"]) for nm in store.header.bands_nm}
    summary: dict[str, Any] = {}
    with replace_folder(folder) as beside:
        for band_nm, elements in bands.items():
            image = reconstruct(store, band_nm, elements, radiometry, window)
            write_mueller_exr(
                beside / f"{band_name(band_nm)}.exr",
                image.mueller,
                image.variance,
                (image.first_row, image.first_column),
                {
                    "material": store.header.material,
                    "light": store.header.light,
                    "band": f"{band_nm} nm",
                    "units": "DN/s",
                    "frames": FRAMES,
                },
            )
            summary[band_name(band_nm)] = image.summary
            # of a large frame more than a gigabyte, which the next band needs
            del image
    write_receipt(
        receipt,
        outputs=[folder],
        inputs={"manifest": [manifest], **{kind: [path] for kind, path in calibrations.items()}},
        settings={"margin_px": margin_px, "code": code},
        summary=summary,
    )


def _window(
    header: FramesHeader, calibrations: Mapping[str, str | Path], margin_px: int
) -> tuple[slice, slice]:
    if "sphere" not in calibrations:
        return slice(0, header.rows), slice(0, header.columns)
    return Sphere.read(calibrations["sphere"]).window(Camera.read(calibrations["camera"]), margin_px)
