"""Files that need no reader of ours, in a few lines: rows of values, pages, their scripts, and pictures."""

from __future__ import annotations

import binascii
import csv
import json
import re
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
from PIL import Image, UnidentifiedImageError

from pbrdf.errors import InputError

_PDF_SIZE = re.compile(rb"/MediaBox\s*\[\s*0 0 ([\d.]+) ([\d.]+)\s*\]")
_VALUES = re.compile(r"panelValues\((\d+), (\d+), (\[.*\])\);\n", re.DOTALL)
_SVG_SIZE = re.compile(rb'<svg[^>]*?\swidth="([^"]+)"', re.DOTALL)
_SVG_HEIGHT = re.compile(rb'<svg[^>]*?\sheight="([^"]+)"', re.DOTALL)


def rows_summary(path: Path) -> dict[str, str]:
    """Rows, columns and, of a comparison of fits, materials, models, quantities and units of a CSV."""
    try:
        with path.open(encoding="utf-8", newline="") as stream:
            reader = csv.DictReader(stream, strict=True)
            rows, columns = list(reader), reader.fieldnames or ()
    except (UnicodeDecodeError, csv.Error) as error:
        raise _broken(path, f"cannot be read as rows of values ({error})") from None
    lines = {"kind": "rows of values", "shape": f"{len(rows)} rows × {len(columns)} columns"}
    lines["columns"] = ", ".join(columns)
    for name in ("material", "of", "quantity", "unit"):
        if name in columns:
            lines[name] = ", ".join(sorted({row[name] or "–" for row in rows}))
    return lines


class _Page(HTMLParser):
    """Title, verdict and provenance of a page of the report."""

    def __init__(self) -> None:
        super().__init__()
        self.title = self.verdict = ""
        self.provenance: dict[str, str] = {}
        self._inside = self._name = ""
        self._at_provenance = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        told = dict(attrs)
        self._at_provenance |= told.get("id") == "provenance"
        if tag in ("title", "dt", "dd"):
            self._inside = tag
        elif tag == "p":
            self._inside = "verdict" if told.get("class") == "verdict" else ""

    def handle_endtag(self, tag: str) -> None:
        if tag in ("title", "p", "dt", "dd"):
            self._inside = ""

    def handle_data(self, data: str) -> None:
        if self._inside == "title":
            self.title += data
        elif self._inside == "verdict":
            self.verdict += data
        elif self._at_provenance and self._inside == "dt":
            self._name = data
        elif self._at_provenance and self._inside == "dd":
            self.provenance[self._name] = data


def page_summary(path: Path) -> dict[str, str]:
    """Title, verdict and provenance of a page of the report."""
    page = _Page()
    try:
        page.feed(path.read_text(encoding="utf-8"))
    except UnicodeDecodeError as error:
        raise _broken(path, f"is no page ({error})") from None
    if not page.provenance:
        raise _broken(path, "is no page of a report: it tells no provenance")
    lines = {"kind": "page of a report", "title": page.title}
    if page.verdict:
        lines["verdict"] = " ".join(page.verdict.split())
    return lines | page.provenance


def script_summary(path: Path) -> dict[str, str]:
    """Range of M00 behind a material's panels; of a script that draws, that it is one."""
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise _broken(path, f"is no script ({error})") from None
    values = _VALUES.fullmatch(text)
    if values is None:
        return {"kind": "script of the pages", "shape": f"{len(text.splitlines())} lines"}
    try:
        sources = [np.frombuffer(binascii.a2b_base64(one), "<f4") for one in json.loads(values[3])]
        matrices = [source.reshape(-1, 16)[:, 0] for source in sources]
    except ValueError as error:
        raise _broken(path, f"holds values that cannot be read ({error})") from None
    lines = {"kind": "values of a page's panels", "slice": values[1], "band": values[2]}
    for name, first in zip(("table", "model"), matrices, strict=False):
        known = first[np.isfinite(first)]
        told = f"M00 {known.min():.3g} … {known.max():.3g} 1/sr, " if known.size else ""
        lines[name] = f"{told}{known.size} of {first.size} nodes known"
    return lines


def picture_summary(path: Path) -> dict[str, str]:
    """Size of a PNG, SVG or PDF."""
    size = {".png": _png_size, ".svg": _svg_size, ".pdf": _pdf_size}[path.suffix](path)
    if size is None:
        raise _broken(path, f"is no {path.suffix[1:].upper()} with a size")
    return {"kind": f"picture ({path.suffix[1:].upper()})", "shape": size}


def _png_size(path: Path) -> str | None:
    try:
        with Image.open(path) as image:
            return f"{image.height} × {image.width} px"
    except UnidentifiedImageError:
        return None


def _svg_size(path: Path) -> str | None:
    text = path.read_bytes()
    width, height = _SVG_SIZE.search(text), _SVG_HEIGHT.search(text)
    return f"{height[1].decode()} × {width[1].decode()}" if width and height else None


def _pdf_size(path: Path) -> str | None:
    found = _PDF_SIZE.search(path.read_bytes())
    return f"{found[2].decode()} × {found[1].decode()} pt" if found else None


def _broken(path: Path, problem: str) -> InputError:
    return InputError(path, "file", problem, "make it again")


PLAIN: dict[str, Callable[[Path], dict[str, str]]] = {
    ".csv": rows_summary,
    ".html": page_summary,
    ".js": script_summary,
    ".png": picture_summary,
    ".svg": picture_summary,
    ".pdf": picture_summary,
}
"""Who tells of a file, by the end of its name."""
