"""Fixtures for every test.

`real_data` stands here, at the root of the tests, because oracles and unit tests both read other
people's measurements, and the rule for where they lie must be told once.
"""

from __future__ import annotations

import os
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
