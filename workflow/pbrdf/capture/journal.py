"""The journal of one light: a line a frame; a frame without a line does not exist."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf.errors import InputError


def checksum(frame: NDArray[Any]) -> str:
    """BLAKE2b of a frame's pixels, 16 bytes in hexadecimal."""
    return hashlib.blake2b(np.ascontiguousarray(frame).tobytes(), digest_size=16).hexdigest()


class Journal:
    """``journal.jsonl`` of a light."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)

    def append(self, frame_id: str, frame: NDArray[Any], details: Mapping[str, Any]) -> None:
        """Record that `frame` is stored, with what was asked of the instruments and read back."""
        line = json.dumps({"frame": frame_id, "checksum": checksum(frame), **details}, ensure_ascii=False)
        with self.path.open("a", encoding="utf-8") as stream:
            stream.write(line + "\n")
            stream.flush()
            os.fsync(stream.fileno())

    def checksums(self) -> dict[str, str]:
        """Checksum by frame id; raises as `entries`."""
        return {entry["frame"]: entry["checksum"] for entry in self.entries()}

    def entries(self) -> list[dict[str, Any]]:
        """What it says of each frame, in the order they were taken; empty where there is no journal yet.

        A last line without its end is what an interruption left of a frame, and does not count.

        Raises
        ------
        InputError
            If any other line cannot be read.
        """
        if not self.path.exists():
            return []
        whole, end, rest = self.path.read_bytes().rpartition(b"\n")
        if rest:
            with self.path.open("r+b") as stream:
                stream.truncate(len(whole) + len(end))
                os.fsync(stream.fileno())
        found: list[dict[str, Any]] = []
        for number, line in enumerate(whole.split(b"\n") if end else [], start=1):
            try:
                entry = json.loads(line)
                if not (isinstance(entry["frame"], str) and isinstance(entry["checksum"], str)):
                    raise TypeError("frame and checksum are not text")
                found.append(entry)
            except (ValueError, KeyError, TypeError, RecursionError) as error:
                raise InputError(
                    self.path, f"line {number}", f"cannot be read ({error})", "take that light again"
                ) from None
        return found
