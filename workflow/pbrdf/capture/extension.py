"""A light that gets more bands or exposures: its frames stay what they are and make room."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

from pbrdf.capture.frames import FrameIndex, frame_indices
from pbrdf.capture.journal import Journal
from pbrdf.formats.capture_store import FramesHeader, FrameStore
from pbrdf.formats.folders import replace_folder

EXTENSIBLE = ("bands_nm", "exposures_s")


def contradictions(taken: FramesHeader, wanted: FramesHeader) -> list[str]:
    """Fields of a header in which another does more than add bands or exposures."""
    before, now = taken.attributes(), wanted.attributes()
    return [
        name
        for name in now
        if before[name] != now[name] and not (name in EXTENSIBLE and set(before[name]) < set(now[name]))
    ]


def extend(folder: Path, taken: FramesHeader, wanted: FramesHeader) -> None:
    """Give a light's folder the places that a header adds.

    The files of its frames are linked, not copied, into a folder that then takes the place of this one; the
    manifest is left out, since the light is not whole now.

    Parameters
    ----------
    folder : Path
        The light's folder.
    taken, wanted : FramesHeader
        Of its frames, and one that does not contradict it.
    """
    moved = {index: _moved(index, taken, wanted) for index in frame_indices(taken)}
    with replace_folder(folder) as beside:
        old, new = FrameStore.open(folder / "frames.zarr"), FrameStore.create(beside / "frames.zarr", wanted)
        for before, now in moved.items():
            source = old.file_at(*before.place)
            if source.is_file():
                _link(source, new.file_at(*now.place))
        _rename_in_journal(folder, beside, {before.id: now.id for before, now in moved.items()})


def _moved(index: FrameIndex, taken: FramesHeader, wanted: FramesHeader) -> FrameIndex:
    """Place that a frame has among more exposures."""
    return index._replace(exposure=wanted.exposures_s.index(taken.exposures_s[index.exposure]))


def _link(source: Path, target: Path) -> None:
    try:
        os.link(source, target)
    except OSError:
        # some file systems have no links
        shutil.copy2(source, target)


def _rename_in_journal(folder: Path, beside: Path, names: dict[str, str]) -> None:
    journal = Journal(folder / "journal.jsonl")
    lines = []
    for entry in journal.entries():
        lines.append(json.dumps({**entry, "frame": names[entry["frame"]]}, ensure_ascii=False) + "\n")
    (beside / journal.path.name).write_text("".join(lines), encoding="utf-8")
