from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pbrdf.cli import COMMANDS, main
from pbrdf.fitting import read_fit
from pbrdf.formats.pbsdf import write_pbsdf
from pbrdf.formats.table_data import TableData
from pbrdf.models import MODELS
from pbrdf.models.table import open_table
from pbrdf.optics.rusinkiewicz import directions

TRUTH = {"alpha": 0.25, "eta": 1.6, "specular": 0.7, "albedo": 0.4}
AXES = {
    "theta_h_deg": (90 * np.linspace(0, 1, 9) ** 2).tolist(),
    "theta_d_deg": np.linspace(0, 90, 10).tolist(),
    "phi_d_deg": np.linspace(-180, 180, 13).tolist(),
}


@pytest.fixture(scope="module")
def small_table() -> TableData:
    """A model on a coarse grid, five bands."""
    axes = [np.radians(AXES[name]) for name in ("theta_h_deg", "theta_d_deg", "phi_d_deg")]
    theta_h, theta_d, phi_d = np.meshgrid(*axes, indexing="ij")
    mueller = MODELS["baek2018"].evaluate(*directions(theta_h, theta_d, phi_d), TRUTH)
    bands = np.array([450.0, 500.0, 550.0, 600.0, 650.0])
    return TableData("truth", bands, *axes, np.stack([mueller] * 5).astype(np.float32))


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, small_table: TableData) -> Path:
    """The working folder: nothing in it but a table."""
    monkeypatch.chdir(tmp_path)
    write_pbsdf("plastic.pbsdf", small_table)
    return tmp_path


def _names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def _refused(capsys: pytest.CaptureFixture[str], *argv: str) -> str:
    """Run arguments that must fail, and return the one line that says why."""
    assert main(argv) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("pbrdf: ")
    assert captured.err.count("\n") == 1
    return captured.err


