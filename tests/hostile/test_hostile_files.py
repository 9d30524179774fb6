"""Files that mean harm are read or refused in a line: no crash, no hang, no memory, nothing outside."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from attacked import Attacked
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mutations import hostile
from readers import READERS

EXAMPLES = 25
"""`make fuzz` tries more."""


@pytest.fixture(scope="module")
def attacked() -> Iterator[Attacked]:
    with Attacked() as server:
        yield server


@pytest.mark.parametrize("name", READERS)
def test_a_valid_file_is_read(attacked: Attacked, name: str, tmp_path: Path) -> None:
    READERS[name].write(tmp_path / READERS[name].name)
    assert attacked.outcome(name, tmp_path / READERS[name].name) == "read"


@pytest.mark.parametrize("name", READERS)
def test_a_hostile_file_is_read_or_refused(attacked: Attacked, name: str, tmp_path: Path) -> None:
    reader = READERS[name]
    whole = tmp_path / "valid" / reader.name
    whole.parent.mkdir()
    reader.write(whole)
    files = sorted(path for path in whole.rglob("*") if path.is_file()) if whole.is_dir() else [whole]
    place = tmp_path / "hostile"
    place.mkdir()
    path = place / reader.name

    @settings(
        max_examples=EXAMPLES,
        deadline=None,
        database=None,
        derandomize=True,
        suppress_health_check=list(HealthCheck),
    )
    @given(st.data())
    def attack(data: st.DataObject) -> None:
        file = data.draw(st.sampled_from(files))
        content = data.draw(hostile(file.name, file.read_bytes()))
        if whole.is_dir():
            shutil.rmtree(path, ignore_errors=True)
            shutil.copytree(whole, path)
        (path / file.relative_to(whole) if whole.is_dir() else path).write_bytes(content)
        outcome = attacked.outcome(name, path)
        assert outcome == "read" or outcome.startswith("refused: "), outcome

    attack()
