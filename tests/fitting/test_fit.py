"""Fits of tables whose truth is known, and refusals of tables that cannot be fitted."""

import dataclasses
import json
import os
import subprocess
import sys

import numpy as np
import pytest
from made_tables import TRUTH, largest_error, made_table, truth_of

import pbrdf
from pbrdf.errors import InputError
from pbrdf.fitting import read_fit
from pbrdf.models import MODELS, CostKind
from pbrdf.models.table import Table


@pytest.fixture(scope="module")
def clean():
    return pbrdf.fit(Table(made_table()), downsample=1)


def test_a_clean_table_gives_its_parameters_back(clean):
    assert largest_error(clean) < 1e-4
    assert clean.bounds_met == clean.undetermined == ()
    assert clean.residuals.cost_per_node < 1e-6
    assert np.max(clean.residuals.relative) < 1e-5


@pytest.mark.parametrize("model", MODELS)
def test_every_model_gives_the_parameters_of_its_own_table_back(model):
    truth = truth_of(model)
    result = pbrdf.fit(made_table(truth, model), model, downsample=1)
    assert largest_error(result, truth) < 1e-4
    assert result.bounds_met == result.undetermined == ()


@pytest.mark.parametrize("cost", CostKind)
def test_every_cost_finds_the_parameters_of_a_clean_table(cost):
    table = made_table()
    known = dataclasses.replace(table, variance=np.full(table.mueller.shape, 1e-4, np.float32))
    result = pbrdf.fit(known, downsample=1, cost=cost)
    assert largest_error(result) < 1e-4
    assert result.options.cost is cost


@pytest.mark.parametrize("cost", CostKind)
def test_every_cost_bears_noise_and_is_told_in_its_unit(cost, tmp_path):
    result = pbrdf.fit(made_table(noise=0.05), downsample=1, cost=cost)
    assert largest_error(result) < 0.01
    result.write(tmp_path / "fit.json")
    unit = json.loads((tmp_path / "fit.json").read_text())["cost"]["unit"]
    assert unit == {"norms": "1/sr", "roots": "1/√sr", "squares": "1"}[cost]
    if cost == "squares":
        # sixteen elements a node, each as far off as its variance says
        assert result.residuals.cost_per_node == pytest.approx(16, rel=0.02)


@pytest.mark.parametrize("alpha", [0.015, 0.06, 0.8])
@pytest.mark.parametrize("eta", [1.1, 2.8])
def test_smooth_and_rough_surfaces_of_low_and_high_index(alpha, eta):
    truth = [{"alpha": alpha, "eta": eta, "specular": 0.7, "albedo": 0.4}]
    assert largest_error(pbrdf.fit(made_table(truth), downsample=1), truth) < 1e-4


def test_noise_of_a_tenth_moves_the_parameters_by_a_percent_at_most():
    result = pbrdf.fit(made_table(noise=0.1), downsample=1)
    assert largest_error(result) < 0.01
    # sixteen elements of independent noise: a norm of 0.1 √16 of the median M00
    assert result.residuals.cost_per_node == pytest.approx(
        0.4 * np.nanmedian(made_table().mueller[..., 0, 0]), rel=0.05
    )


def test_outliers_do_not_pull_a_sum_of_norms():
    table = made_table(noise=0.02)
    random = np.random.default_rng(4)
    table.mueller[random.random(table.mueller.shape[:4]) < 0.05] *= 5.0
    assert largest_error(pbrdf.fit(table, downsample=1)) < 0.01


def test_a_dim_band_is_fitted_as_well_as_its_neighbours():
    dim = [TRUTH[0], {**TRUTH[1], "specular": 0.9e-4, "albedo": 0.6e-4}, TRUTH[2]]
    result = pbrdf.fit(made_table(dim), downsample=1)
    values = result.band(1)
    assert values["eta"] == pytest.approx(1.5, abs=1e-4)
    assert values["specular"] == pytest.approx(0.9e-4, rel=1e-4)
    assert values["albedo"] == pytest.approx(0.6e-4, rel=1e-4)


def test_an_albedo_beyond_one_stops_at_its_bound_and_says_so():
    result = pbrdf.fit(made_table(scale=[1.0, 3.0, 1.0]), downsample=1)
    assert result.band(1)["albedo"] == 1.0
    assert "albedo at 500 nm ended on its upper bound 1" in result.bounds_met


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_the_roughness_of_a_matt_surface_is_called_undetermined(noise):
    matt = [{**parameters, "specular": 0.0} for parameters in TRUTH]
    result = pbrdf.fit(made_table(matt, noise=noise), downsample=1)
    assert "specular at 500 nm ended on its lower bound 0" in result.bounds_met
    assert [sentence.split()[0] for sentence in result.undetermined] == ["alpha"]


def test_same_seed_same_bytes_whatever_the_threads(tmp_path):
    table = made_table(noise=0.1)
    np.save(tmp_path / "mueller.npy", table.mueller)
    program = """
import sys, numpy as np, pbrdf
from pbrdf.formats.table_data import TableData
mueller = np.load(sys.argv[1])
b, h, d, p = mueller.shape[:4]
table = TableData("made", np.arange(b) + 450.0, (np.arange(h) / (h - 1)) ** 2 * np.pi / 2,
                  np.linspace(0, np.pi / 2, d), np.linspace(-np.pi, np.pi, p), mueller)
pbrdf.fit(table, downsample=1, seed=7).write(sys.argv[2])
"""
    for threads in ("1", "2"):
        subprocess.run(
            [sys.executable, "-c", program, tmp_path / "mueller.npy", tmp_path / f"{threads}.json"],
            env=os.environ | {"OMP_NUM_THREADS": threads},
            check=True,
        )
    assert (tmp_path / "1.json").read_bytes() == (tmp_path / "2.json").read_bytes()


