from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pbrdf.errors import InputError
from pbrdf.formats.pbsdf import write_pbsdf
from pbrdf.formats.table_data import Origin, TableData
from pbrdf.models import MODELS
from pbrdf.optics.rusinkiewicz import directions
from pbrdf.report.comparison_page import comparison_page, write_comparison_page
from pbrdf.report.table_comparison import compare_tables


def model_table(theta_h: int, theta_d: int, phi_d: int, source: str = "model") -> TableData:
    """A smooth model on a grid of its own."""
    axes = (
        np.radians(np.linspace(0, 60, theta_h)),
        np.radians(np.linspace(0, 40, theta_d)),
        np.radians(np.linspace(-180, 180, phi_d)),
    )
    grid = np.meshgrid(axes[0], np.maximum(axes[1], 1e-6), axes[2], indexing="ij")
    parameters = {"alpha": 0.6, "eta": 1.5, "specular": 0.5, "albedo": 0.3}
    mueller = MODELS["baek2018"].evaluate(*directions(*grid), parameters)
    bands = np.array([450.0, 500.0, 550.0, 600.0, 650.0])
    return TableData(source, bands, *axes, np.stack([mueller] * 5).astype(np.float32))


def test_a_table_is_like_itself(table: TableData) -> None:
    for band in compare_tables(table, table):
        assert band.nodes > 100
        assert (band.scale, band.m00_percent, band.dolp_rms) == (1.0, 0.0, 0.0)
        assert np.all(np.array(band.elements_rms) == 0.0)


def test_a_scale_is_told_apart_from_other_differences(table: TableData) -> None:
    for band in compare_tables(table, replace(table, mueller=table.mueller * np.float32(1.25))):
        assert band.scale == pytest.approx(1.25, rel=1e-6)
        assert band.m00_percent == pytest.approx(25, rel=1e-5)
        assert band.m00_scaled_percent < 1e-4
        assert np.max(band.elements_rms) < 1e-6


def test_an_element_that_differs_is_named_by_its_place(table: TableData) -> None:
    changed = table.mueller.copy()
    changed[..., 2, 3] += 0.1 * changed[..., 0, 0]
    for band in compare_tables(table, replace(table, mueller=changed)):
        rms = np.array(band.elements_rms)
        assert rms[2, 3] == pytest.approx(0.1, rel=1e-5)
        assert np.count_nonzero(rms > 1e-6) == 1


def test_inpainted_nodes_do_not_count(table: TableData) -> None:
    assert table.origin is not None
    changed = np.where((table.origin == Origin.INPAINTED)[..., None, None], 7.0, table.mueller)
    for band in compare_tables(table, replace(table, mueller=changed.astype(np.float32))):
        assert band.m00_percent == 0.0


def test_grids_may_differ() -> None:
    """Linear interpolation of a smooth lobe between nodes of 3°."""
    for band in compare_tables(model_table(13, 9, 13), model_table(25, 15, 25)):
        assert band.scale == pytest.approx(1.0, abs=0.01)
        assert band.m00_percent < 1.0
        assert np.max(band.elements_rms) < 0.01


def test_bands_in_common_are_compared_and_none_is_refused(table: TableData) -> None:
    shifted = replace(table, wavelengths_nm=np.array([550.0, 700.0]))
    assert [band.wavelength_nm for band in compare_tables(table, shifted)] == [550.0]
    with pytest.raises(InputError, match="wavelength: has no band"):
        compare_tables(table, replace(table, wavelengths_nm=np.array([700.0, 750.0])))


def test_nothing_known_in_common_is_refused(table: TableData) -> None:
    with pytest.raises(InputError, match="nowhere known"):
        compare_tables(table, replace(table, mueller=np.full_like(table.mueller, np.nan)))


def test_page_and_document_say_the_same(tmp_path: Path) -> None:
    first = model_table(7, 6, 9)
    write_pbsdf(tmp_path / "a.pbsdf", first)
    write_pbsdf(tmp_path / "b.pbsdf", replace(first, mueller=first.mueller * np.float32(0.8)))
    page, document = tmp_path / "page.html", tmp_path / "page.json"
    names = {"<script>ours": tmp_path / "a.pbsdf", "theirs": tmp_path / "b.pbsdf"}
    write_comparison_page(names, page, document)
    html = page.read_text(encoding="utf-8")
    assert "<script>" not in html
    assert "M00 of theirs is 0.8 times that of &lt;script&gt;ours (median)" in html
    shown = set(re.findall(r'<data value="([^"]*)">', html))
    for band in json.loads(document.read_text(encoding="utf-8"))["bands"]:
        assert {str(band["scale"]), str(band["nodes"]), str(band["m00_percent"])} <= shown
        assert {str(v) for row in band["elements_rms"] for v in row} <= shown
    again = tmp_path / "again.html"
    write_comparison_page(names, again, document)
    assert again.read_bytes() == page.read_bytes()


def test_the_difference_is_drawn(table: TableData) -> None:
    other = replace(table, mueller=table.mueller * np.float32(2.0))
    html = comparison_page(("a", "b"), table, other, compare_tables(table, other), {})
    assert re.findall(r'alt="([^,"]*), sixteen panels', html)[:3] == ["a", "b", "b − a"]
    assert re.search(r"b − a, sixteen panels [^.]*\. M00: median 100 %", html)
