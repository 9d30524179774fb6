from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from pbrdf._kernels import processor

from pbrdf.errors import InputError
from pbrdf.formats.documents import read_any, write_document
from pbrdf.formats.receipt import digest, receipt_content, receipt_summary, write_receipt


@pytest.fixture
def store(tmp_path: Path) -> Path:
    """A folder as Zarr writes one."""
    folder = tmp_path / "table.zarr"
    for name, content in {"zarr.json": b"{}", "m/zarr.json": b"[]", "m/c/0": b"abc", "m/c/1": b""}.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder


def test_a_digest_is_of_names_and_bytes_wherever_they_lie(tmp_path: Path, store: Path) -> None:
    before = digest([store])
    assert len(before) == 64
    moved = tmp_path / "elsewhere/other.zarr"
    moved.parent.mkdir()
    store.rename(moved)
    assert digest([moved]) == before


def test_times_do_not_matter(store: Path) -> None:
    before = digest([store])
    for path in store.rglob("*"):
        os.utime(path, (1, 1))
    assert digest([store]) == before


def test_what_snakemake_leaves_in_a_folder_does_not_matter(store: Path) -> None:
    before = digest([store])
    for folder in (store, store / "m"):
        (folder / ".snakemake_timestamp").touch()
    assert digest([store]) == before


def test_any_byte_matters(store: Path) -> None:
    before = digest([store])
    seen = {before}
    files = [path for path in store.rglob("*") if path.is_file()]
    for path in files:
        content = path.read_bytes()
        for index in range(len(content)):
            path.write_bytes(content[:index] + bytes([content[index] ^ 1]) + content[index + 1 :])
            seen.add(digest([store]))
        path.write_bytes(content + b"\0")
        seen.add(digest([store]))
        path.write_bytes(content)
    assert len(seen) == 1 + sum(len(path.read_bytes()) + 1 for path in files)
    assert digest([store]) == before


@pytest.mark.parametrize(
    "change",
    [
        lambda store: (store / "m/c/1").rename(store / "m/c/2"),
        lambda store: (store / "m/c/1").unlink(),
        lambda store: (store / "m/c/2").touch(),
        lambda store: (store / "m").rename(store / "n"),
        lambda store: (store / "m/c/0").rename(store / "m/c/1"),
    ],
)
def test_names_matter(store: Path, change: Callable[[Path], object]) -> None:
    before = digest([store])
    change(store)
    assert digest([store]) != before


def test_a_file_goes_by_its_own_name(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"x")
    (tmp_path / "b").write_bytes(b"x")
    assert digest([tmp_path / "a"]) != digest([tmp_path / "b"])
    (tmp_path / "other").mkdir()
    (tmp_path / "other/a").write_bytes(b"x")
    assert digest([tmp_path / "other/a"]) == digest([tmp_path / "a"])


def test_a_receipt_tells_content_inputs_settings_and_summary(tmp_path: Path, store: Path) -> None:
    source = tmp_path / "camera.json"
    source.write_text("{}")
    path = tmp_path / "receipt.json"
    write_receipt(
        path, outputs=[store], inputs={"camera": [source]}, settings={"margin_px": 2}, summary={"cond": 13.05}
    )
    assert read_any(path) == {
        "schema": "pbrdf/receipt/1",
        "content": digest([store]),
        "inputs": {"camera": digest([source])},
        "settings": {"margin_px": 2},
        "instruction_set": processor.isa(),
        "summary": {"cond": 13.05},
    }
    assert receipt_content(path) == digest([store])
    assert receipt_summary(path) == {"cond": 13.05}


def test_equal_results_have_equal_receipts(tmp_path: Path, store: Path) -> None:
    for name in ("one", "other"):
        write_receipt(tmp_path / name, outputs=[store], inputs={}, settings={})
    assert (tmp_path / "one").read_bytes() == (tmp_path / "other").read_bytes()


def test_what_is_no_receipt_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "camera.json"
    write_document(path, "camera/1", {"content": "x"})
    with pytest.raises(InputError, match="schema"):
        receipt_content(path)
    write_document(path, "receipt/1", {})
    with pytest.raises(InputError, match="content: is missing"):
        receipt_content(path)
    with pytest.raises(InputError, match="summary: is missing"):
        receipt_summary(path)
