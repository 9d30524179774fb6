"""One picture a band as OpenEXR: float channels named ``450nm`` and so on."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import OpenEXR
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.formats.capture_store import band_name
from pbrdf.formats.exr_file import open_exr, write_exr


def write_bands(
    path: str | Path, pictures: Mapping[int, NDArray[np.float32]], attributes: Mapping[str, str]
) -> None:
    """Write pictures (rows, columns) by band centre (nm), beside and then renamed.

    `attributes` are text for the header: what the values are, and their unit.
    """
    channels = {band_name(nm): np.ascontiguousarray(picture) for nm, picture in pictures.items()}
    write_exr(path, {"compression": OpenEXR.ZIP_COMPRESSION, **attributes}, channels)


def read_band(path: str | Path, band_nm: int) -> NDArray[np.float32]:
    """Picture (rows, columns) of a band; raises `InputError` if there is none."""
    path = Path(path)
    if not path.is_file():
        raise InputError(path, "file", "does not exist", "restore it, or calibrate again")
    try:
        with open_exr(path) as image:
            channels = image.channels()
            if band_name(band_nm) not in channels:
                problem = f"is missing (there: {', '.join(sorted(channels))})"
                raise InputError(path, band_name(band_nm), problem, "calibrate that band too")
            picture = np.array(channels[band_name(band_nm)].pixels, np.float32)
    except ValueError as error:
        raise InputError(path, "file", f"is not an OpenEXR image ({error})", "calibrate again") from None
    return picture
