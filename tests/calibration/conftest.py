"""What every calibration is tested with: the rigs of the project."""

from __future__ import annotations

from pathlib import Path

import pytest

from pbrdf.settings.rig import RigSettings, read_rig

RIGS = Path(__file__).resolve().parents[2] / "config/rig"


@pytest.fixture(scope="session")
def virtual() -> RigSettings:
    return read_rig(RIGS / "virtual.yaml")


@pytest.fixture(scope="session")
def real() -> RigSettings:
    return read_rig(RIGS / "kaist2020.yaml")
