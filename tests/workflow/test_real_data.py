"""Other people's measurements through the same rules, held against their answers."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from browser import Browser
from small_workflow import ROOT, snakemake

import pbrdf
from pbrdf.fitting import read_fit
from pbrdf.formats.mueller_exr import read_mueller_exr

pytestmark = pytest.mark.workflow


@pytest.fixture(scope="module")
def real(real_data: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which config/real.yaml has run."""
    folder = tmp_path_factory.mktemp("real")
    config = ("--configfile", str(ROOT / "config/real.yaml"), "--config", f"data={real_data.resolve()}")
    run = snakemake(folder, *config)
    assert run.returncode == 0, run.stderr
    second = snakemake(folder, *config)
    assert "Nothing to be done" in second.stderr
    return folder


def test_metal_objects_come_out_as_their_authors_say(real: Path) -> None:
    folder = real / "results/metal_objects/mueller"
    summary = json.loads((folder / "000.00.json").read_text(encoding="utf-8"))["summary"]["630nm"]
    assert summary["residual_rms"] == pytest.approx(0.378, abs=5e-4)
    assert summary["condition"] == pytest.approx(34.38, abs=5e-3)
    image = read_mueller_exr(folder / "000.00/630nm.exr")
    mueller = image.mueller
    assert mueller.shape == (16, 480, 640)
    assert image.first == (0, 0)
    assert image.header["units"] == "DN/s"
    diagonal = np.median(mueller[[0, 5, 10, 15]] / mueller[0], axis=(1, 2))
    np.testing.assert_allclose(diagonal, [1, 0.150, -0.130, -0.057], atol=0.002)
    assert np.all(image.variance > 0)
    assert not image.missing.any()


def test_spectralon_becomes_table_fit_and_page(real: Path) -> None:
    table = pbrdf.open_table(real / "results/spectralon/table.zarr")
    assert table.data.mueller.shape == (5, 9, 9, 22, 4, 4)
    # light and camera both 1e-6 rad from the normal: M00 in retro-reflection at 550 nm
    retro = table.data.mueller[2, 0, 0, :, 0, 0]
    assert np.mean(retro) == pytest.approx(0.218, abs=5e-4)
    fit = read_fit(real / "results/spectralon/fit/baek2018.json")
    assert fit.model == "baek2018"
    albedo = [fit.band(band)["albedo"] for band in range(5)]
    assert all(0.4 < value < 1 for value in albedo)
    page = (real / "results/report/spectralon.html").read_text(encoding="utf-8")
    assert "Baek 2018" in page
    for missing in (
        "9×9×22",
        "holds no variance",
        "measured and filled look alike",
        "the data came as a file",
    ):
        assert missing in page


def test_pages_of_real_data_open_and_say_what_is_missing(real: Path, browser: Browser) -> None:
    page = browser.new_page()
    report = real / "results/report"
    page.open((report / "index.html").as_uri())
    links = page.evaluate("[...document.querySelectorAll('#materials a')].map(a => a.getAttribute('href'))")
    assert sorted(links) == ["metal_objects.html", "spectralon.html"]
    for link in links:
        page.open((report / link).as_uri())
        assert page.messages == []
    page.open((report / "spectralon.html").as_uri())
    notices = page.evaluate("[...document.querySelectorAll('.notice')].map(n => n.textContent).join(' ')")
    assert "M00 is zero or below" in notices
    page.open((report / "metal_objects.html").as_uri())
    words = page.evaluate("document.body.innerText")
    assert "object without known geometry: no table, no fit" in words
    assert "polarimeter file" in words


def test_spectralon_exports_what_came_in(real: Path) -> None:
    came = pbrdf.open_table(real / "results/spectralon/table.zarr").data
    out = pbrdf.open_table(real / "results/spectralon/spectralon.pbsdf").data
    np.testing.assert_array_equal(out.mueller, came.mueller)
    np.testing.assert_allclose(out.theta_h, came.theta_h, rtol=1e-7)
