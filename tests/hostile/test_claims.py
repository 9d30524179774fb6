"""Files made by hand to claim, to run or to reach what they must not."""

from __future__ import annotations

import json
import pickle
import re
import shutil
import struct
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import zarr
from attacked import Attacked
from hypothesis import given
from hypothesis import strategies as st
from markupsafe import escape
from numcodecs import Pickle
from readers import READERS

from pbrdf.errors import InputError
from pbrdf.report.entries import CalibrationEntry
from pbrdf.report.pages import index_page
from pbrdf.settings.materials import COLUMNS, read_materials

HUGE = (20_000, 20_000)


@pytest.fixture(scope="module")
def attacked() -> Iterator[Attacked]:
    with Attacked() as server:
        yield server


def refused(attacked: Attacked, name: str, path: Path, words: str) -> None:
    outcome = attacked.outcome(name, path)
    assert outcome.startswith("refused: "), outcome
    assert re.search(words, outcome), outcome


def example(name: str, folder: Path) -> Path:
    READERS[name].write(folder / READERS[name].name)
    return folder / READERS[name].name


def overwrite(path: Path, after: bytes, content: bytes) -> None:
    """Put `content` right after the first occurrence of `after`."""
    whole = bytearray(path.read_bytes())
    at = whole.index(after) + len(after)
    whole[at : at + len(content)] = content
    path.write_bytes(whole)


@pytest.mark.parametrize("name", ["exr-mueller", "exr-bands", "exr-frame"])
def test_exr_is_refused_by_its_window_before_its_pixels_have_room(
    attacked: Attacked, name: str, tmp_path: Path
) -> None:
    path = example(name, tmp_path)
    overwrite(path, b"dataWindow\0box2i\0\x10\0\0\0", struct.pack("<4i", 0, 0, *HUGE))
    refused(attacked, name, path, "more pixels than|cannot be decoded")


def test_png_and_tiff_are_refused_by_their_headers(attacked: Attacked, tmp_path: Path) -> None:
    path = example("png", tmp_path)
    overwrite(path, b"IHDR", struct.pack(">2I", *HUGE))
    refused(attacked, "png", path, "more pixels than")
    path = example("tiff", tmp_path)
    overwrite(path, struct.pack("<2H", 257, 3) + struct.pack("<I", 1), struct.pack("<H", 60_000))
    overwrite(path, struct.pack("<2H", 256, 3) + struct.pack("<I", 1), struct.pack("<H", 60_000))
    refused(attacked, "tiff", path, "more pixels than")


def test_mat_is_refused_by_the_sizes_of_its_elements(attacked: Attacked, tmp_path: Path) -> None:
    path = example("mat", tmp_path)
    overwrite(path, b"IM", struct.pack("<2I", 14, 2**32 - 8))
    refused(attacked, "mat", path, "claims 4294967288 bytes")
    path = example("mat", tmp_path)
    overwrite(path, struct.pack("<2I", 5, 24), struct.pack("<6i", *[2**31 - 1] * 6))
    refused(attacked, "mat", path, "claims the shape")


@pytest.mark.parametrize("field", ["shape", "chunk_shape"])
@pytest.mark.parametrize(
    ("name", "array"), [("zarr-table", "count"), ("zarr-frames", "450nm"), ("zarr-slice", "theta_d")]
)
def test_zarr_array_is_refused_by_its_shape_and_chunks(
    attacked: Attacked, name: str, array: str, field: str, tmp_path: Path
) -> None:
    file = example(name, tmp_path) / array / "zarr.json"
    content = json.loads(file.read_text(encoding="utf-8"))
    huge = [10**5] * len(content["shape"])
    if field == "shape":
        content["shape"] = huge
    else:
        content["chunk_grid"]["configuration"]["chunk_shape"] = huge
    file.write_text(json.dumps(content), encoding="utf-8")
    refused(attacked, name, file.parents[1], "claims|shape|chunks")


