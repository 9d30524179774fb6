"""What is released: one version, a source archive that is the checkout, a wheel that needs no checkout."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import venv
import zipfile
from importlib.metadata import version
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[1]
VERSION: str = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
OTHERS = re.compile(r"requirements|envs/")
"""Files that hold other people's versions."""


def built(kind: str, source: Path, folder: Path) -> Path:
    """Build a release in an environment of its own; skips the test where there is no package index."""
    command = [sys.executable, "-m", "build", f"--{kind}", "--outdir", str(folder), str(source)]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    if "No matching distribution found" in run.stdout + run.stderr:
        pytest.skip("the Python package index cannot be reached")
    assert run.returncode == 0, run.stdout + run.stderr
    (archive,) = folder.iterdir()
    return archive


@pytest.fixture(scope="module")
def tracked() -> set[str]:
    """Names of the project's own files."""
    if not (ROOT / ".git").exists():
        pytest.skip("this is no checkout")
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True)
    return {name for name in listed.stdout.split("\0") if name and (ROOT / name).is_file()}


@pytest.fixture(scope="module")
def archive(tracked: set[str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The source archive of what is checked in, whatever else lies about."""
    folder = tmp_path_factory.mktemp("checkout")
    for name in tracked:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, folder / name)
    return built("sdist", folder, tmp_path_factory.mktemp("sdist"))


def test_version_stands_in_one_place(tracked: set[str]) -> None:
    literal = re.compile(rf"(?<![\w.]){re.escape(VERSION)}(?![\w.]*\w)".encode())
    told = {name for name in tracked if literal.search((ROOT / name).read_bytes())}
    # the changelog's headings are its history
    assert {name for name in told if not OTHERS.match(name)} == {"pyproject.toml", "CHANGELOG.md"}


def test_installed_package_is_of_this_version() -> None:
    assert version("pbrdf") == VERSION


def test_changelog_begins_with_this_version() -> None:
    headings = re.findall(r"^## (\S+?),", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert headings[0] == VERSION
    assert len(set(headings)) == len(headings)


def test_citation_names_software_and_paper() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert {"cff-version", "message", "title", "authors"} <= citation.keys()
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    (paper,) = citation["references"]
    assert paper["doi"] in readme
    assert all(author["family-names"] in readme for author in paper["authors"])


def test_source_archive_is_the_checkout(archive: Path, tracked: set[str]) -> None:
    with tarfile.open(archive) as tar:
        names = {member.name.partition("/")[2] for member in tar.getmembers() if member.isfile()}
    assert names == tracked | {"PKG-INFO"}


@pytest.mark.release
def test_wheel_of_the_archive_works_where_nothing_else_is(archive: Path, tmp_path: Path) -> None:
    with tarfile.open(archive) as tar:
        tar.extractall(tmp_path / "source", filter="data")
    (source,) = (tmp_path / "source").iterdir()
    wheel = built("wheel", source, tmp_path / "wheel")
    with zipfile.ZipFile(wheel) as packed:
        names = set(packed.namelist())
    packages = [source / "workflow/pbrdf", source / "workflow/snakemake_logger_plugin_timeleft"]
    files = [path for package in packages for path in package.rglob("*") if path.is_file()]
    assert {path.relative_to(source / "workflow").as_posix() for path in files} <= names
    assert all(name.startswith(("pbrdf/", "pbrdf-", "snakemake_logger_plugin_timeleft/")) for name in names)

    venv.create(tmp_path / "clean", with_pip=True)
    python = tmp_path / "clean/bin/python"
    subprocess.run([python, "-m", "pip", "install", "--quiet", wheel], cwd=tmp_path, check=True)
    program = "import pbrdf, sys; pbrdf.open_table; pbrdf.fit; pbrdf.write_capture; print(pbrdf.__file__)"
    run = subprocess.run([python, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert Path(run.stdout.strip()).is_relative_to(tmp_path / "clean")
    command = [tmp_path / "clean/bin/pbrdf", "--version"]
    told = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert told.stdout == f"pbrdf {VERSION}\n"