def test_gaps_of_one_band_do_not_touch_the_others():
    table = made_table()
    table.mueller[1, ::2] = np.nan
    result = pbrdf.fit(table, downsample=1)
    assert largest_error(result) < 1e-4
    assert result.residuals.nodes[1] < 0.6 * result.residuals.nodes[0]


def test_residual_is_told_by_element():
    table = made_table()
    table.mueller[0, ..., 2, 3] += 0.05
    result = pbrdf.fit(table, downsample=1)
    assert result.residuals.rms[0][2][3] == pytest.approx(0.05, rel=1e-3)
    assert result.residuals.rms[1][2][3] < 1e-5
    m00 = table.mueller[0, ..., 0, 0][:, 1:]
    rms = np.sqrt(np.nanmean(m00.astype(np.float64) ** 2))
    assert result.residuals.relative[0][2][3] == pytest.approx(0.05 / rms, rel=0.02)


def test_the_error_on_slabs_that_were_not_fitted_is_told():
    table = made_table(noise=0.1)
    result = pbrdf.fit(table, downsample=1, starts=1, held_out=True)
    assert result.held_out is not None
    np.testing.assert_allclose(result.held_out.theta_d_deg, [36.0])
    # the right model errs there by the noise, as everywhere
    for found in (result.residuals, result.held_out.residuals):
        assert found.rms[0][2][1] == pytest.approx(0.1 * np.nanmedian(table.mueller[..., 0, 0]), rel=0.1)
    # a parameter that bends one slab alone shows in that slab
    bent = dataclasses.replace(table, mueller=table.mueller.copy())
    bent.mueller[:, :, 6, :, 0, 0] *= 3.0
    outside = pbrdf.fit(bent, downsample=1, starts=1, held_out=True).held_out
    assert outside is not None
    assert outside.residuals.cost_per_node > 3 * result.held_out.residuals.cost_per_node


def test_a_table_of_few_slabs_says_that_none_can_be_spared():
    result = pbrdf.fit(made_table(shape=(16, 6, 33)), downsample=1, held_out=True)
    assert result.held_out is None
    assert "No slab of θd could be held out: the table has too few" in result.remarks


def test_a_result_survives_its_file(tmp_path):
    found = pbrdf.fit(made_table(noise=0.1, scale=[1, 3, 1]), downsample=2, held_out=True)
    named = dataclasses.replace(found, digest="sha256:1f")
    named.write(tmp_path / "fit.json")
    assert read_fit(tmp_path / "fit.json") == named
    content = json.loads((tmp_path / "fit.json").read_text())
    assert content["schema"] == "pbrdf/fit/1"
    assert content["parameters"]["alpha"]["value"] == found.band(0)["alpha"]


@pytest.mark.parametrize(
    ("field", "broken"),
    [
        ("parameters.eta.values", [1.5]),
        ("parameters.eta.standard_errors", [0.1]),
        ("options.cost", "means"),
        ("options.held_out", 1),
        ("residual.absolute.values", [[1.0]]),
        ("cost.total", "much"),
        ("model", 3),
    ],
)
def test_a_broken_file_is_refused_by_its_field(clean, tmp_path, field, broken):
    path = tmp_path / "fit.json"
    clean.write(path)
    content = json.loads(path.read_text())
    *parents, last = field.split(".")
    inner = content
    for name in parents:
        inner = inner[name]
    inner[last] = broken
    path.write_text(json.dumps(content))
    with pytest.raises(InputError, match=field if field != "options.cost" else "cost: 'means' is not"):
        read_fit(path)


def test_what_cannot_be_fitted_is_refused():
    table = made_table()
    black = dataclasses.replace(table, mueller=np.where(np.isnan(table.mueller), np.nan, np.float32(0.0)))
    empty = dataclasses.replace(table, mueller=np.full_like(table.mueller, np.nan))
    dark = dataclasses.replace(table, mueller=table.mueller.copy())
    dark.mueller[..., 0, 0] = 0.0
    partly = dataclasses.replace(table, mueller=table.mueller.copy())
    partly.mueller[2] = np.nan
    for data, message in (
        (dark, "mueller at 450 nm: has no positive M00"),
        (black, "mueller at 450 nm: holds nothing but zeros or NaN"),
        (empty, "mueller at 450 nm: holds nothing but zeros or NaN"),
        (partly, "mueller at 550 nm: holds nothing but zeros or NaN"),
    ):
        with pytest.raises(InputError, match=message):
            pbrdf.fit(data, downsample=1)
    for wrong, message in (
        ({"model": "phong"}, "model: 'phong' is not known; give one of baek2018"),
        ({"downsample": 0}, "downsample: is 0"),
        ({"starts": 0}, "starts: is 0"),
        ({"seed": -1}, "seed: is -1"),
        ({"cost": "means"}, "cost: 'means' is not known; give one of norms, roots, squares"),
        ({"thinning": "all"}, "thinning: 'all' is not known; give one of nodes, blocks"),
        ({"cost": "squares"}, "made: variance: is not in the table"),
    ):
        with pytest.raises(InputError, match=message):
            pbrdf.fit(table, **wrong)
