"""What the README's table of reruns says, line by line: the jobs of the `snakemake` that follows a change."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
import yaml
from small_workflow import ROOT, TRUTH, small_settings, snakemake, write_materials, write_project

import pbrdf
from pbrdf import _kernels

pytestmark = pytest.mark.workflow

CONFIG = ("--configfile", "config.yaml")
LIGHTS = 2
MATERIALS = {"plastic": "monday", "gold": "tuesday"}
SESSIONS = ("camera", "polarimeter", "lights", "radiometry")
JOBS = re.compile(r"^(\w+) +(\d+)$", re.MULTILINE)
CELL = re.compile(r"`(\w+)` (\w+)")
# Snakemake with a copy of the package, edited, and kernels that say they are built from other sources
EDITED = """
import sys
sys.meta_path = [finder for finder in sys.meta_path if "editable" not in type(finder).__module__]
sys.path.insert(0, sys.argv.pop(1))
topic = sys.argv.pop(1)
from pbrdf import _kernels
_kernels.digests.update({topic: "edited"} if topic else {})
from snakemake.cli import main
main()
"""


def table_of_the_readme() -> dict[str, Counter[str]]:
    """Jobs by what changed, as the README tells them of a project such as this one."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    lines = text.partition("| what changed |")[2].partition("\n\n")[0].splitlines()[2:]
    sizes = {"L": LIGHTS, "M": len(MATERIALS), "LM": LIGHTS * len(MATERIALS)}
    table = {}
    for line in lines:
        change, jobs = (cell.strip() for cell in line.strip("|").split("|"))
        counts = {rule: sizes.get(count) or int(count) for rule, count in CELL.findall(jobs)}
        table[change] = Counter(counts)
    return table


README = table_of_the_readme()


def due(run: subprocess.CompletedProcess[str]) -> Counter[str]:
    """Jobs that a dry run would run, the mere targets left out."""
    assert run.returncode == 0, run.stderr
    counts = Counter({rule: int(count) for rule, count in JOBS.findall(run.stdout + run.stderr)})
    for target in ("all", "total"):
        del counts[target]
    return counts


def jobs(folder: Path, project: Path = ROOT) -> Counter[str]:
    """Jobs that `snakemake` would run now."""
    return due(snakemake(folder, *CONFIG, "--dry-run", project=project))


