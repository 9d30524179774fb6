"""The tutorial, executed as a reader would: its blocks in order, in an empty folder."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from small_workflow import ROOT

pytestmark = pytest.mark.workflow

BLOCK = re.compile(r"^```(python|sh)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def as_script(text: str) -> str:
    """All blocks as one program; shell blocks are run by it."""
    parts = ["import subprocess"]
    for language, code in BLOCK.findall(text):
        run = f"subprocess.run(['bash', '-euc', {code!r}], check=True)"
        parts.append(code if language == "python" else run)
    return "\n".join(parts)


def test_the_tutorial_runs_and_ends_at_the_truth(tmp_path: Path) -> None:
    text = (ROOT / "docs/tutorial.md").read_text(encoding="utf-8")
    script = as_script(text)
    assert script.count("assert ") >= 5
    commands = tmp_path / "bin"
    commands.mkdir()
    for name, module in (("snakemake", "snakemake.cli"), ("pbrdf", "pbrdf.cli")):
        start = f"from {module} import main; import sys; sys.exit(main())"
        (commands / name).write_text(f"#!/bin/sh\nexec {sys.executable} -c '{start}' \"$@\"\n")
        (commands / name).chmod(0o755)
    folder = tmp_path / "empty"
    folder.mkdir()
    environment = os.environ | {"PBRDF": str(ROOT), "PATH": f"{commands}:{os.environ['PATH']}"}
    run = subprocess.run(
        [sys.executable, "-c", script],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr[-3000:]
    assert "° measured," in run.stdout
    assert (folder / "results/report/plastic.html").is_file()
