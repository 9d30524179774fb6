"""What a capture has left on the disk, to be held against what another has."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pbrdf.capture.journal import Journal


def capture_content(folder: Path) -> dict[str, Any]:
    """Every file by its path, with checksums in place of a journal's lines, which hold times.

    Raises `InputError` if a journal is torn.
    """
    files: dict[str, Any] = {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and path.name != "journal.jsonl"
    }
    journals = folder.rglob("journal.jsonl")
    return files | {str(path.relative_to(folder)): Journal(path).checksums() for path in journals}
