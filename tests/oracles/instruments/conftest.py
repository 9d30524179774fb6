"""Other people's drivers, in an environment of their own."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).parent
PYTHON = HERE.parents[2] / ".venv-oracles" / "bin" / "python"


@pytest.fixture(scope="session")
def session() -> Callable[..., dict[str, Any]]:
    """Run a program of this folder with other people's packages; it prints JSON."""
    python = Path(os.environ.get("PBRDF_ORACLES", PYTHON))
    if not python.exists() or not (python.parents[1] / "packages").exists():
        pytest.skip(f"other people's drivers are not at {python}: `make test` installs them")

    def run(program: str, *arguments: str, said: object = None) -> dict[str, Any]:
        done = subprocess.run(
            [python, "-W", "ignore", HERE / program, *arguments],
            input=json.dumps(said),
            capture_output=True,
            text=True,
            timeout=60.0,
        )
        assert done.returncode == 0, done.stderr
        found: dict[str, Any] = json.loads(done.stdout)
        return found

    return run
