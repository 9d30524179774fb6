"""What the pixels make of equal light: vignetting and uneven sensitivity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from pbrdf.calibration.verdicts import POOR, UNUSABLE, graded, judged
from pbrdf.errors import InputError
from pbrdf.formats.band_exr import read_band, write_bands
from pbrdf.formats.capture_store import band_name
from pbrdf.formats.documents import member, read_document, wavelengths
from pbrdf.formats.receipt import digest

KIND = "flat/1"

MIDDLE = 0.125
"""Share of the rows and of the columns, in the middle of the frame, whose mean response is one."""

DEAD, STUCK = 0.5, 2.0
"""Response relative to the median of its neighbours below and above which a pixel is not to be used."""

NORMALISATION = "the mean over the middle eighth of rows and columns is 1"

_ERROR = ((0.01, POOR), (0.05, UNUSABLE))
"""Relative standard error of a pixel: it goes into every Mueller matrix of that pixel."""

_MISSING = ((0.02, POOR), (0.5, UNUSABLE))
"""Share of the pixels without a response."""


@dataclass(frozen=True)
class FlatField:
    """Relative response of each pixel by band, in an image beside ``flat.json``.

    A measured value is the response times what an even camera would have measured.
    """

    image: Path
    bands_nm: tuple[int, ...]

    @classmethod
    def read(cls, path: str | Path) -> FlatField:
        """Read ``flat.json``.

        Raises
        ------
        InputError
            If a value is missing, its image is another, or the verdict on the measurement is that
            nothing can be made with it.
        """
        content = read_document(path, KIND)
        if content.get("usable", True) is not True:
            raise InputError(path, "verdict", f"is `{content.get('verdict')}`", "measure it again")
        name = str(member(path, content, "image"))
        if Path(name).name != name:
            raise InputError(path, "image", f"is {name!r}", "name a file beside the document")
        image = Path(path).parent / name
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


@dataclass(frozen=True)
class MeasuredFlat:
    """Response of a band's pixels, measured.

    Attributes
    ----------
    response : ndarray, shape (rows, columns), float32
        One on average in the middle of the frame; NaN for hot, dead and stuck pixels.
    relative_error : float
        Relative standard error of a pixel's response, root mean square over the pixels: the scatter
        of the repeats. The response is not smoothed, each pixel's own sensitivity belongs to it.
    """

    response: NDArray[np.float32]
    relative_error: float

    @property
    def missing(self) -> float:
        """Share of the pixels without a response."""
        return float(np.isnan(self.response).mean())


def measure_flat(rates: NDArray[np.float32], band_nm: int, source: str | Path) -> MeasuredFlat:
    """Response of the pixels from repeated photographs of an evenly bright field.

    Parameters
    ----------
    rates : ndarray, shape (repeats, rows, columns), float32
        DN/s; NaN where no exposure can be used. The lamp's power may change between repeats.
    band_nm : int
        For messages.
    source : str or Path
        Where the photographs are from, for messages.

    Raises
    ------
    InputError
        If the middle of the frame has no usable pixel, or shows no light.
    """
    known = np.isfinite(rates).all(axis=0)
    powers = rates[:, known].mean(axis=1, dtype=np.float64) if known.any() else np.zeros(len(rates))
    if not powers.min() > 0:
        raise InputError(
            source, band_name(band_nm), "shows no light in any pixel", "check lamp, filter and shutter"
        )
    relative = rates / powers[:, None, None].astype(np.float32)
    response = np.where(known, relative.mean(axis=0), np.nan).astype(np.float32)
    response[_defective(response)] = np.nan
    rows, columns = rates.shape[1:]
    centre = response[middle(rows, MIDDLE), middle(columns, MIDDLE)]
    if not np.isfinite(centre).any():
        problem = "has no usable pixel in the middle of the frame"
        raise InputError(source, band_name(band_nm), problem, "take the flat field and its dark frames again")
    response /= np.float32(np.nanmean(centre, dtype=np.float64))
    used = np.isfinite(response)
    scatter = relative[:, used].var(axis=0, ddof=1, dtype=np.float64) / relative[:, used].mean(axis=0) ** 2
    return MeasuredFlat(response, float((scatter.mean() / len(rates)) ** 0.5))


def measured_flat(path: str | Path, flats: Mapping[int, MeasuredFlat]) -> dict[str, Any]:
    """Write the image of measured flat fields by band (nm), and return the content of its ``flat.json``."""
    error = max(flat.relative_error for flat in flats.values())
    missing = max(flat.missing for flat in flats.values())
    told = (
        f"a pixel's response is known to {100 * error:.2g} %, {100 * missing:.2g} % of the pixels have none"
    )
    findings = [
        *graded(error, *_ERROR, words="take more repeats, or expose them longer"),
        *graded(missing, *_MISSING, words="look for stray light in the dark frames, and for dust"),
    ]
    content = write_flat(path, {nm: flat.response for nm, flat in flats.items()})
    for nm, flat in flats.items():
        content["bands"][str(nm)] |= {
            "pixel_relative_standard_error": flat.relative_error,
            "missing_share": flat.missing,
        }
    return {"source": "measured", **judged(told, findings), "normalisation": NORMALISATION, **content}


def _defective(response: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Pixels that make much less or much more of light than their neighbours."""
    filled = np.where(np.isfinite(response), response, np.float32(np.nanmedian(response)))
    around = cv2.medianBlur(filled, 5)
    defective: NDArray[np.bool_] = (response < DEAD * around) | (response > STUCK * around)
    return defective


def middle(length: int, share: float) -> slice:
    """Rows or columns in the middle of a frame that make up a share of its length."""
    first = int(length * (1 - share) / 2)
    return slice(first, length - first)


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
