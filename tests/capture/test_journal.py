from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from pbrdf.capture.journal import Journal, checksum
from pbrdf.errors import InputError

FRAME = np.arange(6, dtype=np.uint16).reshape(2, 3)


@pytest.fixture
def journal(tmp_path: Path) -> Journal:
    """A journal of two frames, with a text of many bytes a letter."""
    journal = Journal(tmp_path / "journal.jsonl")
    journal.append("450nm/s00/e0", FRAME, {"note": "θ = 5°"})
    journal.append("450nm/s01/e0", FRAME + 1, {"note": "one\u2028line"})
    return journal


def test_a_checksum_is_of_the_pixels_however_they_lie() -> None:
    assert len(checksum(FRAME)) == 32
    assert checksum(FRAME) == checksum(np.asfortranarray(FRAME)) == checksum(FRAME.copy())
    for index in np.ndindex(FRAME.shape):
        changed = FRAME.copy()
        changed[index] ^= 1
        assert checksum(changed) != checksum(FRAME)


def test_frames_are_found_by_their_line(journal: Journal) -> None:
    assert journal.checksums() == {"450nm/s00/e0": checksum(FRAME), "450nm/s01/e0": checksum(FRAME + 1)}
    first = json.loads(journal.path.read_bytes().split(b"\n")[0])
    assert first == {"frame": "450nm/s00/e0", "checksum": checksum(FRAME), "note": "θ = 5°"}


def test_no_journal_is_an_empty_one(tmp_path: Path) -> None:
    assert Journal(tmp_path / "journal.jsonl").checksums() == {}


def test_a_last_line_torn_anywhere_is_dropped_and_the_next_begins_anew(journal: Journal) -> None:
    whole = journal.path.read_bytes()
    first = whole.index(b"\n") + 1
    for end in range(first + 1, len(whole)):
        journal.path.write_bytes(whole[:end])
        assert list(journal.checksums()) == ["450nm/s00/e0"]
        assert journal.path.read_bytes() == whole[:first]
    journal.append("450nm/s01/e0", FRAME, {})
    assert list(journal.checksums()) == ["450nm/s00/e0", "450nm/s01/e0"]


def test_a_first_line_torn_anywhere_leaves_nothing(journal: Journal) -> None:
    whole = journal.path.read_bytes()
    for end in range(whole.index(b"\n") + 1):
        journal.path.write_bytes(whole[:end])
        assert journal.checksums() == {}
        assert journal.path.read_bytes() == b""


@pytest.mark.parametrize(
    "line",
    [
        b"",
        b"{",
        b"[]",
        b"3",
        b'{"frame": "a"}',
        b'{"checksum": "a"}',
        b'{"frame": [], "checksum": 1}',
        b"\xff",
    ],
)
@pytest.mark.parametrize("number", [1, 2, 3])
def test_a_damaged_line_is_refused_and_left_as_it_is(journal: Journal, line: bytes, number: int) -> None:
    lines = journal.path.read_bytes().split(b"\n")
    lines.insert(number - 1, line)
    journal.path.write_bytes(b"\n".join(lines))
    with pytest.raises(InputError) as refused:
        journal.checksums()
    assert refused.value.source == str(journal.path)
    assert refused.value.field == f"line {number}"
    assert journal.path.read_bytes() == b"\n".join(lines)
