from __future__ import annotations

import errno
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from pbrdf.errors import InputError
from pbrdf.formats.beside import name_beside
from pbrdf.formats.folders import replace_folder


def _content(folder: Path) -> dict[str, str]:
    return {str(p.relative_to(folder)): p.read_text() for p in folder.rglob("*") if p.is_file()}


@pytest.fixture
def old(tmp_path: Path) -> Path:
    folder = tmp_path / "results/table"
    (folder / "inner").mkdir(parents=True)
    (folder / "inner/a").write_text("old")
    (folder / "b").write_text("old")
    return folder


def test_a_new_folder_appears_when_the_block_ends(tmp_path: Path) -> None:
    target = tmp_path / "results/table"
    with replace_folder(target) as beside:
        (beside / "a").write_text("new")
        assert beside.parent == target.parent
        assert not target.exists()
    assert _content(tmp_path) == {"results/table/a": "new"}


def test_success_replaces_all_of_the_old(tmp_path: Path, old: Path) -> None:
    with replace_folder(old) as beside:
        assert list(beside.iterdir()) == []
        (beside / "a").write_text("new")
        assert _content(old) == {"inner/a": "old", "b": "old"}
    assert _content(tmp_path) == {"results/table/a": "new"}


def test_a_file_in_its_place_is_replaced_too(tmp_path: Path) -> None:
    (tmp_path / "table").write_text("old")
    with replace_folder(tmp_path / "table") as beside:
        (beside / "a").write_text("new")
    assert _content(tmp_path) == {"table/a": "new"}


@pytest.mark.parametrize("kind", [ValueError, KeyboardInterrupt, SystemExit])
def test_a_failing_block_leaves_the_old(tmp_path: Path, old: Path, kind: type[BaseException]) -> None:
    def fail() -> None:
        with replace_folder(old) as beside:
            (beside / "a").write_text("half")
            raise kind

    with pytest.raises(kind):
        fail()
    assert _content(tmp_path) == {"results/table/inner/a": "old", "results/table/b": "old"}
    assert [path.name for path in old.parent.iterdir()] == ["table"]


@pytest.mark.parametrize("code", [errno.ENOENT, errno.ENOTEMPTY])
def test_threads_that_are_still_at_work_in_a_failed_folder_do_no_harm(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: int
) -> None:
    """As those of Zarr are, when one of many chunks found no room: they put and take files meanwhile."""
    rmtree, met = shutil.rmtree, []

    def disturbed(path: Path) -> None:
        met.append(path)
        if len(met) == 1:
            raise OSError(code, os.strerror(code))
        rmtree(path)

    def fail() -> None:
        with replace_folder(tmp_path / "table") as beside:
            (beside / "a").write_text("half")
            raise ValueError

    monkeypatch.setattr(shutil, "rmtree", disturbed)
    with pytest.raises(ValueError):
        fail()
    assert list(tmp_path.iterdir()) == []


def test_a_failing_block_leaves_nothing_where_nothing_was(tmp_path: Path) -> None:
    def fail() -> None:
        with replace_folder(tmp_path / "table") as beside:
            (beside / "a").write_text("half")
            raise ValueError

    with pytest.raises(ValueError):
        fail()
    assert list(tmp_path.iterdir()) == []


def test_the_old_returns_when_the_new_cannot_take_its_place(
    tmp_path: Path, old: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rename = Path.rename

    def refusing(self: Path, target: Path) -> Path:
        if self.suffix == ".part":
            raise OSError("the disk refuses")
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", refusing)
    with (
        pytest.raises(InputError, match="table: file: cannot be written: the disk refuses"),
        replace_folder(old) as beside,
    ):
        (beside / "a").write_text("new")
    assert _content(tmp_path) == {"results/table/inner/a": "old", "results/table/b": "old"}
    assert [path.name for path in old.parent.iterdir()] == ["table"]


def test_what_a_killed_process_left_is_no_part_of_the_new(tmp_path: Path) -> None:
    target = tmp_path / "table"
    with replace_folder(target) as beside:
        left = beside
    left.mkdir()
    (left / "half").write_text("left")
    with replace_folder(target) as beside:
        assert beside == left
        assert list(beside.iterdir()) == []
    assert _content(tmp_path) == {}


def test_what_other_processes_left_stays_while_they_live(tmp_path: Path) -> None:
    target = tmp_path / "table"
    machine = os.uname().nodename
    # one that is there and one that is not any more
    living = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    names = [f".table.{machine}-{process.pid}.part" for process in (living, dead)]
    for name in (*names, f".table.elsewhere-{dead.pid}.part"):
        (tmp_path / name).mkdir()
    name_beside(target)
    living.communicate()
    assert {path.name for path in tmp_path.iterdir()} == {names[0], f".table.elsewhere-{dead.pid}.part"}
