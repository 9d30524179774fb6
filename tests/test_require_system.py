"""What `make` says of a system that lacks something: one line that names all of it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[1] / "tools/require-system.sh"


def ask(folder: Path, *commands: str) -> subprocess.CompletedProcess[str]:
    """Run the check where only `commands` are to be found."""
    for command in commands:
        place = shutil.which(command)
        assert place is not None
        (folder / command).symlink_to(place)
    return subprocess.run(
        ["/bin/sh", str(SCRIPT), sys.executable],
        env={**os.environ, "PATH": str(folder)},
        capture_output=True,
        text=True,
        check=False,
    )


def test_whole_system_is_accepted_in_silence(tmp_path: Path) -> None:
    answer = ask(tmp_path, "python3", "g++", "git")
    assert (answer.returncode, answer.stdout, answer.stderr) == (0, "", "")


def test_everything_missing_is_named_in_one_line(tmp_path: Path) -> None:
    answer = ask(tmp_path, "python3")
    assert answer.returncode == 1
    assert answer.stderr == "pbrdf needs these packages first: apt-get install g++ git\n"


def test_missing_python_is_named(tmp_path: Path) -> None:
    answer = subprocess.run(
        ["/bin/sh", str(SCRIPT), "python3-of-nobody"], capture_output=True, text=True, check=False
    )
    assert answer.returncode == 1
    assert answer.stderr == "pbrdf needs these packages first: apt-get install python3\n"
