"""The folder of a light: its frames, its journal, and whether they agree."""

from __future__ import annotations

from pathlib import Path

from pbrdf.capture.extension import contradictions, extend
from pbrdf.capture.frames import FrameIndex, frame_indices
from pbrdf.capture.journal import Journal, checksum
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FramesHeader, FrameStore
from pbrdf.formats.folders import recover_folder


def light_folder(folder: str | Path, light: str) -> Path:
    """Folder of a light within a material's captures."""
    return Path(folder) / "lights" / light


def begun_light(folder: Path) -> FramesHeader | None:
    """Header of the frames in a light's folder, None if none is begun.

    Raises
    ------
    InputError
        If the journal speaks of frames that are gone.
    """
    recover_folder(folder)
    path, journal = folder / "frames.zarr", Journal(folder / "journal.jsonl")
    if path.exists():
        return FrameStore.open(path).header
    recorded = len(journal.checksums())
    if recorded:
        problem = f"records {recorded} frames, and {path.name} is gone"
        raise InputError(journal.path, "frames", problem, "restore it, or move the light's folder away")
    return None


def open_light(folder: Path, header: FramesHeader) -> tuple[FrameStore, Journal]:
    """Frame store and journal in a light's folder, begun if there are none.

    Where the header only adds bands or exposures to those of the frames there, they make room for them.

    Raises
    ------
    InputError
        If frames of another kind lie there, or the journal speaks of frames that are gone.
    """
    path, journal = folder / "frames.zarr", Journal(folder / "journal.jsonl")
    if begun_light(folder) is None:
        return FrameStore.create(path, header), journal
    store = FrameStore.open(path, writable=True)
    taken, wanted = store.header.attributes(), header.attributes()
    for name in contradictions(store.header, header):
        field, before, now = _difference(name, taken[name], wanted[name])
        raise InputError(
            path,
            field,
            f"the frames there were taken with {before}, now it is {now}",
            "give the material another name, or move the folder away that it lies in",
        )
    if taken != wanted:
        extend(folder, store.header, header)
        store = FrameStore.open(path, writable=True)
    return store, journal


def whole_frames(store: FrameStore, journal: Journal, *, check: bool) -> set[str]:
    """Names of the frames that the journal records and the store holds.

    With `check` each is read and held against its checksum: what an interruption left may be less.
    """
    recorded = journal.checksums()
    held = {
        index
        for index in frame_indices(store.header)
        if index.id in recorded and store.file_at(*index.place).is_file()
    }
    if check:
        held = {index for index in held if _checksum(store, index) == recorded[index.id]}
    return {index.id for index in held}


def _checksum(store: FrameStore, index: FrameIndex) -> str | None:
    """Checksum of a frame; None if it cannot be read."""
    try:
        return checksum(store.read_at(*index.place))
    except InputError:
        return None


def _difference(field: str, taken: object, wanted: object) -> tuple[str, str, str]:
    """Field and both values, of lists of equal length the first entries that differ."""
    if isinstance(taken, list) and isinstance(wanted, list) and len(taken) == len(wanted):
        index = next(i for i, pair in enumerate(zip(taken, wanted, strict=True)) if pair[0] != pair[1])
        return f"{field}[{index}]", str(taken[index]), str(wanted[index])
    return field, _short(taken), _short(wanted)


def _short(value: object) -> str:
    text = str(value)
    if len(text) <= 60:
        return text
    return f"{text[:57]}… ({len(value)} entries)" if isinstance(value, list) else f"{text[:57]}…"
