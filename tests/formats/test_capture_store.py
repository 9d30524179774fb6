from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FramesHeader, FrameStore, reference_name

HEADER = FramesHeader(
    material="gold",
    light="041.00",
    source="fake",
    angle_deg=41.0,
    bands_nm=(450, 650),
    states_deg=((0.0, 0.0, 0.0, 90.0), (0.0, 25.0, 5.0, 90.0), (0.0, 50.0, 10.0, 90.0)),
    exposures_s=(0.005, 0.08),
    darks=2,
    rows=6,
    columns=8,
    dtype="uint16",
    adc_bits=14,
    shift=2,
    saturation=65532.0,
)
OPTIONAL = ("schema", "references", "reference_state", "metered_dn_per_s", "darks_at_ends")
REPEATING = replace(HEADER, references=(1, 3), reference_state=1)
WHOLE = (slice(0, 6), slice(0, 8))


def _band(band_nm: int, dtype: str = "uint16") -> NDArray[Any]:
    rng = np.random.default_rng(band_nm)
    return rng.integers(0, 250, (3, 2, 6, 8)).astype(dtype)


def _dark(dtype: str = "uint16") -> NDArray[Any]:
    return np.random.default_rng(7).integers(0, 250, (2, 2, 6, 8)).astype(dtype)


def _filled(path: Path, dtype: str = "uint16") -> FrameStore:
    store = FrameStore.create(path, replace(HEADER, dtype=dtype))
    for band_nm in HEADER.bands_nm:
        for state, exposure in np.ndindex(3, 2):
            store.write_frame(band_nm, state, exposure, _band(band_nm, dtype)[state, exposure])
    for exposure, repeat in np.ndindex(2, 2):
        store.write_dark(exposure, repeat, _dark(dtype)[exposure, repeat])
    return store


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return _filled(tmp_path / "frames.zarr").path


def _repeats(band_nm: int) -> NDArray[Any]:
    return np.random.default_rng(band_nm + 1).integers(0, 250, (2, 2, 6, 8)).astype(np.uint16)


@pytest.fixture
def repeating(tmp_path: Path) -> Path:
    """A store whose first state was taken again twice."""
    store = FrameStore.create(tmp_path / "repeating.zarr", REPEATING)
    for band_nm in HEADER.bands_nm:
        for outer, exposure in np.ndindex(3, 2):
            store.write_frame(band_nm, outer, exposure, _band(band_nm)[outer, exposure])
        for outer, exposure in np.ndindex(2, 2):
            store.write_at(reference_name(band_nm), (outer, exposure), _repeats(band_nm)[outer, exposure])
    for exposure, repeat in np.ndindex(2, 2):
        store.write_dark(exposure, repeat, _dark()[exposure, repeat])
    return store.path


def _refusal(read: Callable[[], object], path: Path) -> InputError:
    with pytest.raises(InputError) as refused:
        read()
    assert refused.value.source == str(path)
    assert "\n" not in str(refused.value)
    return refused.value


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32"])
def test_frames_return_as_they_were_written(tmp_path: Path, dtype: str) -> None:
    _filled(tmp_path / "frames.zarr", dtype)
    store = FrameStore.open(tmp_path / "frames.zarr")
    assert store.header == replace(HEADER, dtype=dtype)
    for band_nm in HEADER.bands_nm:
        read = store.read_band(band_nm, *WHOLE)
        assert read.dtype == dtype
        assert np.array_equal(read, _band(band_nm, dtype))
    mean = _dark(dtype).mean(axis=1, dtype=np.float64).astype(np.float32)
    assert np.array_equal(store.mean_dark(*WHOLE), mean)


def test_a_window_holds_its_part_of_every_frame(path: Path) -> None:
    store = FrameStore.open(path)
    rows, columns = slice(1, 4), slice(5, 8)
    assert np.array_equal(store.read_band(650, rows, columns), _band(650)[:, :, rows, columns])
    assert np.array_equal(store.mean_dark(rows, columns), store.mean_dark(*WHOLE)[:, rows, columns])


def test_without_dark_frames_the_window_is_dark(tmp_path: Path) -> None:
    store = FrameStore.create(tmp_path / "frames.zarr", replace(HEADER, darks=0))
    dark = store.mean_dark(slice(1, 4), slice(5, 8))
    assert dark.shape == (2, 3, 3)
    assert not dark.any()


def test_one_frame_is_one_chunk_with_named_dimensions(path: Path) -> None:
    band, dark = zarr.open_group(path, mode="r")["450nm"], zarr.open_group(path, mode="r")["dark"]
    assert isinstance(band, zarr.Array)
    assert isinstance(dark, zarr.Array)
    assert (band.chunks, band.shards) == ((1, 1, 6, 8), None)
    assert band.metadata.dimension_names == ("state", "exposure", "row", "column")  # type: ignore[union-attr]
    assert dark.metadata.dimension_names == ("exposure", "repeat", "row", "column")  # type: ignore[union-attr]
    assert len(list((path / "450nm").glob("c.*.0.0"))) >= 6


