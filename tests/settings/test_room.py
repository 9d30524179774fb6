"""Room on the disk: told before a run, and refused where there is too little."""

from __future__ import annotations

import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest

from pbrdf.errors import InputError
from pbrdf.settings.room import require_room, told


@pytest.fixture
def three_gigabytes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=3_000_000_000))


@pytest.mark.usefixtures("three_gigabytes")
def test_what_fits_is_told(tmp_path: Path) -> None:
    assert require_room(tmp_path, 2.94e9) == "This run writes at most 2.9 GB; 3.0 GB are free."


@pytest.mark.usefixtures("three_gigabytes")
def test_what_does_not_fit_is_refused_with_both_figures(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"disk: has 3\.0 GB free, and this run writes 1\.2 TB; make room"):
        require_room(tmp_path, 1.18e12)


@pytest.mark.parametrize(
    ("size", "words"),
    [(1, "1 MB"), (2.5e8, "250 MB"), (1e9, "1.0 GB"), (1.23e11, "123 GB"), (2.96e13, "30 TB")],
)
def test_sizes_have_a_unit(size: float, words: str) -> None:
    assert told(size) == words
