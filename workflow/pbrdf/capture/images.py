"""Folders of images with a CSV of settings, as other rigs write them, become a capture."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from pbrdf.capture.arrays import write_capture
from pbrdf.errors import InputError
from pbrdf.formats.rows import read_rows
from pbrdf.settings.plan import State, light_id

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


@dataclass(frozen=True)
class ImageSetting:
    """A row of the CSV; `band_nm` is None for a dark frame."""

    file: str
    light_deg: float
    band_nm: int | None
    state_deg: State
    exposure_s: float


def read_image_settings(path: str | Path) -> list[ImageSetting]:
    """Read the CSV of settings; its columns are `COLUMNS`, and `band_nm` says ``dark`` for a dark frame.

    Raises
    ------
    InputError
        If the file is missing, or a line of it cannot be read or stands there twice.
    """
    path = Path(path)
    named_in = "`details` in the table of materials"
    settings = [_setting(path, number, row) for number, row in read_rows(path, COLUMNS, ",", named_in)]
    doubled = [file for file, number in Counter(setting.file for setting in settings).items() if number > 1]
    if doubled:
        raise InputError(path, "file", f"`{doubled[0]}` stands there twice", "keep one line an image")
    return settings


def lights_of(settings: Sequence[ImageSetting]) -> list[str]:
    """Ids of the lights that a CSV names, ascending."""
    return sorted({light_id(setting.light_deg) for setting in settings})


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
        If an image is missing or of another size, a state lacks a band or an exposure or has two
        images of it, or an image is not the one brought in before.
    """
    settings = [s for s in read_image_settings(details) if light_id(s.light_deg) == light]
    if not settings:
        raise InputError(details, "light_deg", f"no image belongs to the light {light}", "correct the column")
    lit = [s for s in settings if s.band_nm is not None]
    if not lit:
        raise InputError(details, "band_nm", f"the light {light} has dark frames only", "add its images")
    states = list(dict.fromkeys(s.state_deg for s in lit))
    exposures = sorted({s.exposure_s for s in lit})
    frames = {
        band_nm: _band(folder, details, [s for s in lit if s.band_nm == band_nm], states, exposures)
        for band_nm in sorted({s.band_nm for s in lit if s.band_nm is not None})
    }
    return write_capture(
        capture,
        material=material,
        angle_deg=settings[0].light_deg,
        frames=frames,
        states_deg=states,
        exposures_s=exposures,
        dark=_dark(folder, details, settings, exposures),
        saturation=1.0 if next(iter(frames.values())).dtype.kind == "f" else None,
        source="images",
    )


def _band(
    folder: str | Path,
    details: str | Path,
    settings: Sequence[ImageSetting],
    states: Sequence[State],
    exposures: Sequence[float],
) -> NDArray[Any]:
    """Images of one band, shape (state, exposure, row, column)."""
    by_place: dict[tuple[State, float], str] = {}
    for setting in settings:
        place = (setting.state_deg, setting.exposure_s)
        if place in by_place:
            problem = f"is what `{by_place[place]}` and `{setting.file}` both show"
            raise InputError(details, _place(setting.band_nm, *place), problem, "keep one of them")
        by_place[place] = setting.file
    images = []
    for state in states:
        for exposure_s in exposures:
            if (state, exposure_s) not in by_place:
                field = _place(settings[0].band_nm, state, exposure_s)
                raise InputError(details, field, "has no image", "add it, or drop that state or exposure")
            images.append(_image(Path(folder) / by_place[state, exposure_s]))
    return _stacked(folder, images).reshape(len(states), len(exposures), *images[0].shape)


def _place(band_nm: int | None, state: State, exposure_s: float) -> str:
    return f"{band_nm} nm, state {state}, {exposure_s:g} s"


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
    return ImageSetting(name, light_deg, None if band == DARK else int(band), (gp, gr, ar, ap), exposure_s)


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


def _stacked(folder: str | Path, images: list[NDArray[Any]]) -> NDArray[Any]:
    first = images[0]
    for image in images:
        if image.shape != first.shape or image.dtype != first.dtype:
            raise InputError(
                folder,
                "images",
                f"one is {image.dtype} {image.shape}, another {first.dtype} {first.shape}",
                "export all frames in one size and depth",
            )
    return np.stack(images)


def _dark(
    folder: str | Path, details: str | Path, settings: list[ImageSetting], exposures: list[float]
) -> NDArray[Any] | None:
    dark = [s for s in settings if s.band_nm is None]
    if not dark:
        return None
    files = [[s.file for s in dark if s.exposure_s == exposure_s] for exposure_s in exposures]
    repeats = {len(group) for group in files}
    if len(repeats) != 1 or 0 in repeats:
        raise InputError(
            details, "dark", "exposures have different numbers of frames", "give as many for each"
        )
    images = [_image(Path(folder) / file) for group in files for file in group]
    return _stacked(folder, images).reshape(len(exposures), len(files[0]), *images[0].shape)
