"""What the pixels make of equal light: vignetting and uneven sensitivity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.formats.band_exr import read_band, write_bands
from pbrdf.formats.documents import member, read_document, wavelengths
from pbrdf.formats.receipt import digest

KIND = "flat/1"


@dataclass(frozen=True)
class FlatField:
    """Relative response of each pixel by band, in an image beside ``flat.json``.

    A measured value is the response times what an even camera would have measured.
    """

    image: Path
    bands_nm: tuple[int, ...]

    @classmethod
    def read(cls, path: str | Path) -> FlatField:
        """Read ``flat.json``; raises `InputError` if a value is missing, or its image is another."""
        content = read_document(path, KIND)
        image = Path(path).parent / str(member(path, content, "image"))
        if not image.is_file():
            raise InputError(path, "image", f"there is no {image}", "restore it, or calibrate again")
        if digest([image]) != member(path, content, "content"):
            raise InputError(path, "content", f"{image.name} is another image", "calibrate again")
        return cls(image, tuple(wavelengths(path, content, "bands")))

    def at(self, band_nm: int, window: tuple[slice, slice], shape: tuple[int, int]) -> NDArray[np.float32]:
        """Response (rows, columns) in a window of frames of a shape; raises `InputError` if there is none."""
        picture = read_band(self.image, band_nm)
        if picture.shape != shape:
            problem = f"has shape {picture.shape} where the frames have {shape}"
            raise InputError(self.image, f"{band_nm}nm", problem, "calibrate with this camera")
        return np.ascontiguousarray(picture[window])


def flat_image(path: str | Path) -> Path:
    """Image that goes with a ``flat.json``."""
    return Path(path).with_suffix(".exr")


def named_image(path: str | Path) -> dict[str, str]:
    """Entries of a ``flat.json`` that name the image beside it."""
    return {"image": flat_image(path).name, "content": digest([flat_image(path)])}


def write_flat(path: str | Path, pictures: Mapping[int, NDArray[np.float32]]) -> dict[str, Any]:
    """Write the image that goes with a ``flat.json``, and return the content that names it."""
    write_bands(flat_image(path), pictures, {"schema": f"pbrdf/{KIND}", "units": "relative response"})
    return {
        **named_image(path),
        "bands": {
            str(nm): {"least": float(np.nanmin(picture)), "greatest": float(np.nanmax(picture))}
            for nm, picture in pictures.items()
        },
    }
