"""Write a C++ header with the digest of each kernel topic: its sources, their headers, and the flags.

Run by CMake: ``topic_digests.py HEADER FLAGS TOPIC...``.
"""

from __future__ import annotations

import hashlib
import re
import sys
from pathlib import Path

KERNELS = Path(__file__).resolve().parent
INCLUDE = re.compile(r'^#include "(?:pbrdf/)?([a-z_]+\.hpp)"', re.MULTILINE)


def closure(source: Path, seen: set[Path]) -> set[Path]:
    """Add `source` and every header of ours that it includes, directly or not, to `seen`."""
    if source in seen:
        return seen
    seen.add(source)
    for name in INCLUDE.findall(source.read_text()):
        candidates = [KERNELS / "include" / "pbrdf" / name, KERNELS / "bindings" / name]
        for header in (c for c in candidates if c.exists()):
            closure(header, seen)
    return seen


def topic_digest(topic: str, flags: str) -> str:
    """SHA-256 of the flags and of the files behind a topic, in the order of their names."""
    files: set[Path] = set()
    for source in (KERNELS / "src" / f"{topic}.cpp", KERNELS / "bindings" / f"bind_{topic}.cpp"):
        closure(source, files)
    digest = hashlib.sha256(flags.encode())
    for path in sorted(files):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def main(header: Path, flags: str, topics: list[str]) -> None:
    """Write `header`, leaving it alone when nothing changed so that nothing is compiled again."""
    entries = "".join(f'    {{"{topic}", "{topic_digest(topic, flags)}"}},\n' for topic in topics)
    text = (
        "#pragma once\n#include <map>\n#include <string>\n\nnamespace pbrdf {\n"
        f"inline const std::map<std::string, std::string> digests = {{\n{entries}}};\n}}\n"
    )
    if not header.exists() or header.read_text() != text:
        header.parent.mkdir(parents=True, exist_ok=True)
        header.write_text(text)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], sys.argv[3:])
