"""Folders of images with a CSV of settings, as other rigs write them, become a capture."""

from __future__ import annotations

import fcntl
import os
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf.capture.arrays import write_capture
from pbrdf.capture.image_file import carries_noise, read_image
from pbrdf.capture.image_settings import ImageSetting, require_whole_lights
from pbrdf.capture.journal import Journal, checksum
from pbrdf.capture.light_folder import light_folder
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
WHOLE_NM = re.compile("0*[1-9][0-9]{0,5}")


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
        Where the images lie: PNG, TIFF or EXR, one channel, 8 or 16 bit, or float with 1 as saturation.
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
        If the CSV is refused, an image is missing or not of the size of the CSV's first, shows the very
        pixels of another, also of a light brought in before, or is not the one brought in before.
    """
    every = read_image_settings(details)
    settings = [setting for setting in every if setting.light == light]
    if not settings:
        raise InputError(details, "light_deg", f"no image belongs to the light {light}", "correct the column")
    images = _Images(folder, details, every[0].file)
    lit = {setting.place: setting for setting in settings if setting.band_nm is not None}
    dark = [setting for setting in settings if setting.band_nm is None]
    states = list(dict.fromkeys(state for _, _, state, _ in lit))
    exposures = sorted({exposure_s for *_, exposure_s in lit})
    frames = {}
    for band_nm in sorted({setting.band_nm for setting in lit.values() if setting.band_nm is not None}):
        rows = [lit[light, band_nm, state, exposure_s] for state in states for exposure_s in exposures]
        frames[band_nm] = images.stacked(rows).reshape(len(states), len(exposures), *images.form.shape)
    covered = _dark(images, dark, exposures) if dark else None
    with _in_turn(Path(capture)):
        for other in lights_of(every):
            if other != light:
                images.refuse_pixels_of(other, Journal(light_folder(capture, other) / "journal.jsonl"))
        return write_capture(
            capture,
            material=material,
            angle_deg=settings[0].light_deg,
            frames=frames,
            states_deg=states,
            exposures_s=exposures,
            dark=covered,
            saturation=1.0 if images.form.dtype.kind == "f" else None,
            source="images",
        )


@contextmanager
def _in_turn(folder: Path) -> Iterator[None]:
    """Wait until no other light of a material is written: each is held against those there."""
    folder.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


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
    if band != DARK and not WHOLE_NM.fullmatch(band):
        problem = f"is {row['band_nm']!r}"
        raise InputError(path, f"line {number}, band_nm", problem, f"write whole nm, or `{DARK}`")
    name = row["file"]
    if not name or Path(name).is_absolute() or ".." in Path(name).parts:
        raise InputError(
            path, f"line {number}, file", f"is {name!r}", "name a file within the folder of images"
        )
    band_nm = None if band == DARK else int(band)
    return ImageSetting(number, name, light_deg, band_nm, (gp, gr, ar, ap), exposure_s)


class _Images:
    """Images of a light, all of the size and type of the CSV's first, none twice."""

    def __init__(self, folder: str | Path, details: str | Path, first_file: str) -> None:
        self._folder, self._details, self._first_file = Path(folder), details, first_file
        self.form = read_image(self._folder / first_file)
        self._shown: dict[str, ImageSetting] = {}

    def stacked(self, settings: Sequence[ImageSetting]) -> NDArray[Any]:
        """Images of some rows, shape (image, row, column)."""
        stack = np.empty((len(settings), *self.form.shape), self.form.dtype)
        for index, setting in enumerate(settings):
            stack[index] = self._image(setting)
        return stack

    def _image(self, setting: ImageSetting) -> NDArray[Any]:
        image, form = read_image(self._folder / setting.file), self.form
        if image.shape != form.shape or image.dtype != form.dtype:
            raise InputError(
                self._details,
                setting.row,
                f"is {image.dtype} {image.shape} where `{self._first_file}` is {form.dtype} {form.shape}",
                "export all frames in one size and depth",
            )
        first = self._shown.setdefault(checksum(image), setting)
        if first is not setting and carries_noise(image):
            raise self._copied(setting, first.row)
        return image

    def refuse_pixels_of(self, light: str, journal: Journal) -> None:
        """Refuse images whose pixels another light has; raises `InputError`."""
        for entry in journal.entries():
            setting = self._shown.get(entry["checksum"])
            if setting is not None and carries_noise(read_image(self._folder / setting.file)):
                raise self._copied(setting, f"{entry['frame']} of the light {light}")

    def _copied(self, setting: ImageSetting, original: str) -> InputError:
        problem = f"has the very pixels of {original}"
        return InputError(self._details, setting.row, problem, "export the frame that belongs there")


def _dark(images: _Images, dark: Sequence[ImageSetting], exposures: Sequence[float]) -> NDArray[Any]:
    """Dark images of a light, shape (exposure, repeat, row, column)."""
    rows = [setting for exposure_s in exposures for setting in dark if setting.exposure_s == exposure_s]
    return images.stacked(rows).reshape(len(exposures), -1, *images.form.shape)
