"""Every writer on a disk without room: one line, and what was there is there still."""

from __future__ import annotations

import resource
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from pbrdf.errors import InputError
from pbrdf.formats.band_exr import write_bands
from pbrdf.formats.documents import write_document
from pbrdf.formats.folders import replace_folder
from pbrdf.formats.mueller_exr import write_mueller_exr
from pbrdf.formats.pbsdf import write_pbsdf
from pbrdf.formats.table_data import TableData
from pbrdf.formats.table_zarr import write_table
from pbrdf.report.figures import Picture
from pbrdf.report.paper_figures import write_figure
from pbrdf.tabulation.shares import Share, write_share
from pbrdf.tabulation.slices import Slice, write_slice

PIXELS = np.random.default_rng(3).normal(size=(16, 40, 40)).astype(np.float32)
TABLE = TableData(
    source="made here",
    wavelengths_nm=450.0 + 50.0 * np.arange(5),
    theta_h=np.linspace(0, np.pi / 2, 3),
    theta_d=np.linspace(0, np.pi / 2, 2),
    phi_d=np.linspace(-np.pi, np.pi, 3),
    mueller=np.random.default_rng(5).normal(size=(5, 3, 2, 3, 4, 4)).astype(np.float32),
)
MATRICES = PIXELS[None, :3, :4, :16].reshape(1, 3, 4, 4, 4)


def _image(path: Path) -> None:
    write_mueller_exr(path, PIXELS, PIXELS**2, np.zeros((40, 40), np.uint8), (5, 6), {})


def _images(path: Path) -> None:
    with replace_folder(path) as part:
        _image(part / "550nm.exr")


def _slice(path: Path) -> None:
    write_slice(path, Slice(41.0, (550,), MATRICES, MATRICES**2, np.ones((1, 3, 4), "u2"), np.ones((3, 4))))


def _share(path: Path) -> None:
    nodes = np.arange(3, dtype=np.int64)
    matrices = MATRICES[:, 0, :3]
    write_share(path, Share(41.0, (550,), (3, 1, 1), nodes, matrices, matrices, np.ones((1, 3), "u2")))


WRITERS: dict[str, Callable[[Path], object]] = {
    "document.json": lambda path: write_document(path, "x/1", {"text": "long " * 500}),
    "550nm.exr": _image,
    "flat.exr": lambda path: write_bands(path, {450: PIXELS[0], 550: PIXELS[1]}, {}),
    "images": _images,
    "slice.zarr": _slice,
    "share.zarr": _share,
    "table.zarr": lambda path: write_table(path, TABLE, {}),
    "table.pbsdf": lambda path: write_pbsdf(path, TABLE),
    "figure.svg": lambda path: write_figure(Picture(b"<svg/>" * 500, "", 1, 1, lambda figure: None), [path]),
}


@contextmanager
def room_for(size: int) -> Iterator[None]:
    """Let the system refuse what goes beyond `size` bytes of a file."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def contents(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("name", WRITERS)
def test_a_writer_without_room_says_so_and_leaves_what_was_there(tmp_path: Path, name: str) -> None:
    target = tmp_path / name
    WRITERS[name](target)
    before = contents(tmp_path)
    largest = max(map(len, before.values()))
    for size in (0, largest // 2, largest - 1):
        with pytest.raises(InputError, match="cannot be written: File too large") as refused, room_for(size):
            WRITERS[name](target)
        assert refused.value.source.startswith(str(target))
        assert contents(tmp_path) == before
