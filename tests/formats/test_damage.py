"""Whatever bit flips and whatever file is lost in a store: it is refused by name, or makes no difference."""

from __future__ import annotations

import random
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from readers import READERS

import pbrdf
from pbrdf.calibration.flat_field import FlatField
from pbrdf.capture.frames import open_frames
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FrameStore
from pbrdf.formats.mueller_exr import read_mueller_exr
from pbrdf.formats.table_zarr import read_table
from pbrdf.tabulation.shares import Share, ShareFile, write_share
from pbrdf.tabulation.slices import read_slice

FLIPS = 150
WHOLE = (slice(None), slice(None))


def _frames(path: Path) -> object:
    store = FrameStore.open(path)
    bands = [store.read_band(band_nm, *WHOLE) for band_nm in store.header.bands_nm]
    return store.header, bands, store.mean_dark(*WHOLE)


def _share(path: Path) -> object:
    share = ShareFile(path)
    return share.angle_deg, share.shape, share.nodes, [share.band(k) for k in range(len(share.bands_nm))]


def _write_share(path: Path) -> None:
    matrices = np.random.default_rng(1).normal(size=(1, 3, 4, 4)).astype(np.float32)
    share = Share(41.0, (550,), (3, 1, 1), np.arange(3), matrices, matrices, np.ones((1, 3), np.uint16))
    write_share(path, share)


def _image(path: Path) -> object:
    image = read_mueller_exr(path)
    return image.mueller, image.variance, image.missing, image.first


def _flat(path: Path) -> object:
    window = (slice(0, 4), slice(0, 5))
    return FlatField.read(path / "flat.json").at(450, window, (4, 5))


def _write_flat(path: Path) -> None:
    path.mkdir()
    READERS["json-flat"].write(path / "flat.json")


STORES: dict[str, tuple[Callable[[Path], object], Callable[[Path], object]]] = {
    "frames.zarr": (READERS["zarr-frames"].write, _frames),
    "slice.zarr": (READERS["zarr-slice"].write, lambda path: vars(read_slice(path))),
    "share.zarr": (_write_share, _share),
    "table.zarr": (READERS["zarr-table"].write, lambda path: vars(read_table(path))),
    "550nm.exr": (READERS["exr-mueller"].write, _image),
    "flat": (_write_flat, _flat),
}


@pytest.mark.parametrize("name", STORES)
def test_a_flipped_bit_is_refused_by_name_or_makes_no_difference(tmp_path: Path, name: str) -> None:
    write, read = STORES[name]
    path = tmp_path / name
    write(path)
    sound = read(path)
    # a calibration's document may be edited by hand; its image may not
    files = [file for file in [path, *path.rglob("*")] if file.is_file() and file.name != "flat.json"]
    chance, refused = random.Random(name), 0
    for _ in range(FLIPS):
        # small files, which say what the large ones are, as often as these
        file = chance.choice(files)
        content = bytearray(file.read_bytes())
        content[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
        whole = file.read_bytes()
        file.write_bytes(content)
        try:
            np.testing.assert_equal(read(path), sound)
        except InputError as error:
            assert error.source.startswith(str(path))
            refused += 1
        finally:
            file.write_bytes(whole)
    assert refused > FLIPS / 2


@pytest.mark.parametrize("name", [name for name in STORES if name.endswith(".zarr")])
def test_every_lost_file_is_missed(tmp_path: Path, name: str) -> None:
    write, read = STORES[name]
    path = tmp_path / name
    write(path)
    for file in [file for file in path.rglob("*") if file.is_file()]:
        aside = tmp_path / "aside"
        shutil.move(file, aside)
        with pytest.raises(InputError) as lost:
            read(path)
        assert lost.value.source.startswith(str(path))
        shutil.move(aside, file)


def test_a_manifest_that_says_something_else_than_its_frames_is_refused(tmp_path: Path) -> None:
    frames = np.ones((3, 1, 4, 5), np.uint16)
    states = [(0.0, 25.0 * n, 5.0 * n, 90.0) for n in range(3)]
    manifest = pbrdf.write_capture(
        tmp_path,
        material="gold",
        angle_deg=41.0,
        frames={550: frames},
        states_deg=states,
        exposures_s=[0.01],
        saturation=65532.0,
    )
    sound = manifest.read_text(encoding="utf-8")
    open_frames(manifest)
    for before, after in (('"angle_deg": 41.0', '"angle_deg": 40.0'), ("0.01", "0.03"), ("25.0", "24.0")):
        assert before in sound
        manifest.write_text(sound.replace(before, after, 1), encoding="utf-8")
        with pytest.raises(InputError, match=r"manifest\.json: \w+: is .* where the frames say"):
            open_frames(manifest)