class Exploit:
    """Writes a file as soon as it is unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[Callable[..., object], tuple[object, ...]]:
        return Path.touch, (self.path,)


@pytest.mark.parametrize("name", ["zarr-table", "zarr-frames", "zarr-slice"])
def test_pickles_in_a_zarr_store_stay_closed(attacked: Attacked, name: str, tmp_path: Path) -> None:
    folder = example(name, tmp_path)
    attributes = zarr.open_group(folder, mode="r").attrs.asdict()
    arrays = sorted(path.name for path in folder.iterdir() if path.is_dir())
    shutil.rmtree(folder)
    group = zarr.open_group(folder, mode="w", zarr_format=2, attributes=attributes)
    harm = tmp_path / "harm"
    for array in arrays:
        group.create_array(array, shape=(1,), chunks=(1,), dtype="u1")
        metadata = json.loads((folder / array / ".zarray").read_text(encoding="utf-8"))
        metadata |= {
            "dtype": "|O",
            "fill_value": None,
            "compressor": None,
            "filters": [{"id": Pickle.codec_id}],
        }
        (folder / array / ".zarray").write_text(json.dumps(metadata), encoding="utf-8")
        (folder / array / "0").write_bytes(pickle.dumps([Exploit(harm), [1], "|O"]))
    refused(attacked, name, folder, "zarr.json|cannot be opened")
    assert not harm.exists()


def test_pickled_arrays_in_a_numpy_file_are_no_image(attacked: Attacked, tmp_path: Path) -> None:
    np.save(tmp_path / "f.npy", np.array([Exploit(tmp_path / "harm")], dtype=object), allow_pickle=True)
    (tmp_path / "f.npy").rename(tmp_path / "f.png")
    refused(attacked, "png", tmp_path / "f.png", "cannot be decoded")
    assert not (tmp_path / "harm").exists()


BOMB = "\n".join(
    [f"k0: &a0 [{'1, ' * 9}1]", *(f"k{n}: &a{n} [{f'*a{n - 1}, ' * 9}*a{n - 1}]" for n in range(1, 12))]
)


@pytest.mark.parametrize("name", ["yaml-axes", "yaml-rig", "yaml-config"])
@pytest.mark.parametrize(
    ("content", "words"),
    [
        (BOMB, "stands for more than"),
        ("a: &a [*a]", "leads back to itself"),
        ("[" * 20_000, "is not YAML"),
        ("a: 2001-99-99", "is not YAML"),
        ("a: !!python/object/apply:os.system ['true']", "is not YAML"),
        (f"a: {'9' * 5000}", "is not YAML"),
        ("#" * 2_000_000, "is larger than"),
    ],
    ids=["bomb", "circle", "depth", "date", "python", "digits", "size"],
)
def test_yaml_that_is_more_than_settings_is_refused(
    attacked: Attacked, name: str, content: str, words: str, tmp_path: Path
) -> None:
    path = tmp_path / READERS[name].name
    path.write_text(content, encoding="utf-8")
    refused(attacked, name, path, words)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("json-any", "[" * 200_000, "is not JSON"),
        ("json-any", "9" * 5000, "is not JSON"),
        ("jsonl-journal", "[" * 200_000 + "\n", "line 1: cannot be read"),
        ("tsv-materials", "\t".join(COLUMNS) + "\n" + "x" * 200_000 + "\n", "line .*is no row"),
    ],
)
def test_deep_and_endless_texts_are_refused(
    attacked: Attacked, name: str, content: str, words: str, tmp_path: Path
) -> None:
    (tmp_path / READERS[name].name).write_text(content, encoding="utf-8")
    refused(attacked, name, tmp_path / READERS[name].name, words)


def test_a_flat_field_takes_no_image_from_elsewhere(attacked: Attacked, tmp_path: Path) -> None:
    content = {"schema": "pbrdf/flat/1", "image": "../../secret.exr", "content": "", "bands": {"450": {}}}
    (tmp_path / "flat.json").write_text(json.dumps(content), encoding="utf-8")
    refused(attacked, "json-flat", tmp_path / "flat.json", "name a file beside the document")


@given(name=st.text(max_size=12) | st.sampled_from(["../gold", "/etc", "a/b", "..", "~root", "a\n"]))
def test_a_name_in_the_table_of_materials_is_one_folder_or_refused(
    tmp_path_factory: pytest.TempPathFactory, name: str
) -> None:
    folder = tmp_path_factory.getbasetemp() / "names"
    folder.mkdir(exist_ok=True)
    table = folder / "materials.tsv"
    cells = (name, "rig", name, "25", "-", "-")
    table.write_bytes("\n".join(["\t".join(COLUMNS), "\t".join(cells), ""]).encode("utf-8", "surrogatepass"))
    try:
        (material,) = read_materials(table).values()
    except InputError:
        return
    for part in (material.name, material.session):
        assert part is not None
        assert (folder / part).resolve().parent == folder.resolve()


def test_pages_show_what_looks_like_a_template_as_it_is() -> None:
    nasty = "{{ 7 * 7 }}{% include 'style.css' %}<script>"
    entries = [CalibrationEntry(nasty, nasty, "a.html", nasty, nasty)]
    page = index_page([], entries, provenance={nasty: nasty}, title=nasty)
    assert escape(nasty) in page
    assert nasty not in page
