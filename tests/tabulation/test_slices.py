"""Slices on the disk: what is written is read, and what is damaged is refused."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pbrdf.errors import InputError
from pbrdf.tabulation.slices import Slice, SliceFile, read_slice, write_slice


@pytest.fixture
def part() -> Slice:
    random = np.random.default_rng(1)
    grid = (2, 9, 13)
    return Slice(
        60.0,
        (450, 550),
        random.normal(size=(*grid, 4, 4)).astype(np.float32),
        random.uniform(size=(*grid, 4, 4)).astype(np.float32),
        random.integers(0, 900, grid, np.uint16),
        random.uniform(0.5, 0.6, grid[1:]),
    )


@pytest.fixture
def store(tmp_path: Path, part: Slice) -> Path:
    path = tmp_path / "060.00.zarr"
    write_slice(path, part)
    return path


def test_what_is_written_is_read(store: Path, part: Slice) -> None:
    found = read_slice(store)
    assert (found.angle_deg, found.bands_nm) == (60.0, (450, 550))
    assert SliceFile(store).angle_deg == 60.0
    for name in ("mueller", "variance", "count", "theta_d"):
        array = getattr(found, name)
        np.testing.assert_array_equal(array, getattr(part, name))
        assert array.dtype == getattr(part, name).dtype


def test_a_slice_replaces_the_one_before(store: Path, part: Slice) -> None:
    write_slice(store, replace(part, angle_deg=61.0))
    assert SliceFile(store).angle_deg == 61.0
    assert [path.name for path in store.parent.iterdir()] == [store.name]


def edit_attributes(store: Path, **changes: object) -> None:
    document = json.loads((store / "zarr.json").read_text())
    document["attributes"].update(changes)
    (store / "zarr.json").write_text(json.dumps(document))


def cut_a_chunk(store: Path) -> None:
    chunk = next(path for path in (store / "mueller" / "c").rglob("*") if path.is_file())
    chunk.write_bytes(chunk.read_bytes()[:-20])


def flip_a_bit(store: Path) -> None:
    chunk = next(path for path in (store / "theta_d" / "c").rglob("*") if path.is_file())
    content = bytearray(chunk.read_bytes())
    content[len(content) // 2] ^= 1
    chunk.write_bytes(content)


def lose_a_chunk(store: Path) -> None:
    next(path for path in (store / "count" / "c").rglob("*") if path.is_file()).unlink()


def shorten_an_array(store: Path) -> None:
    document = json.loads((store / "variance" / "zarr.json").read_text())
    document["shape"][0] = 1
    (store / "variance" / "zarr.json").write_text(json.dumps(document))


@pytest.mark.parametrize(
    ("damage", "field"),
    [
        (shutil.rmtree, "store"),
        (lambda store: (store / "zarr.json").write_text("{"), "store"),
        (lambda store: edit_attributes(store, schema="pbrdf/slice/0"), "schema"),
        (lambda store: edit_attributes(store, angle_deg="sixty"), "angle_deg"),
        (lambda store: edit_attributes(store, angle_deg=float("nan")), "angle_deg"),
        (lambda store: edit_attributes(store, bands_nm=None), "bands_nm"),
        (lambda store: edit_attributes(store, bands_nm=[450]), "mueller"),
        (lambda store: shutil.rmtree(store / "theta_d"), "theta_d"),
        (lambda store: (store / "count" / "zarr.json").write_text("{"), "count"),
        (cut_a_chunk, "mueller"),
        (flip_a_bit, "theta_d"),
        (lose_a_chunk, "count"),
        (shorten_an_array, "variance"),
    ],
)
def test_a_damaged_slice_is_refused(store: Path, damage: Callable[[Path], object], field: str) -> None:
    damage(store)
    with pytest.raises(InputError) as caught:
        read_slice(store)
    assert caught.value.source == str(store)
    assert caught.value.field == field
