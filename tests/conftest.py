"""Fixtures for every test.

They stand here, at the root of the tests, because several folders need them: where other people's
measurements lie, and how one shows that a result does not depend on the number of threads.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def real_data() -> Path:
    """Folder of other people's measurements: `PBRDF_DATA`, or ``../shared/data`` beside the project."""
    folder = Path(os.environ.get("PBRDF_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"other people's measurements are not at {folder}: set PBRDF_DATA to their folder")
    return folder


@pytest.fixture(scope="session")
def printed_by_threads() -> Callable[[str], set[str]]:
    """Run a program, which prints the digest of its results, with one, two and three threads."""

    def printed(program: str) -> set[str]:
        return {
            subprocess.run(
                [sys.executable, "-c", program],
                env=os.environ | {"OMP_NUM_THREADS": threads, "OPENBLAS_NUM_THREADS": "1"},
                capture_output=True,
                text=True,
                check=True,
            ).stdout
            for threads in ("1", "2", "3")
        }

    return printed