def test_the_same_frames_give_the_same_bytes_in_any_order(tmp_path: Path, path: Path) -> None:
    other = FrameStore.create(tmp_path / "other.zarr", HEADER)
    for exposure, repeat in np.ndindex(2, 2):
        other.write_dark(exposure, repeat, _dark()[exposure, repeat])
    for band_nm in reversed(HEADER.bands_nm):
        for exposure, state in np.ndindex(2, 3):
            other.write_frame(band_nm, state, exposure, _band(band_nm)[state, exposure])
    for file in path.rglob("*"):
        if file.is_file():
            assert (other.path / file.relative_to(path)).read_bytes() == file.read_bytes()


def test_a_frame_of_nothing_but_zeros_is_a_frame(tmp_path: Path) -> None:
    header = replace(HEADER, bands_nm=(450,), darks=0)
    store = FrameStore.create(tmp_path / "frames.zarr", header)
    again = FrameStore.open(tmp_path / "frames.zarr", writable=True)
    for state, exposure in np.ndindex(3, 2):
        (store if state else again).write_frame(450, state, exposure, np.zeros((6, 8), np.uint16))
    assert not FrameStore.open(tmp_path / "frames.zarr").read_band(450, *WHOLE).any()


def test_a_missing_frame_is_named(path: Path) -> None:
    (path / "650nm/c.2.1.0.0").unlink()
    refused = _refusal(lambda: FrameStore.open(path).read_band(650, *WHOLE), path)
    assert refused.field == "650nm, state 2, exposure 1"
    assert refused.problem == "is missing: the array lacks 1 of 6 frames"
    assert np.array_equal(FrameStore.open(path).read_band(450, *WHOLE), _band(450))


def test_missing_dark_frames_are_counted(path: Path) -> None:
    (path / "dark/c.0.1.0.0").unlink()
    (path / "dark/c.1.0.0.0").unlink()
    refused = _refusal(lambda: FrameStore.open(path).mean_dark(*WHOLE), path)
    assert refused.field == "dark, exposure 0, repeat 1"
    assert refused.problem == "is missing: the array lacks 2 of 4 frames"


def test_a_flipped_bit_anywhere_in_a_frame_is_found(path: Path) -> None:
    chunk = path / "450nm/c.1.0.0.0"
    content = chunk.read_bytes()
    store = FrameStore.open(path)
    for index in range(0, len(content), 7):
        chunk.write_bytes(content[:index] + bytes([content[index] ^ (1 << index % 8)]) + content[index + 1 :])
        refused = _refusal(lambda: store.read_band(450, *WHOLE), path)
        assert refused.field == "450nm, state 1, exposure 0"
        assert "is damaged" in refused.problem


@pytest.mark.parametrize("length", [0, 3, 20])
def test_a_frame_cut_short_is_found(path: Path, length: int) -> None:
    chunk = path / "450nm/c.0.1.0.0"
    chunk.write_bytes(chunk.read_bytes()[:length])
    refused = _refusal(lambda: FrameStore.open(path).read_band(450, *WHOLE), path)
    assert refused.field == "450nm, state 0, exposure 1"


@pytest.mark.parametrize("value", [np.nan, -np.inf])
def test_a_frame_that_is_not_finite_is_named(tmp_path: Path, value: float) -> None:
    store = _filled(tmp_path / "frames.zarr", "float32")
    frame = _band(450, "float32")[2, 0]
    frame[3, 3] = value
    store.write_frame(450, 2, 0, frame)
    refused = _refusal(lambda: store.read_band(450, *WHOLE), store.path)
    assert refused.field == "450nm, state 2, exposure 0"
    store.write_dark(1, 0, frame)
    refused = _refusal(lambda: store.mean_dark(*WHOLE), store.path)
    assert refused.field == "dark, exposure 1, repeat 0"


def test_a_band_that_is_not_there_is_named(path: Path) -> None:
    refused = _refusal(lambda: FrameStore.open(path).read_band(550, *WHOLE), path)
    assert (refused.field, refused.problem) == ("550nm", "is missing")


def test_an_unknown_type_of_frame_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="dtype: is float64"):
        FrameStore.create(tmp_path / "frames.zarr", replace(HEADER, dtype="float64"))
    assert list(tmp_path.iterdir()) == []


def _damaged(path: Path, change: Callable[[dict[str, Any]], object]) -> None:
    metadata = json.loads((path / "zarr.json").read_text())
    change(metadata["attributes"])
    (path / "zarr.json").write_text(json.dumps(metadata))


