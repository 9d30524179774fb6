"""A measured white standard, of the published dataset: what fits make of a surface that no model made."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pbrdf
from pbrdf.fitting import FitResult
from pbrdf.fitting.comparison import compare
from pbrdf.models import MODELS
from pbrdf.models.table import Table, open_table

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def table(real_data: Path) -> Table:
    file = real_data / "spectralon/spectralon_lowres.pbsdf"
    return open_table(file, ROOT / "config/real/spectralon_axes.yaml")


@pytest.fixture(scope="module")
def fitted(table: Table) -> FitResult:
    return pbrdf.fit(table, downsample=1, held_out=True)


def test_it_is_white_up_to_the_scale_of_the_data(table: Table, fitted: FitResult) -> None:
    """Spectralon reflects 0.99; the data set's unknown scale makes half of it."""
    albedo = np.array([fitted.band(band)["albedo"] for band in range(5)])
    assert np.std(albedo) / np.mean(albedo) < 0.02
    (at_30,) = (
        each
        for each in compare("spectralon", table.data, [fitted]).albedo
        if (each.wavelength_nm, each.theta_i_deg) == (550, 30)
    )
    assert at_30.measured.known > 0.99
    assert at_30.models["baek2018"] == pytest.approx(at_30.measured.value, rel=0.1)


def test_hardly_anything_is_reflected_at_its_surface(fitted: FitResult) -> None:
    light = np.array([[0.0, 0.0, 1.0]])
    tilted = np.array([[np.sin(0.7), 0.0, np.cos(0.7)]])
    for band in range(5):
        parameters = fitted.band(band)
        whole = MODELS["baek2018"].evaluate(light, tilted, parameters)[0, 0, 0]
        surface = MODELS["baek2018"].evaluate(light, tilted, parameters | {"albedo": 0.0})[0, 0, 0]
        assert surface < 0.05 * whole


def test_its_roughness_is_that_of_a_wide_gloss_where_directions_count_alike(table: Table) -> None:
    """Nodes lie dense at small θh and norms are large at grazing angles: both speak for a narrow gloss."""
    wide = pbrdf.fit(table, downsample=1, solid_angle=True).band(2)["alpha"]
    assert wide > 0.25
    assert wide > 2 * pbrdf.fit(table, downsample=1).band(2)["alpha"]


def test_its_residual_is_told(fitted: FitResult) -> None:
    """The release's frames turn with θd and its errors are about a tenth: no model can do much better."""
    relative = np.array(fitted.residuals.relative)
    assert relative[:, 0, 0].max() < 0.25
    # off-block elements are those of a turned frame; no surface of facets has them
    assert relative[2, 2, 0] == relative[2].max() == pytest.approx(0.375, abs=0.01)
    assert fitted.held_out is not None
    assert fitted.held_out.theta_d_deg == pytest.approx((66.0,))
    assert fitted.undetermined == fitted.bounds_met == ()
