from __future__ import annotations

from pathlib import Path

import pytest

from pbrdf.errors import InputError
from pbrdf.report import folder
from pbrdf.report.folder import PANELS, PLOTLY, SCRIPT, assemble_report


def test_the_folder_holds_pages_values_and_scripts_and_nothing_old(tmp_path: Path) -> None:
    (tmp_path / "pages").mkdir()
    for name in ("index.html", "gold.html", "gold.json"):
        (tmp_path / "pages" / name).write_text(name)
    (tmp_path / "pages/gold").mkdir()
    (tmp_path / "pages/gold/slice0_band0.js").write_text("")
    report = tmp_path / "report"
    report.mkdir()
    (report / "gone.html").write_text("of a material that is no more")
    pages = [tmp_path / "pages" / name for name in ("index.html", "gold.html")]
    assemble_report(pages, [tmp_path / "pages/gold.json"], [tmp_path / "pages/gold"], report)
    made = {path.relative_to(report).as_posix() for path in report.rglob("*") if path.is_file()}
    values = {"values/gold.json", "values/gold/slice0_band0.js"}
    assert made == {"index.html", "gold.html", *values, PANELS, PLOTLY, SCRIPT}
    assert (report / "gold.html").read_text() == "gold.html"


def test_plotlys_absence_is_told_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(folder, "find_spec", lambda name: None)
    with pytest.raises(InputError, match="plotly: is not installed"):
        assemble_report([], [], [], tmp_path / "report")
    assert list(tmp_path.iterdir()) == []