@pytest.mark.parametrize("name", [name for name in HEADER.attributes() if name not in OPTIONAL])
def test_a_missing_attribute_is_named(path: Path, name: str) -> None:
    _damaged(path, lambda attributes: attributes.pop(name))
    refused = _refusal(lambda: FrameStore.open(path), path)
    assert (refused.field, refused.problem) == (f"attributes.{name}", "is missing")


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("rows", "6"),
        ("rows", 6.5),
        ("rows", None),
        ("bands_nm", "450"),
        ("bands_nm", 450),
        ("bands_nm", ["450", "650"]),
        ("states_deg", [1, 2]),
        ("states_deg", [["a", 0, 0, 90]]),
        ("exposures_s", {"a": 1}),
        ("saturation", "high"),
        ("material", 3),
        ("references", 3),
        ("references", ["1"]),
        ("references", [1.5]),
        ("reference_state", "1"),
        ("reference_state", 99),
        ("reference_state", -1),
    ],
)
def test_an_attribute_of_another_type_is_refused(path: Path, name: str, value: object) -> None:
    _damaged(path, lambda attributes: attributes.update({name: value}))
    assert _refusal(lambda: FrameStore.open(path), path).field.startswith("attributes")


@pytest.mark.parametrize(
    ("name", "value"), [("rows", 7), ("exposures_s", [0.005]), ("dtype", "uint8"), ("darks", 3)]
)
def test_attributes_that_do_not_fit_the_arrays_are_refused(path: Path, name: str, value: object) -> None:
    _damaged(path, lambda attributes: attributes.update({name: value}))

    def read() -> None:
        store = FrameStore.open(path)
        store.mean_dark(*WHOLE)
        store.read_band(450, *WHOLE)

    assert "where the attributes say" in _refusal(read, path).problem


@pytest.mark.parametrize("schema", [None, 1, "pbrdf/frames/2", "pbrdf/table/1"])
def test_another_schema_is_refused(path: Path, schema: str | None) -> None:
    _damaged(path, lambda attributes: attributes.update({"schema": schema}))
    assert _refusal(lambda: FrameStore.open(path), path).field == "schema"


@pytest.mark.parametrize("text", ["", "{", "[]", '{"zarr_format": 3, "node_type": "array"}'])
def test_metadata_that_cannot_be_read_are_refused(path: Path, text: str) -> None:
    (path / "zarr.json").write_text(text)
    assert _refusal(lambda: FrameStore.open(path), path).field == "store"


def test_no_store_is_refused(tmp_path: Path) -> None:
    refused = _refusal(lambda: FrameStore.open(tmp_path / "frames.zarr"), tmp_path / "frames.zarr")
    assert refused.problem == "does not exist"


def test_a_damaged_description_of_a_band_is_refused(path: Path) -> None:
    (path / "450nm/zarr.json").write_text("{")
    refused = _refusal(lambda: FrameStore.open(path).read_band(450, *WHOLE), path)
    assert refused.field == "450nm"


def test_repeats_return_as_they_were_written(repeating: Path) -> None:
    store = FrameStore.open(repeating)
    assert store.header == REPEATING
    rows, columns = slice(1, 4), slice(5, 8)
    for band_nm in HEADER.bands_nm:
        assert np.array_equal(np.stack(list(store.read_references(band_nm, *WHOLE))), _repeats(band_nm))
        window = np.stack(list(store.read_references(band_nm, rows, columns)))
        assert np.array_equal(window, _repeats(band_nm)[:, :, rows, columns])
    assert np.array_equal(store.read_band(450, *WHOLE), _band(450))
    assert np.array_equal(store.read_state(450, 1, rows, columns), _band(450)[1, :, rows, columns])
    array = zarr.open_group(repeating, mode="r")["450nm_reference"]
    assert isinstance(array, zarr.Array)
    assert array.chunks == (1, 1, 6, 8)
    assert array.metadata.dimension_names == ("reference", "exposure", "row", "column")  # type: ignore[union-attr]


def test_a_store_without_repeats_has_no_array_of_them(path: Path) -> None:
    assert list(FrameStore.open(path).read_references(450, *WHOLE)) == []
    assert sorted(zarr.open_group(path, mode="r")) == ["450nm", "650nm", "dark"]


def test_a_store_older_than_repeats_and_metering_has_none(path: Path) -> None:
    for name in OPTIONAL[1:]:
        _damaged(path, lambda attributes, name=name: attributes.pop(name))
    assert FrameStore.open(path).header == HEADER


