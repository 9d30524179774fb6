"""What a material's page says of symmetries."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.formats.table_data import TableData
from pbrdf.report.consistency_view import consistency_view
from pbrdf.report.pages import material_page
from pbrdf.tabulation.axes import table_axes
from pbrdf.tabulation.consistency import Disagreements, none_compared, read_consistency, write_consistency


def write(folder: Path, sums: NDArray[np.float64], *, pooled: bool) -> None:
    angles = [np.radians(np.linspace(0, 90, count)) for count in sums.shape[:2]]
    found = Disagreements(*angles)
    found.add(550.0, sums)
    write_consistency(folder / "c.json", found, pooled=pooled)


def told(folder: Path, *, errors: bool = True) -> dict[str, Any]:
    """Three pairs a node whose elements differ by a hundredth of M00 and 1.5 standard errors, at one by 3."""
    sums = none_compared(3, 4)
    mirror = sums[1:, :, 0]
    mirror[..., 0], mirror[..., 1] = 3, 6.0
    mirror[..., 2:18] = 0.03
    mirror[..., 7] = 0.06
    if errors:
        mirror[..., 18:34], mirror[..., 34:] = 3, 3 * 1.5**2
        mirror[1, 2, 34:] *= 4
    write(folder, sums, pooled=True)
    return read_consistency(folder / "c.json")


def test_rows_tell_disagreement_of_what_was_compared(tmp_path: Path) -> None:
    view = consistency_view(told(tmp_path))
    assert view is not None and view["pooled"]
    (row,) = view["rows"]
    assert row["name"].startswith("mirror") and row["band"] == "550 nm"
    assert row["pairs"] == 24
    assert row["m00_percent"] == pytest.approx(1.0)
    assert row["other_percent"] == pytest.approx(2.0)
    assert row["standard_errors"] == pytest.approx(1.5 * np.sqrt(11 / 8), rel=1e-3)
    assert "Mirror image, −φd: at most 2.37 standard errors, at θd = 60°" in view["picture"].alt
    assert "exchanged" not in view["picture"].alt


def test_the_map_tells_where_the_disagreement_is(tmp_path: Path) -> None:
    view = consistency_view(told(tmp_path))
    assert view is not None
    assert "median 1.5, at most 3 standard errors, at θh = 90°, θd = 60°" in view["map"].alt
    assert "exchanged" not in view["map"].alt


def test_without_variances_there_are_no_standard_errors(tmp_path: Path) -> None:
    view = consistency_view(told(tmp_path, errors=False))
    assert view is not None
    assert view["rows"][0]["standard_errors"] is None
    assert "Mirror image, −φd: at most 1 % of M00" in view["picture"].alt
    assert "median 1, at most 1 % of M00" in view["map"].alt


def test_nothing_compared_is_nothing_shown(tmp_path: Path) -> None:
    write(tmp_path, none_compared(3, 4), pooled=False)
    assert consistency_view(read_consistency(tmp_path / "c.json")) is None


def test_page_shows_both(tmp_path: Path) -> None:
    axes = table_axes(4, 4, 9)
    mueller = np.broadcast_to(np.diag([0.3, 0.2, -0.2, -0.1]).astype(np.float32), (2, *axes.shape, 4, 4))
    table = TableData("t", np.array([500.0, 550.0]), axes.theta_h, axes.theta_d, axes.phi_d, mueller.copy())
    html = material_page("jade", table, [], calibration_sources={}, provenance={}, consistency=told(tmp_path))
    assert 'id="consistency"' in html and "weighted means" in html
    assert "nothing is written for Mitsuba" in html
    assert 'id="consistency"' not in material_page("jade", table, [], calibration_sources={}, provenance={})
