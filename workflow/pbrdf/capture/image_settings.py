"""What a row of a CSV of images says, and whether the rows of all lights are what a capture needs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path, PurePath

from pbrdf.errors import InputError
from pbrdf.settings.plan import State, light_id

Place = tuple[str, int | None, State, float]
"""Light, band in nm (None in the dark), state in degrees, exposure in seconds."""


@dataclass(frozen=True)
class ImageSetting:
    """A row of the CSV; `band_nm` is None for a dark frame."""

    line: int
    file: str
    light_deg: float
    band_nm: int | None
    state_deg: State
    exposure_s: float

    @property
    def light(self) -> str:
        """Id of the light."""
        return light_id(self.light_deg)

    @property
    def place(self) -> Place:
        """What the image shows."""
        return self.light, self.band_nm, self.state_deg, self.exposure_s

    @property
    def row(self) -> str:
        """The row in words, for messages."""
        return f"line {self.line} (`{self.file}`)"


def require_whole_lights(settings: Sequence[ImageSetting], source: str | Path) -> None:
    """Refuse rows that do not make a capture, before an image is read.

    Parameters
    ----------
    settings : sequence of ImageSetting
        All rows of the CSV.
    source : str or Path
        The CSV, for messages.

    Raises
    ------
    InputError
        If a file stands there twice or two show the same; if a light lacks a band, a state or an
        exposure that another has, or has dark frames alone; or if dark frames are not as many for
        each exposure.
    """
    doubled = [
        file for file, number in Counter(str(PurePath(s.file)) for s in settings).items() if number > 1
    ]
    if doubled:
        raise InputError(source, "file", f"`{doubled[0]}` stands there twice", "keep one line an image")
    lit = [setting for setting in settings if setting.band_nm is not None]
    dark = [setting for setting in settings if setting.band_nm is None]
    lights = {setting.light for setting in lit}
    for setting in dark:
        if setting.light not in lights:
            problem = f"{setting.row} is a dark frame, and the light {setting.light} has no other images"
            raise InputError(source, "band_nm", problem, "add its images")
    _refuse_same_place(lit, source)
    _refuse_gaps(lit, source)
    for light in sorted(lights):
        _refuse_uneven_dark(light, lit, [setting for setting in dark if setting.light == light], source)


def _refuse_same_place(lit: Sequence[ImageSetting], source: str | Path) -> None:
    seen: dict[Place, ImageSetting] = {}
    for setting in lit:
        first = seen.setdefault(setting.place, setting)
        if first is not setting:
            problem = f"is what {first.row} and {setting.row} both show"
            raise InputError(source, _words(setting.place), problem, "keep one of them")


def _refuse_gaps(lit: Sequence[ImageSetting], source: str | Path) -> None:
    """Refuse rows that are not every combination of their lights, bands, states and exposures."""
    places = dict.fromkeys(setting.place for setting in lit)
    axes = [dict.fromkeys(values) for values in zip(*places, strict=True)]
    for place in product(*axes):
        if place not in places:
            light, band_nm, state_deg, exposure_s = place
            here = [setting for setting in lit if setting.light == light]
            if all(setting.band_nm != band_nm for setting in here):
                what, alike = "band", [s for s in lit if s.band_nm == band_nm]
            elif all(setting.state_deg != state_deg for setting in here):
                what, alike = "state", [s for s in lit if s.state_deg == state_deg]
            else:
                what, alike = "exposure", [s for s in lit if s.exposure_s == exposure_s]
            other = min(alike, key=lambda setting: _differences(setting.place, place))
            problem = f"has no image, and {other.row} shows that {what} in {_words(other.place)}"
            raise InputError(source, _words(place), problem, f"add it, or drop that {what} everywhere")


def _refuse_uneven_dark(
    light: str, lit: Sequence[ImageSetting], dark: Sequence[ImageSetting], source: str | Path
) -> None:
    if not dark:
        return
    exposures = sorted({setting.exposure_s for setting in lit})
    for setting in dark:
        if setting.exposure_s not in exposures:
            problem = f"is {setting.exposure_s:g}, and no image was exposed so long"
            raise InputError(
                source, f"{setting.row}, exposure_s", problem, "correct it, or drop that dark frame"
            )
    counts = Counter(setting.exposure_s for setting in dark)
    fewest, most = min(exposures, key=lambda s: counts[s]), max(exposures, key=lambda s: counts[s])
    if counts[fewest] != counts[most]:
        last = [setting for setting in dark if setting.exposure_s == most][-1]
        problem = f"has {counts[fewest]} frames, and {last.row} is one of {counts[most]} of {most:g} s"
        raise InputError(source, f"light {light}, dark, {fewest:g} s", problem, "give as many for each")


def _differences(one: Place, other: tuple[object, ...]) -> int:
    return sum(a != b for a, b in zip(one, other, strict=True))


def _words(place: Sequence[object]) -> str:
    light, band_nm, state_deg, exposure_s = place
    return f"light {light}, {band_nm} nm, state {state_deg}, {exposure_s:g} s"
