"""Tables of text: what spreadsheets write is read, anything else named."""

from __future__ import annotations

from pathlib import Path

import pytest

from pbrdf.errors import InputError
from pbrdf.formats.rows import read_rows

COLUMNS = ("file", "exposure_s")


def _read(tmp_path: Path, content: bytes) -> list[tuple[int, dict[str, str | None]]]:
    path = tmp_path / "settings.csv"
    path.write_bytes(content)
    return read_rows(path, COLUMNS, ",", "`details`")


def test_byte_order_mark_and_quotes_of_a_spreadsheet_are_read(tmp_path: Path) -> None:
    rows = _read(tmp_path, b'\xef\xbb\xbffile,exposure_s\r\n"a,b.png",0.5\r\n')
    assert rows == [(2, {"file": "a,b.png", "exposure_s": "0.5"})]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"file;exposure_s\na;1\n", "header: is .*write the columns file,exposure_s"),
        (b"file,exposure_s\n", "rows: there are none"),
        (b"file,exposure_s\n\xff,1\n", "file: is not UTF-8"),
        (b"", "header: is"),
    ],
)
def test_other_text_is_refused(tmp_path: Path, content: bytes, words: str) -> None:
    with pytest.raises(InputError, match=words):
        _read(tmp_path, content)


def test_missing_file_is_named_with_where_it_was_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"absent.csv: file: does not exist; correct `details`"):
        read_rows(tmp_path / "absent.csv", COLUMNS, ",", "`details`")
