"""How far the captures in a folder are."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pbrdf.capture.frames import MANIFEST_FILE, frame_indices
from pbrdf.capture.journal import Journal
from pbrdf.capture.light_folder import whole_frames
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FrameStore


@dataclass(frozen=True)
class LightStatus:
    """How far a light is.

    Attributes
    ----------
    light : str
        Its name; those that were retaken end in ``.r1`` and so on.
    taken, wanted : int
        Frames in its journal, and in its store.
    whole : bool
        Whether its manifest is there.
    ended : str
        When its last frame was taken, UTC; empty where the journal does not say.
    metered_s : tuple of float
        Its exposures where they were metered, s.
    darks_at_ends : bool
        Whether its dark frames belong to start and end of the run.
    """

    light: str
    taken: int
    wanted: int
    whole: bool
    ended: str
    metered_s: tuple[float, ...]
    darks_at_ends: bool


def damaged_frames(folder: str | Path) -> Iterator[tuple[str, list[str]]]:
    """Lights of ``captures/<material>``, each with those of its journal's frames that are gone or changed.

    Every frame is read and held against its checksum in the journal.
    """
    for light in _lights(folder):
        store, journal = FrameStore.open(light / "frames.zarr"), Journal(light / "journal.jsonl")
        yield light.name, sorted(set(journal.checksums()) - whole_frames(store, journal, check=True))


def capture_status(folder: str | Path) -> Iterator[LightStatus]:
    """How far each light of ``captures/<material>`` is, by name.

    Raises
    ------
    InputError
        If nothing was captured there, or a light's files cannot be read.
    """
    for light in _lights(folder):
        header = FrameStore.open(light / "frames.zarr").header
        entries = Journal(light / "journal.jsonl").entries()
        yield LightStatus(
            light.name,
            len({entry["frame"] for entry in entries}),
            sum(1 for _ in frame_indices(header)),
            (light / MANIFEST_FILE).exists(),
            str(entries[-1].get("ended", "")) if entries else "",
            () if header.metered_dn_per_s is None else header.exposures_s,
            header.darks_at_ends,
        )


def _lights(folder: str | Path) -> list[Path]:
    lights = sorted(path.parent for path in Path(folder).glob("lights/*/frames.zarr"))
    if not lights:
        raise InputError(folder, "lights", "there are none", "name a folder of photographs, or take some")
    return lights
