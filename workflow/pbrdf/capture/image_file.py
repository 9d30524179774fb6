"""One raw frame from a PNG, TIFF or EXR file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from pbrdf.capture.image_size import least_bytes
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import DTYPES
from pbrdf.formats.exr_file import open_exr

FORMATS = "PNG, TIFF or EXR"


def read_image(path: str | Path) -> NDArray[Any]:
    """Read a frame.

    Parameters
    ----------
    path : str or Path
        A file whose name ends in ``.exr`` is read as OpenEXR (half precision becomes single), any other as
        what its first bytes say.

    Returns
    -------
    ndarray, shape (rows, columns), uint8, uint16 or float32

    Raises
    ------
    InputError
        If it is missing, damaged, of another type, or holds more than one channel or image.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(path, "image", "does not exist", "correct the CSV or the folder of images")
    image = _exr(path) if path.suffix.lower() == ".exr" else _png_or_tiff(path)
    if str(image.dtype) not in DTYPES:
        remedy = "export 8 or 16 bits, or floats of 16 (EXR) or 32"
        raise InputError(path, "image", f"is {image.dtype}", remedy)
    return image


def carries_noise(image: NDArray[Any]) -> bool:
    """Whether an image has values between its least and its greatest: others may repeat by chance.

    Frames that are dark or saturated throughout are all alike, and tell nothing of a mistake.
    """
    return bool(np.any((image > image.min()) & (image < image.max())))


def _png_or_tiff(path: Path) -> NDArray[Any]:
    try:
        claimed = least_bytes(path)
    except ValueError:
        raise _undecodable(path) from None
    if claimed > path.stat().st_size:
        raise InputError(path, "image", "claims more pixels than its bytes can hold", "export it again")
    if path.suffix.lower() in (".tif", ".tiff"):
        _require_one(path, cv2.imcount(str(path), cv2.IMREAD_UNCHANGED), "images")
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise _undecodable(path)
    if image.ndim != 2:
        _require_one(path, image.shape[2], "channels")
    pixels: NDArray[Any] = image
    return pixels


def _exr(path: Path) -> NDArray[Any]:
    try:
        with open_exr(path) as file:
            _require_one(path, len(file.parts), "images")
            channels = file.parts[0].channels
            _require_one(path, len(channels), "channels")
            (channel,) = channels.values()
            image: NDArray[Any] = channel.pixels
    except ValueError:
        raise _undecodable(path) from None
    return image.astype(np.float32) if image.dtype == np.float16 else image


def _require_one(path: Path, number: int, what: str) -> None:
    if number > 1:
        raise InputError(
            path, "image", f"has {number} {what}", "export raw single-channel frames, one a file"
        )


def _undecodable(path: Path) -> InputError:
    return InputError(path, "image", "cannot be decoded", f"give a {FORMATS} image")
