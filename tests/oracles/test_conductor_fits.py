"""A rough conductor of Mitsuba's, as a table: what fits with a complex and with a real index make of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pbrdf
from pbrdf.formats.table_data import TableData
from pbrdf.models.mitsuba_bsdf import MitsubaBsdf
from pbrdf.optics.rusinkiewicz import cosines, directions
from pbrdf.tabulation.axes import table_axes

pytest.importorskip("mitsuba", reason="Mitsuba is not installed: pip install 'pbrdf[mitsuba]'")

GOLD = {450: (1.498, 1.880), 550: (0.347, 2.696), 650: (0.142, 3.595)}
"""Johnson and Christy 1972: n and k by nm."""
ALPHA = 0.2


def conductor(eta: float, kappa: float) -> dict[str, Any]:
    return {
        "type": "roughconductor",
        "distribution": "ggx",
        "alpha": ALPHA,
        "eta": {"type": "uniform", "value": eta},
        "k": {"type": "uniform", "value": kappa},
    }


@pytest.fixture(scope="module")
def table() -> TableData:
    axes = table_axes(12, 13, 25)
    grid = np.meshgrid(axes.theta_h, axes.theta_d, axes.phi_d, indexing="ij")
    visible = (np.minimum(*cosines(*grid)) > 1e-3) & (grid[1] > 0)
    light, camera = directions(*(angle[visible] for angle in grid))
    mueller = np.full((len(GOLD), *visible.shape, 4, 4), np.nan, np.float32)
    for band, (nm, index) in enumerate(GOLD.items()):
        mueller[band, visible] = MitsubaBsdf(conductor(*index), "test", "gold").evaluate(light, camera, nm)
    return TableData("mitsuba", np.array(list(GOLD), float), axes.theta_h, axes.theta_d, axes.phi_d, mueller)


def test_a_complex_index_is_found_within_two_percent(table: TableData) -> None:
    result = pbrdf.fit(table, "baek2018_complex", downsample=1)
    for band, (eta, kappa) in enumerate(GOLD.values()):
        found = result.band(band)
        assert found["alpha"] == pytest.approx(ALPHA, rel=1e-3)
        assert found["eta"] == pytest.approx(eta, rel=0.02)
        assert found["kappa"] == pytest.approx(kappa, rel=0.02)
        assert found["specular"] == pytest.approx(1.0, rel=0.02)
    assert np.max(result.residuals.relative) < 0.001
    assert not any("real index" in remark for remark in result.remarks)


@pytest.mark.parametrize("model", ["baek2018", "hyde2009", "hyde2009_dhr"])
def test_a_real_index_cannot_follow_and_says_so(table: TableData, model: str) -> None:
    result = pbrdf.fit(table, model, downsample=1)
    (remark,) = (remark for remark in result.remarks if "metal" in remark)
    assert remark.startswith("The table retards like a metal at 450 nm, 550 nm, 650 nm")
    assert remark.endswith(f"fit the form with a complex index, {model}_complex")
    for residual in np.array(result.residuals.relative):
        # all of the table's M23 and M32 is left over: no other element but those beside them is as far off
        assert residual[2, 3] > 0.2
        assert residual[3, 2] == pytest.approx(residual[2, 3], rel=0.01)


def test_gaussian_facets_with_a_complex_index_find_the_metal_of_ggx_facets_roughly(table: TableData) -> None:
    """Another distribution of slopes, the same reflection at each: the index is still nearly right."""
    result = pbrdf.fit(table, "hyde2009_complex", downsample=1)
    for band, (_, kappa) in enumerate(GOLD.values()):
        assert result.band(band)["kappa"] == pytest.approx(kappa, rel=0.1)