def test_one_frame_is_read_or_refused_by_name(repeating: Path) -> None:
    store = FrameStore.open(repeating)
    assert np.array_equal(store.read_at("450nm_reference", (1, 0)), _repeats(450)[1, 0])
    store.file_at("450nm_reference", (1, 0)).unlink()
    refused = _refusal(lambda: store.read_at("450nm_reference", (1, 0)), repeating)
    assert refused.field == "450nm_reference, reference 1, exposure 0"
    chunk = store.file_at("450nm", (1, 0))
    chunk.write_bytes(chunk.read_bytes()[:-5])
    refused = _refusal(lambda: store.read_at("450nm", (1, 0)), repeating)
    assert refused.problem.startswith("is damaged")


def test_a_missing_or_damaged_repeat_is_named(repeating: Path) -> None:
    chunk = repeating / "650nm_reference/c.1.1.0.0"
    chunk.write_bytes(chunk.read_bytes()[:9])
    refused = _refusal(lambda: list(FrameStore.open(repeating).read_references(650, *WHOLE)), repeating)
    assert refused.field == "650nm_reference, reference 1, exposure 1"
    assert "is damaged" in refused.problem
    chunk.unlink()
    refused = _refusal(lambda: list(FrameStore.open(repeating).read_references(650, *WHOLE)), repeating)
    assert refused.problem == "is missing: the array lacks 1 of 4 frames"


@pytest.mark.parametrize(
    ("chunk", "field"),
    [
        ("450nm/c.2.1.0.0", "450nm, state 2, exposure 1"),
        ("650nm/c.0.0.0.0", "650nm, state 0, exposure 0"),
        ("650nm_reference/c.0.1.0.0", "650nm_reference, reference 0, exposure 1"),
        ("dark/c.1.0.0.0", "dark, exposure 1, repeat 0"),
    ],
)
def test_a_store_that_lacks_a_frame_anywhere_is_not_complete(repeating: Path, chunk: str, field: str) -> None:
    FrameStore.open(repeating).require_complete()
    (repeating / chunk).unlink()
    refused = _refusal(FrameStore.open(repeating).require_complete, repeating)
    assert refused.field == field
    assert "is missing" in refused.problem


def test_the_first_missing_frame_is_the_one_named(repeating: Path) -> None:
    for chunk in ("dark/c.0.0.0.0", "450nm_reference/c.0.1.0.0", "650nm/c.2.0.0.0", "650nm/c.1.1.0.0"):
        (repeating / chunk).unlink()
    refused = _refusal(FrameStore.open(repeating).require_complete, repeating)
    assert refused.field == "650nm, state 1, exposure 1"


def test_a_store_without_darks_or_repeats_may_be_complete(tmp_path: Path) -> None:
    store = FrameStore.create(tmp_path / "frames.zarr", replace(HEADER, bands_nm=(450,), darks=0))
    assert _refusal(store.require_complete, store.path).field == "450nm, state 0, exposure 0"
    for state, exposure in np.ndindex(3, 2):
        store.write_frame(450, state, exposure, _band(450)[state, exposure])
    FrameStore.open(store.path).require_complete()


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32"])
def test_a_frame_is_written_as_zarr_would(tmp_path: Path, dtype: str) -> None:
    header = replace(HEADER, dtype=dtype)
    frame = _band(450)[0, 0].astype(dtype)
    ours = FrameStore.create(tmp_path / "ours.zarr", header)
    ours.write_frame(450, 1, 0, frame)
    FrameStore.create(tmp_path / "zarrs.zarr", header)
    array = zarr.open_group(tmp_path / "zarrs.zarr")["450nm"]
    assert isinstance(array, zarr.Array)
    array[1, 0] = frame
    place = "450nm/c.1.0.0.0"
    assert (tmp_path / "ours.zarr" / place).read_bytes() == (tmp_path / "zarrs.zarr" / place).read_bytes()
    files = {path.name for path in (tmp_path / "ours.zarr/450nm").iterdir()}
    assert files == {"zarr.json", "c.1.0.0.0"}


def test_a_frame_of_another_size_is_not_written(path: Path) -> None:
    store = FrameStore.open(path)
    with pytest.raises(ValueError, match="does not fit"):
        store.write_frame(450, 0, 0, np.zeros((2, 2), np.uint16))


def test_a_store_whose_chunks_are_named_otherwise_is_read(tmp_path: Path) -> None:
    store = FrameStore.create(tmp_path / "frames.zarr", HEADER)
    older = zarr.open_group(store.path).create_array(
        "450nm", shape=HEADER.shape("450nm"), chunks=(1, 1, 6, 8), dtype=HEADER.dtype, overwrite=True
    )
    older[...] = _band(450)
    assert (store.path / "450nm/c/2/1/0/0").is_file()
    assert np.array_equal(FrameStore.open(store.path).read_at("450nm", (2, 1)), _band(450)[2, 1])
