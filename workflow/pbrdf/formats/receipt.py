"""Receipts: what a large output holds and what it was made from, small enough to go by content."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from pbrdf._kernels import processor
from pbrdf.formats.documents import member, read_document, write_document

KIND = "receipt/1"


def digest(paths: Iterable[str | Path]) -> str:
    """SHA-256 of files and folders: of their relative names and bytes, in the order of the names."""
    whole = hashlib.sha256()
    for path in map(Path, paths):
        files = sorted(p for p in path.rglob("*") if _is_content(p)) if path.is_dir() else [path]
        for file in files:
            name = file.relative_to(path).as_posix() if path.is_dir() else path.name
            whole.update(name.encode() + b"\0")
            with file.open("rb") as stream:
                whole.update(hashlib.file_digest(stream, "sha256").digest())
    return whole.hexdigest()


def digests(files: Mapping[str, str | Path]) -> dict[str, str]:
    """SHA-256 of each of several files and folders, by their names."""
    return {name: digest([path]) for name, path in files.items()}


def write_receipt(
    path: str | Path,
    *,
    outputs: Iterable[str | Path],
    inputs: Mapping[str, Iterable[str | Path]],
    settings: Mapping[str, Any],
    summary: Mapping[str, Any] | None = None,
) -> None:
    """Write the receipt of `outputs`.

    Parameters
    ----------
    path : str or Path
        Where the receipt goes.
    outputs : iterable of paths
        The files and folders that were made.
    inputs : mapping of str to paths
        What they were made from, by role: small files only (receipts, manifests, calibrations).
    settings : mapping
        Settings and code digests that went into them.
    summary : mapping, optional
        Figures about the content that later stages and pages show.
    """
    write_document(
        path,
        KIND,
        {
            "content": digest(outputs),
            "inputs": {role: digest(paths) for role, paths in inputs.items()},
            "settings": dict(settings),
            "instruction_set": processor.isa(),
            "summary": dict(summary or {}),
        },
    )


def receipt_content(path: str | Path) -> str:
    """Digest of what a receipt is for; raises `InputError` if it is no receipt."""
    return str(member(path, read_document(path, KIND), "content"))


def receipt_summary(path: str | Path) -> dict[str, Any]:
    """Figures that a receipt holds; raises `InputError` if it is no receipt."""
    return dict(member(path, read_document(path, KIND), "summary"))


def _is_content(path: Path) -> bool:
    return path.is_file() and path.name != ".snakemake_timestamp"
