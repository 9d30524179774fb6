"""The conda descriptions are those that the lock file makes."""

from __future__ import annotations

import runpy
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def test_environments_hold_the_versions_of_the_lock_file() -> None:
    made = runpy.run_path(str(ROOT / "tools/conda_envs.py"))["environments"](
        (ROOT / "requirements.lock").read_text(encoding="utf-8")
    )
    written = {path.stem: path.read_text(encoding="utf-8") for path in (ROOT / "envs").glob("*.yaml")}
    assert written == made
