"""Captures killed at random moments: what the runs after it leave is what one undisturbed run leaves."""

from __future__ import annotations

import os
import random
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from capture_content import capture_content

KILLS = int(os.environ.get("PBRDF_KILLS", "10"))
"""Of both ways together; `make test-faults` asks for 200."""

CAPTURE = """
import sys
from pathlib import Path
from pbrdf.capture.run import capture
from pbrdf.instruments.emulators.rig import emulated_rig
from pbrdf.instruments.virtual_rig import VirtualRig
from pbrdf.instruments.virtual_sphere import VirtualSphere
from pbrdf.settings.plan import CapturePlan, Light, Metering
from pbrdf.settings.rig import read_rig
folder, source, way = sys.argv[1:]
settings = read_rig(source)
camera = {**settings["camera"], "rows": 16, "columns": 16, "focal_px": 200, "principal_px": [7.5, 7.5]}
rig = {**settings, "camera": camera}
states = tuple((0.0, 25.0 * n % 360, 5.0 * n, 90.0) for n in range(20))
lights = tuple(Light(f"{angle:06.2f}", angle) for angle in (8.0, 41.0, 90.0, 150.0))
metering = Metering(0.001, 0.8) if way == "metered" else None
plan = CapturePlan(lights, (450, 550, 650), states, (0.01, 0.04), 2, (1, 20), 1, metering)
renderer = VirtualRig(rig, VirtualSphere(rig, "gold", 25.0, source))
print("ready", flush=True)
with emulated_rig(rig, renderer) as ready:
    capture(plan, "gold", ready, folder, darks_at_ends=way == "metered")
"""


def begun(folder: Path, root: Path, way: str) -> subprocess.Popen[bytes]:
    """A capture whose modules are loaded."""
    source = root / "config/rig/virtual.yaml"
    child = subprocess.Popen(
        [sys.executable, "-c", CAPTURE, str(folder), str(source), way],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )
    assert child.stdout is not None
    assert child.stdout.readline() == b"ready\n"
    return child


def ended(child: subprocess.Popen[bytes]) -> int:
    assert child.stdout is not None
    child.stdout.close()
    return child.wait()


@pytest.mark.parametrize("way", ["fixed", "metered"])
def test_killed_runs_end_in_the_bytes_of_an_undisturbed_one(
    tmp_path: Path, pytestconfig: Any, way: str
) -> None:
    """With fixed exposures light by light; metered, with dark frames at start and end of the run."""
    root = pytestconfig.rootpath
    whole = tmp_path / "undisturbed"
    assert ended(begun(whole, root, way)) == 0
    expected = capture_content(whole)
    chance, folder, kills = random.Random(1), tmp_path / "killed", 0
    while kills < KILLS / 2:
        child = begun(folder, root, way)
        try:
            child.wait(chance.uniform(0.0, 1.5))
        except subprocess.TimeoutExpired:
            child.kill()
            kills += 1
        if ended(child) == 0:
            assert capture_content(folder) == expected
            shutil.rmtree(folder)
    assert ended(begun(folder, root, way)) == 0
    assert capture_content(folder) == expected
