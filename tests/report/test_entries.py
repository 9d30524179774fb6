"""What the index knows of a page: from its file, and in words."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from pbrdf.errors import InputError
from pbrdf.report.entries import IndexEntry, calibration_words, read_entry, write_entry


def test_entry_of_a_wrong_type_is_refused(tmp_path: Path) -> None:
    entry = IndexEntry("gold", "gold.html", "table", 5, None, (), "measured")
    write_entry(tmp_path / "gold.json", replace(entry, name=3))  # type: ignore[arg-type]
    with pytest.raises(InputError, match="name"):
        read_entry(tmp_path / "gold.json")


@pytest.mark.parametrize(
    ("sources", "words"),
    [
        ({}, "not known"),
        ({"camera": "measured"}, "measured"),
        ({"camera": "measured", "polarimeter": "file"}, "polarimeter file; camera measured"),
    ],
)
def test_calibrations_in_words(sources: dict[str, str], words: str) -> None:
    assert calibration_words(sources) == words
