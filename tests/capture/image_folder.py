"""A folder of images and the CSV that tells what they are, for tests to spoil."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import OpenEXR
import pytest
from numpy.typing import NDArray

from pbrdf.capture.images import COLUMNS, import_images
from pbrdf.errors import InputError

STATES = [(0, 25 * n, 5 * n, 90) for n in range(16)]
WHOLE = (slice(0, 6), slice(0, 8))


def pixels(name: str, dtype: str) -> NDArray[Any]:
    rng = np.random.default_rng(list(name.encode()))
    if dtype.startswith("float"):
        return rng.random((6, 8)).astype(dtype)
    return rng.integers(0, np.iinfo(dtype).max, (6, 8), dtype=dtype, endpoint=True)


def write_image(path: Path, image: NDArray[Any]) -> None:
    if path.suffix == ".exr":
        header = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION}
        names = "Y" if image.ndim == 2 else "BGRA"[: image.shape[2]]
        planes = np.atleast_3d(image).transpose(2, 0, 1)
        channels = {name: np.ascontiguousarray(plane) for name, plane in zip(names, planes, strict=True)}
        with OpenEXR.File(header, channels) as file:
            file.write(str(path))
    else:
        assert cv2.imwrite(str(path), image)


class Photographs:
    """A folder of images and the rows of its CSV, for a test to spoil."""

    def __init__(self, folder: Path, dtype: str = "uint16", ending: str = "png") -> None:
        self.folder = folder / "photographs"
        self.details = folder / "settings.csv"
        self.capture = folder / "captures/jade"
        self.rows: list[list[str]] = []
        self.folder.mkdir()
        for band in ("450", "550"):
            for index, state in enumerate(STATES):
                for exposure in ("0.01", "0.08"):
                    self._add(f"{band}_{index}_{exposure}.{ending}", dtype, band, state, exposure)
        for exposure in ("0.01", "0.08"):
            for repeat in range(2):
                self._add(f"dark_{repeat}_{exposure}.{ending}", dtype, "dark", (0, 0, 0, 0), exposure)

    def _add(self, name: str, dtype: str, band: str, state: tuple[int, ...], exposure: str) -> None:
        write_image(self.folder / name, pixels(name, dtype))
        self.rows.append([name, "41", band, *map(str, state), exposure])

    def move(self, band: str, to_light: str) -> None:
        """Make the images of a band those of another light in the band that stays."""
        for row in self.rows:
            if row[2] == band:
                row[1], row[2] = to_light, "450"

    def drop(self, *names: str) -> None:
        """Leave out the rows of some images."""
        self.rows = [row for row in self.rows if row[0] not in names]

    def bring_in(self, light: str = "041.00") -> Path:
        with self.details.open("w", newline="", encoding="utf-8") as stream:
            csv.writer(stream).writerows([COLUMNS, *self.rows])
        return import_images(self.folder, self.details, light, "jade", self.capture)

    def refusal(self, light: str = "041.00") -> InputError:
        with pytest.raises(InputError) as refused:
            self.bring_in(light)
        assert "\n" not in str(refused.value)
        assert not self.capture.exists()
        return refused.value