def jobs_of_edited(folder: Path, library: Path, topic: str = "") -> Counter[str]:
    """Jobs that it would run with another library, and with one topic of the kernels edited."""
    arguments = ("--snakefile", str(ROOT / "Snakefile"), "--workflow-profile", str(ROOT / "profiles/default"))
    command = [sys.executable, "-c", EDITED, str(library), topic, *arguments, *CONFIG, "--dry-run"]
    return due(subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False))


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished project: two materials of a session each, two lights, one band, images kept."""
    folder = tmp_path_factory.mktemp("partial")
    settings = small_settings()
    settings["plan"] |= {"lights_deg": [30, 60], "bands_nm": [550], "exposures_ms": [40], "darks": 1}
    settings["reconstruction"] = {"keep_images": ["030.00", "060.00"]}
    settings["tabulation"] |= {"widest_gap_deg": 40}
    settings["fitting"] |= {"held_out": False}
    settings["calibration"] = TRUTH | {kind: f"truth/{{session}}/{kind}.json" for kind in SESSIONS}
    write_project(folder, settings)
    rows = [(name, "rig", session, "25", "-", "-") for name, session in MATERIALS.items()]
    write_materials(folder, *rows)
    for session in MATERIALS.values():
        (folder / "truth" / session).mkdir()
        for kind in SESSIONS:
            shutil.copy(folder / TRUTH[kind], folder / "truth" / session)
    run = snakemake(folder, *CONFIG)
    assert run.returncode == 0, run.stderr
    return folder


@pytest.fixture
def project(done: Path, tmp_path: Path) -> Path:
    folder = tmp_path / "project"
    shutil.copytree(done, folder)
    return folder


@pytest.fixture
def library(tmp_path: Path) -> Path:
    """A copy of the installed package, to be edited."""
    package = Path(pbrdf.__file__).parent
    folder = tmp_path / "library"
    for name in ("pbrdf", "snakemake_logger_plugin_timeleft"):
        shutil.copytree(package.with_name(name), folder / name)
    shutil.copy(_kernels.__file__, folder / "pbrdf")
    return folder


def change(path: Path, **changes: Any) -> None:
    """Change fields of a JSON document."""
    content = json.loads(path.read_text(encoding="utf-8"))
    path.write_text(json.dumps(content | changes), encoding="utf-8")


def recalibrate(folder: Path) -> None:
    """What `make recalibrate` does to results: calibrations are made again, by an invocation of their own."""
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    rules = re.findall(r"\w+", makefile.partition("CALIBRATING :=")[2].partition("\nrecalibrate")[0])
    run = snakemake(folder, "calibrations", *CONFIG, "--forcerun", *rules)
    assert run.returncode == 0, run.stderr


def edit(file: Path) -> None:
    file.write_text(file.read_text(encoding="utf-8") + "\nEDITED = True\n", encoding="utf-8")


def test_nothing_is_due_after_a_run(done: Path) -> None:
    assert jobs(done) == Counter()


def test_one_light_retaken(project: Path) -> None:
    change(project / "captures/plastic/lights/030.00/manifest.json", digest="0" * 64)
    assert jobs(project) == README["one light retaken"]


def test_calibrated_again_to_the_same_values(project: Path) -> None:
    recalibrate(project)
    assert jobs(project) == README["calibrated again, to the same values"] == Counter()


def test_polarimeter_of_a_session_calibrated_to_new_values(project: Path) -> None:
    truth = project / "truth/monday/polarimeter.json"
    zeros = json.loads(truth.read_text(encoding="utf-8"))["zeros_deg"]
    change(truth, zeros_deg=zeros | {"generator_retarder": zeros["generator_retarder"] + 0.5})
    recalibrate(project)
    assert jobs(project) == README["polarimeter of a session calibrated to new values"]


def test_lights_of_a_session_moved(project: Path) -> None:
    truth = project / "truth/tuesday/lights.json"
    change(truth, radius_mm=json.loads(truth.read_text(encoding="utf-8"))["radius_mm"] + 1.0)
    recalibrate(project)
    assert jobs(project) == README["lights of a session moved, images kept"]


def test_a_session_that_no_material_names(project: Path) -> None:
    shutil.copytree(project / "truth/monday", project / "truth/wednesday")
    recalibrate(project)
    assert jobs(project) == README["a session that no material names"] == Counter()


def test_settings_of_the_fits(project: Path) -> None:
    settings = yaml.safe_load((project / "config.yaml").read_text(encoding="utf-8"))
    settings["fitting"]["seed"] = 7
    (project / "config.yaml").write_text(yaml.safe_dump(settings), encoding="utf-8")
    assert jobs(project) == README["settings of the fits"]


def test_a_copy_of_the_library_is_the_library(project: Path, library: Path) -> None:
    assert jobs_of_edited(project, library) == Counter()


@pytest.mark.parametrize(
    ("line", "file"),
    [
        ("a model's bound", "models/baek2018.py"),
        ("the same of a model that is not fitted", "models/hyde2009.py"),
        ("`tabulation/fill.py` edited", "tabulation/fill.py"),
        ("a page's template edited", "report/templates/base.html.j2"),
    ],
)
def test_library_edited(project: Path, library: Path, line: str, file: str) -> None:
    edit(library / "pbrdf" / file)
    assert jobs_of_edited(project, library) == README[line]


@pytest.mark.parametrize("topic", ["solve", "facet"])
def test_kernel_edited(project: Path, library: Path, topic: str) -> None:
    assert jobs_of_edited(project, library, topic) == README[f"the kernel `{topic}` edited"]


def test_a_new_clone_with_a_comment_in_its_readme(project: Path, tmp_path: Path) -> None:
    clone = tmp_path / "clone"
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True)
    for name in filter(None, listed.stdout.split("\0")):
        if (ROOT / name).is_file():
            (clone / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / name, clone / name)
    edit(clone / "README.md")
    line = "a comment in this file, a new clone over old results (`--directory`), every file touched"
    assert jobs(project, clone) == README[line] == Counter()


def test_every_file_touched(project: Path) -> None:
    for path in sorted(project.rglob("*")):
        if path.is_file() and path.name != ".snakemake_timestamp" and ".snakemake" not in path.parts:
            os.utime(path)
    assert jobs(project) == Counter()
