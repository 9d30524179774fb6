"""Names of frames, and the manifest that says that a light is whole."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FramesHeader, FrameStore, band_name, reference_name
from pbrdf.formats.documents import read_document, write_document
from pbrdf.formats.frame_arrays import DARK

MANIFEST = "capture/1"
MANIFEST_FILE = "manifest.json"


class FrameIndex(NamedTuple):
    """Place of a frame in its light.

    A dark frame has no band; its `state` counts repeats, as does that of a `reference`, which shows the
    header's `reference_state` again.
    """

    band_nm: int | None
    state: int
    exposure: int
    reference: bool = False

    @property
    def id(self) -> str:
        """Name within the light: ``450nm/s07/e1``, ``450nm/r02/e1``, ``dark/e1/r2``."""
        if self.band_nm is None:
            return f"dark/e{self.exposure}/r{self.state}"
        letter = "r" if self.reference else "s"
        return f"{band_name(self.band_nm)}/{letter}{self.state:02d}/e{self.exposure}"

    @property
    def place(self) -> tuple[str, tuple[int, int]]:
        """Array of the store that holds it, and its place there."""
        if self.band_nm is None:
            return DARK, (self.exposure, self.state)
        name = reference_name(self.band_nm) if self.reference else band_name(self.band_nm)
        return name, (self.state, self.exposure)


class Parts(NamedTuple):
    """Frames of a light in the order they are taken; between the parts other lights may be taken."""

    dark_before: tuple[FrameIndex, ...]
    lit: tuple[FrameIndex, ...]
    dark_after: tuple[FrameIndex, ...]


def frame_indices(header: FramesHeader) -> Iterator[FrameIndex]:
    """Every frame of a light: exposures innermost, darks last."""
    parts = frame_parts(header)
    yield from parts.lit
    yield from sorted(
        (*parts.dark_before, *parts.dark_after), key=lambda index: (index.exposure, index.state)
    )


def frame_parts(header: FramesHeader) -> Parts:
    """Frames of a light as they are taken: where darks are taken at both ends, half of them at each."""
    exposures = range(len(header.exposures_s))
    lit = tuple(
        FrameIndex(band_nm, state, exposure, reference)
        for band_nm in header.bands_nm
        for state, reference in in_order(header)
        for exposure in exposures
    )
    first = (header.darks + 1) // 2 if header.darks_at_ends else 0
    before, after = (
        tuple(FrameIndex(None, repeat, exposure) for exposure in exposures for repeat in repeats)
        for repeats in (range(first), range(first, header.darks))
    )
    return Parts(before, lit, after)


def position(header: FramesHeader, index: FrameIndex) -> int:
    """How many states, repeats included, are taken in the band of a light before a frame of it."""
    return in_order(header).index((index.state, index.reference))


def in_order(header: FramesHeader) -> list[tuple[int, bool]]:
    """States, and numbers of repeats (marked True), in the order that a band takes them."""
    # a repeat follows the state before it
    states = [(state + 1, 0, state, False) for state in range(len(header.states_deg))]
    repeats = [(before, 1, repeat, True) for repeat, before in enumerate(header.references)]
    return [(number, reference) for _, _, number, reference in sorted(states + repeats)]


def write_manifest(folder: Path, header: FramesHeader, checksums: Mapping[str, str]) -> Path:
    """Write ``manifest.json`` of a light whose every frame is in the journal.

    Parameters
    ----------
    folder : Path
        The light's folder.
    header : FramesHeader
    checksums : mapping
        Checksum by frame id, from the journal.

    Raises
    ------
    InputError
        If a frame has no line in the journal.
    """
    ids = [index.id for index in frame_indices(header)]
    missing = [frame_id for frame_id in ids if frame_id not in checksums]
    if missing:
        raise InputError(
            folder,
            missing[0],
            f"is missing, and {len(missing) - 1} frames more",
            "run the capture again: it resumes",
        )
    whole = hashlib.sha256("".join(f"{i} {checksums[i]}\n" for i in ids).encode()).hexdigest()
    path = folder / MANIFEST_FILE
    attributes = {key: value for key, value in header.attributes().items() if key != "schema"}
    write_document(path, MANIFEST, {**attributes, "frames": len(ids), "digest": whole})
    return path


def read_manifest(path: str | Path) -> dict[str, Any]:
    """Read a light's manifest; raises `InputError` if it is not one."""
    return read_document(path, MANIFEST)


def open_frames(manifest: str | Path) -> FrameStore:
    """Frames that lie beside a light's manifest; raises `InputError` if the two do not say the same."""
    store = FrameStore.open(Path(manifest).parent / "frames.zarr")
    taken = read_manifest(manifest)
    for name, value in store.header.attributes().items():
        # an older manifest may lack what was added since
        if name != "schema" and taken.get(name, value) != value:
            problem = f"is {taken[name]!r} where the frames say {value!r}"
            raise InputError(manifest, name, problem, "restore it, or delete it and capture that light again")
    return store
