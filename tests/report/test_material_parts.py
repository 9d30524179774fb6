"""Parts of a material's page: curves with errors, physicality, capture health, what fits say."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pbrdf.fitting import FitResult
from pbrdf.formats.receipt import write_receipt
from pbrdf.formats.table_data import TableData
from pbrdf.report.capture_health import health_view, lights_health
from pbrdf.report.pages import material_page
from pbrdf.report.physical_map import physicality_view
from pbrdf.report.table_view import curves, curves_of


@pytest.fixture(scope="module")
def certain(table: TableData) -> TableData:
    """The table with a standard error of 2 % of M00 in every element."""
    variance = np.square(0.02 * table.mueller[..., :1, :1]) * np.ones((4, 4), np.float32)
    return replace(table, variance=variance.astype(np.float32))


def write_image_receipt(path: Path, **changes: Any) -> Path:
    summary = {
        "residual_rms": 2.0,
        "predicted_residual_rms": 2.0,
        "missing": {"saturated": 0.0, "hot": 0.001},
        "drift": [0.999, 1.001],
        "physical_share": 0.5,
    }
    path.parent.mkdir(exist_ok=True)
    write_receipt(path, outputs=[], inputs={}, settings={}, summary={"550nm": summary | changes})
    return path


def test_curves_show_bars_every_model_and_what_it_leaves(certain: TableData, fitted: FitResult) -> None:
    (first, *_) = curves_of(certain, 1, {})
    assert first.variance is not None
    np.testing.assert_allclose(
        np.sqrt(first.variance[..., 0, 0]), 0.02 * first.measured[..., 0, 0], rtol=1e-5, equal_nan=True
    )
    two = [fitted, replace(fitted, model="baek2018")]
    drawn = curves(certain, two[:1], 1)
    assert re.search(r"Baek 2018 is off by [\d.]+ % there", drawn.alt)
    without = curves(replace(certain, variance=None), [], 1)
    assert without.height < drawn.height
    assert len(without.svg) < len(drawn.svg)


def test_the_page_says_whether_its_bars_are_standard_errors(certain: TableData, table: TableData) -> None:
    pages = [material_page("a", t, [], calibration_sources={}, provenance={}) for t in (certain, table)]
    assert ["one standard error" in page for page in pages] == [True, False]
    assert ["holds no variance" in page for page in pages] == [False, True]


def test_a_model_is_physical_and_what_no_light_does_is_not(certain: TableData) -> None:
    band = physicality_view(certain, 1)["bands"][1]
    assert band["physical_percent"] == 100.0
    assert band["certain_percent"] == 0.0
    mueller = certain.mueller.copy()
    # more polarised than bright
    mueller[1, ..., 1, 0] = 1.5 * mueller[1, ..., 0, 0]
    worse = physicality_view(replace(certain, mueller=mueller), 1)["bands"]
    assert worse[0]["physical_percent"] == 100.0
    assert worse[1]["physical_percent"] == 0.0
    assert worse[1]["certain_percent"] == 100.0


def test_health_names_the_lights_to_look_at(tmp_path: Path) -> None:
    receipts = [
        write_image_receipt(tmp_path / "030.00.json"),
        write_image_receipt(tmp_path / "041.00.json", residual_rms=3.0, missing={"saturated": 0.05}),
        write_image_receipt(tmp_path / "060.00.json", drift=[0.96, 1.01]),
    ]
    view = health_view(lights_health(receipts))
    assert view is not None
    assert "1.5 at worst" in view["words"]
    assert "residuals (above 1.2 times the prediction) of 041.00" in view["words"]
    assert "saturation (above 1 %) of 041.00" in view["words"]
    assert "drift (above 2 %) of 060.00" in view["words"]
    assert [row["light"] for row in view["rows"]] == ["030.00", "041.00", "060.00"]
    assert view["rows"][2]["drift_percent"] == pytest.approx(4.0)


def test_a_good_capture_is_called_so_and_none_is_left_out(tmp_path: Path) -> None:
    view = health_view(lights_health([write_image_receipt(tmp_path / "030.00.json")]))
    assert view is not None
    assert "No light stands out" in view["words"]
    assert health_view([]) is None


def test_photographs_without_a_prediction_say_so(tmp_path: Path) -> None:
    receipt = write_image_receipt(tmp_path / "030.00.json", predicted_residual_rms=None)
    view = health_view(lights_health([receipt]))
    assert view is not None
    assert view["words"].startswith("Nothing predicts the residuals")
    assert "not known" not in view["words"]
