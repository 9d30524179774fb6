"""Fixtures for every test.

They stand here, at the root of the tests, because several folders need them: where other people's
measurements lie, how one shows that a result does not depend on the number of threads, and what runs in
one process.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
SMALL_RUNS = {"finished", "measured"}
"""Fixtures of the workflow's tests that are runs of their own."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keep together, for several processes, tests that share something costly; the longest first."""
    if not config.getoption("loadgroup", False):
        return
    for item in items:
        item.add_marker(pytest.mark.xdist_group(group_of(item)))
    items.sort(key=lambda item: (SMALL_RUNS.isdisjoint(fixtures_of(item)), not is_long(item)))


def pytest_collection_finish(session: pytest.Session) -> None:
    """Refuse a pytest under which pytest-xdist groups nothing, as it does under 9.2 without a word."""
    grouped = session.config.getoption("loadgroup", False)
    if grouped and any("@" not in item.nodeid for item in session.items):
        raise pytest.UsageError("tests are not kept together by their groups: pip install 'pytest<9.2'")


def is_long(item: pytest.Item) -> bool:
    """Whether a test runs the workflow or builds what is released."""
    return any(item.get_closest_marker(name) for name in ("workflow", "release"))


def fixtures_of(item: pytest.Item) -> list[str]:
    """Names of all fixtures that a test needs, those included that a parameter names."""
    named = getattr(item, "callspec", None)
    parameters = [] if named is None else named.params.values()
    return [*getattr(item, "fixturenames", []), *(one for one in parameters if isinstance(one, str))]


def group_of(item: pytest.Item) -> str:
    """What a test shares with others: a run, instruments of one address, or its folder."""
    shared = SMALL_RUNS.intersection(fixtures_of(item))
    if shared:
        return min(shared)
    place = item.path.relative_to(ROOT / "tests")
    if "instruments" in place.parts:
        return "instruments"
    return str(place) if item.get_closest_marker("workflow") else place.parts[0]


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
