"""Folders of images with a CSV of settings, as other rigs write them, become a capture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from pbrdf.capture.arrays import write_capture
from pbrdf.capture.image_settings import ImageSetting, require_whole_lights
from pbrdf.errors import InputError
from pbrdf.formats.rows import read_rows

COLUMNS = (
    "file",
    "light_deg",
    "band_nm",
    "generator_polariser_deg",
    "generator_retarder_deg",
    "analyser_retarder_deg",
    "analyser_polariser_deg",
    "exposure_s",
)
DARK = "dark"


def read_image_settings(path: str | Path) -> list[ImageSetting]:
    """Read the CSV of settings; its columns are `COLUMNS`, and `band_nm` says ``dark`` for a dark frame.

    Raises
    ------
    InputError
        If the file is missing, a line of it cannot be read, or the lines do not make whole lights
        (`pbrdf.capture.image_settings.require_whole_lights`).
    """
    path = Path(path)
    named_in = "`details` in the table of materials"
    settings = [_setting(path, number, row) for number, row in read_rows(path, COLUMNS, ",", named_in)]
    require_whole_lights(settings, path)
    return settings


def lights_of(settings: Sequence[ImageSetting]) -> list[str]:
    """Ids of the lights that a CSV names, ascending."""
    return sorted({setting.light for setting in settings})


def import_images(
    folder: str | Path, details: str | Path, light: str, material: str, capture: str | Path
) -> Path:
    """Turn the images of one light into a capture.

    Parameters
    ----------
    folder : str or Path
        Where the images lie: PNG or TIFF, one channel, 8 or 16 bit, or float with 1 as saturation.
    details : str or Path
        The CSV of settings.
    light : str
        Id of the light, such as ``041.00``.
    material : str
        Name of the material.
    capture : str or Path
        ``captures/<material>``.

    Returns
    -------
    Path
        The light's manifest.

    Raises
    ------
    InputError
        If the CSV is refused, an image is missing or not of the size of the CSV's first, or it is not
        the one brought in before.
    """
    every = read_image_settings(details)
    settings = [setting for setting in every if setting.light == light]
    if not settings:
        raise InputError(details, "light_deg", f"no image belongs to the light {light}", "correct the column")
    form = _image(Path(folder) / every[0].file)
    lit = {setting.place: setting for setting in settings if setting.band_nm is not None}
    dark = [setting for setting in settings if setting.band_nm is None]
    states = list(dict.fromkeys(state for _, _, state, _ in lit))
    exposures = sorted({exposure_s for *_, exposure_s in lit})
    frames = {}
    for band_nm in sorted({setting.band_nm for setting in lit.values() if setting.band_nm is not None}):
        rows = [lit[light, band_nm, state, exposure_s] for state in states for exposure_s in exposures]
        stack = _stacked(folder, details, rows, form, every[0].file)
        frames[band_nm] = stack.reshape(len(states), len(exposures), *form.shape)
    return write_capture(
        capture,
        material=material,
        angle_deg=settings[0].light_deg,
        frames=frames,
        states_deg=states,
        exposures_s=exposures,
        dark=_dark(folder, details, dark, exposures, form, every[0].file) if dark else None,
        saturation=1.0 if form.dtype.kind == "f" else None,
        source="images",
    )


def _setting(path: Path, number: int, row: dict[str | Any, str | Any]) -> ImageSetting:
    if None in row:
        raise InputError(
            path, f"line {number}", f"has more cells than {len(COLUMNS)}", "put one comma between"
        )

    def value(column: str) -> float:
        try:
            found = float(row[column] or "")
        except ValueError:
            found = np.nan
        if not np.isfinite(found):
            raise InputError(path, f"line {number}, {column}", f"is {row[column]!r}", "write a finite number")
        return found

    light_deg, gp, gr, ar, ap, exposure_s = (value(c) for c in ("light_deg", *COLUMNS[3:]))
    if not 0 <= light_deg <= 360:
        raise InputError(path, f"line {number}, light_deg", f"is {light_deg:g}", "stay within 0…360°")
    if exposure_s <= 0:
        raise InputError(path, f"line {number}, exposure_s", f"is {exposure_s:g}", "write a time above zero")
    band = row["band_nm"] or ""
    if band != DARK and not (band.isascii() and band.isdecimal() and int(band) > 0):
        problem = f"is {row['band_nm']!r}"
        raise InputError(path, f"line {number}, band_nm", problem, f"write whole nm, or `{DARK}`")
    name = row["file"]
    if not name or Path(name).is_absolute() or ".." in Path(name).parts:
        raise InputError(
            path, f"line {number}, file", f"is {name!r}", "name a file within the folder of images"
        )
    band_nm = None if band == DARK else int(band)
    return ImageSetting(number, name, light_deg, band_nm, (gp, gr, ar, ap), exposure_s)


def _image(path: Path) -> NDArray[Any]:
    if not path.is_file():
        raise InputError(path, "image", "does not exist", "correct the CSV or the folder of images")
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise InputError(path, "image", "cannot be decoded", "give a PNG or TIFF image")
    if image.ndim != 2:
        raise InputError(path, "image", f"has {image.shape[2]} channels", "export raw single-channel frames")
    pixels: NDArray[Any] = image
    return pixels


def _stacked(
    folder: str | Path,
    details: str | Path,
    settings: Sequence[ImageSetting],
    form: NDArray[Any],
    form_file: str,
) -> NDArray[Any]:
    """Images of some rows, shape (image, row, column), all of the size and type of `form`."""
    stack = np.empty((len(settings), *form.shape), form.dtype)
    for index, setting in enumerate(settings):
        image = _image(Path(folder) / setting.file)
        if image.shape != form.shape or image.dtype != form.dtype:
            raise InputError(
                details,
                setting.row,
                f"is {image.dtype} {image.shape} where `{form_file}` is {form.dtype} {form.shape}",
                "export all frames in one size and depth",
            )
        stack[index] = image
    return stack


def _dark(
    folder: str | Path,
    details: str | Path,
    dark: Sequence[ImageSetting],
    exposures: Sequence[float],
    form: NDArray[Any],
    form_file: str,
) -> NDArray[Any]:
    """Dark images of a light, shape (exposure, repeat, row, column)."""
    rows = [setting for exposure_s in exposures for setting in dark if setting.exposure_s == exposure_s]
    return _stacked(folder, details, rows, form, form_file).reshape(len(exposures), -1, *form.shape)
