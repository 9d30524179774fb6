from __future__ import annotations

from pathlib import Path

import pytest

from pbrdf.capture.journal import Journal
from pbrdf.capture.retake import archive_light
from pbrdf.capture.status import capture_status
from pbrdf.errors import InputError


def begin(folder: Path, light: str) -> Path:
    here = folder / "lights" / light
    here.mkdir(parents=True)
    (here / "journal.jsonl").write_text("", encoding="utf-8")
    return here


def test_a_retaken_light_is_kept_under_the_next_free_name(tmp_path: Path) -> None:
    for number in (1, 2):
        begin(tmp_path, "041.00")
        assert archive_light(tmp_path, "041.00") == tmp_path / f"lights/041.00.r{number}"
    assert sorted(path.name for path in (tmp_path / "lights").iterdir()) == ["041.00.r1", "041.00.r2"]
    assert Journal(tmp_path / "lights/041.00.r2/journal.jsonl").entries() == []


@pytest.mark.parametrize(("taken", "told"), [([], "none was taken yet"), (["008.00"], "there: 008.00")])
def test_a_light_that_was_never_taken_cannot_be_taken_anew(
    tmp_path: Path, taken: list[str], told: str
) -> None:
    for light in taken:
        begin(tmp_path, light)
    with pytest.raises(InputError, match=told):
        archive_light(tmp_path, "041.00")


def test_a_folder_without_photographs_has_no_status(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there are none"):
        list(capture_status(tmp_path))