def test_fit_needs_nothing_but_the_table(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fit", "plastic.pbsdf", "--starts", "1"]) == 0
    assert capsys.readouterr().out.split() == ["plastic.fit.json", "plastic.html"]
    assert _names(folder) == {"plastic.pbsdf", "plastic.fit.json", "plastic.html"}
    fitted = read_fit("plastic.fit.json")
    assert fitted.options.downsample == 1
    for name, value in TRUTH.items():
        assert fitted.band(2)[name] == pytest.approx(value, rel=1e-3)
    assert "Baek 2018 fits M00" in Path("plastic.html").read_text(encoding="utf-8")


def test_fit_writes_where_it_is_told_and_the_same_bytes_again(folder: Path) -> None:
    for out in ("one", "two"):
        assert main(["fit", "plastic.pbsdf", "--starts", "1", "--downsample", "2", "--out", out]) == 0
    for name in ("plastic.fit.json", "plastic.html"):
        assert Path("one", name).read_bytes() == Path("two", name).read_bytes()
    assert _names(folder) == {"plastic.pbsdf", "one", "two"}


@pytest.mark.parametrize(
    ("argv", "named"),
    [
        (["fit", "gold.pbsdf"], "gold.pbsdf: file:"),
        (["fit", "plastic.pbsdf", "--model", "phong"], "model"),
        (["fit", "plastic.pbsdf", "--downsample", "0"], "downsample"),
        (["fit", "plastic.pbsdf", "--starts", "0"], "starts"),
        (["fit", "plastic.pbsdf", "--cost", "means"], "cost"),
        (["fit", "plastic.pbsdf", "--cost", "squares"], "plastic.pbsdf: variance: is not in the table"),
        (["fit", "plastic.pbsdf", "--axes", "axes.yaml"], "axes.yaml: file:"),
        (["fit", "plastic.pbsdf", "--out", "plastic.pbsdf"], "plastic.pbsdf"),
        (["info", "gold.json"], "gold.json: file:"),
        (["convert", "plastic.pbsdf", "plastic.mat"], "cannot be written"),
        (["convert", "plastic.pbsdf", "./plastic.pbsdf"], "is the input itself"),
        (["convert", "gold.pbsdf", "gold.zarr"], "gold.pbsdf: file:"),
    ],
)
def test_errors_are_one_line_and_leave_nothing(
    folder: Path, capsys: pytest.CaptureFixture[str], argv: list[str], named: str
) -> None:
    before = Path("plastic.pbsdf").read_bytes()
    assert named in _refused(capsys, *argv)
    assert _names(folder) == {"plastic.pbsdf"}
    assert Path("plastic.pbsdf").read_bytes() == before


def test_a_table_cut_short_is_refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole = Path("plastic.pbsdf").read_bytes()
    Path("cut.pbsdf").write_bytes(whole[:-100])
    assert "cut.pbsdf" in _refused(capsys, "fit", "cut.pbsdf")
    assert _names(folder) == {"plastic.pbsdf", "cut.pbsdf"}


def test_a_failing_disk_leaves_no_half_of_the_pair(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    # the page's name is taken by a folder, so that it cannot be written
    Path("out/plastic.html").mkdir(parents=True)
    assert "plastic.html" in _refused(capsys, "fit", "plastic.pbsdf", "--starts", "1", "--out", "out")
    assert _names(folder / "out") == {"plastic.html"}


def test_info_tells_what_a_table_is(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", "plastic.pbsdf"]) == 0
    lines = dict(line.split("  ", 1) for line in capsys.readouterr().out.splitlines())
    assert lines["kind"].strip() == "pBRDF table"
    assert lines["shape"].strip() == "5 bands × 9 θh × 10 θd × 13 φd × 4 × 4"
    assert lines["wavelengths"].strip() == "450, 500, 550, 600, 650 nm"
    assert any("1/sr" in value for value in lines.values())


def test_info_tells_what_a_document_is(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("a.json").write_text(json.dumps({"schema": "pbrdf/fit/1", "cost": {"unit": "1/sr", "total": 2.5}}))
    assert main(["info", "a.json"]) == 0
    assert capsys.readouterr().out == "schema      pbrdf/fit/1\ncost.unit   1/sr\ncost.total  2.5\n"


def test_info_refuses_a_document_of_others(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("a.json").write_text("{}")
    assert "a.json: schema:" in _refused(capsys, "info", "a.json")


def test_convert_there_and_back_is_the_same_file(folder: Path) -> None:
    assert main(["convert", "plastic.pbsdf", "made/plastic.zarr"]) == 0
    assert main(["convert", "made/plastic.zarr", "back.pbsdf"]) == 0
    assert Path("back.pbsdf").read_bytes() == Path("plastic.pbsdf").read_bytes()
    assert open_table("made/plastic.zarr").data.mueller.shape == (5, 9, 10, 13, 4, 4)


def test_axes_from_a_file_must_agree_with_the_table(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("axes.yaml").write_text(json.dumps(AXES))
    assert main(["info", "plastic.pbsdf", "--axes", "axes.yaml"]) == 0
    capsys.readouterr()
    Path("axes.yaml").write_text(json.dumps({"theta_d_deg": np.linspace(0, 80, 10).tolist()}))
    assert "theta_d" in _refused(capsys, "info", "plastic.pbsdf", "--axes", "axes.yaml")


@pytest.mark.parametrize("command", [command.name for command in COMMANDS])
def test_help_has_examples(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main([command, "--help"])
    assert ended.value.code == 0
    assert f"examples:\n  pbrdf {command}" in capsys.readouterr().out


def test_compare_prints_a_line_a_band_and_writes_a_page_where_told(
    small_table: TableData, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_pbsdf(tmp_path / "ours.pbsdf", small_table)
    write_pbsdf(tmp_path / "theirs.pbsdf", replace(small_table, mueller=small_table.mueller * np.float32(2)))
    paths = [str(tmp_path / name) for name in ("ours.pbsdf", "theirs.pbsdf")]
    assert main(["compare", *paths]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 5
    assert "M00 of theirs is 2 times that of ours" in lines[0]
    assert main(["compare", *paths, "--out", str(tmp_path / "out")]) == 0
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [
        "ours_and_theirs.html",
        "ours_and_theirs.json",
    ]
