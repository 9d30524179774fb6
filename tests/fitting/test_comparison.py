"""What a comparison tells of models whose truth is known."""

from __future__ import annotations

import csv
import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from made_tables import TRUTH, made_table

import pbrdf
from pbrdf.errors import InputError
from pbrdf.fitting import FitResult
from pbrdf.fitting.comparison import Comparison, compare, gather
from pbrdf.fitting.polarisation import brewster_angle, dolp
from pbrdf.fitting.reflectance import model_reflectance, table_reflectance
from pbrdf.formats.table_data import TableData
from pbrdf.models import MODELS
from pbrdf.models.table import Table
from pbrdf.optics.rusinkiewicz import directions

BAEK = MODELS["baek2018"]
MODEL = "baek2018"


@pytest.fixture(scope="module")
def table() -> TableData:
    return made_table(noise=0.02, shape=(31, 46, 61))


@pytest.fixture(scope="module")
def fitted(table: TableData) -> FitResult:
    return pbrdf.fit(table, MODEL, downsample=2, starts=1, held_out=True)


@pytest.fixture(scope="module")
def comparison(table: TableData, fitted: FitResult) -> Comparison:
    return compare("made", table, [fitted])


@pytest.mark.parametrize("theta_i", [0.0, 0.8, 1.3])
@pytest.mark.parametrize("eta", [1.3, 2.0])
def test_reflectance_of_a_diffuse_surface_is_two_passages(theta_i: float, eta: float) -> None:
    """In by Fresnel's law, out by the same: one integral over the cosine is left."""
    parameters = {"alpha": 0.3, "eta": eta, "specular": 0.0, "albedo": 0.7}
    cosine = (np.arange(20_000) + 0.5) / 20_000

    def passed(cos: np.ndarray) -> np.ndarray:
        inside = np.sqrt(1 - (1 - cos**2) / eta**2)
        s, p = (cos - eta * inside) / (cos + eta * inside), (eta * cos - inside) / (eta * cos + inside)
        return 1 - (s**2 + p**2) / 2

    expected = 0.7 * passed(np.cos([theta_i])).item() * np.mean(2 * cosine * passed(cosine))
    assert model_reflectance(BAEK, parameters, theta_i).value == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("alpha", [0.01, 0.02])
@pytest.mark.parametrize("theta_i", [0.0, 0.7, 1.2])
def test_a_smooth_perfect_mirror_gives_back_what_comes_in(alpha: float, theta_i: float) -> None:
    mirror = {"alpha": alpha, "eta": 1.0, "kappa": 1e7, "specular": 1.0, "albedo": 0.0}
    found = model_reflectance(BAEK, mirror, theta_i)
    assert found.value == pytest.approx(1.0, abs=0.01)
    assert found.known == 1.0


def test_a_smooth_dielectric_reflects_as_fresnel_says() -> None:
    glass = {"alpha": 0.01, "eta": 1.5, "specular": 1.0, "albedo": 0.0}
    assert model_reflectance(BAEK, glass, 0.0).value == pytest.approx(0.04, rel=2e-3)


def test_reflectance_of_a_table_is_that_of_what_it_holds() -> None:
    truth = [{"alpha": 0.5, "eta": 1.5, "specular": 0.5, "albedo": 0.6}]
    table = made_table(truth, shape=(46, 46, 91))
    whole = table_reflectance(Table(table), 450.0, 0.5)
    assert whole.known > 0.95
    assert whole.value == pytest.approx(model_reflectance(BAEK, truth[0], 0.5).value, rel=0.05)
    half = dataclasses.replace(table, mueller=table.mueller.copy())
    half.mueller[:, :, :, :45] = np.nan
    part = table_reflectance(Table(half), 450.0, 0.5)
    assert part.known == pytest.approx(0.5, abs=0.1)
    assert part.value < 0.7 * whole.value


def test_brewsters_angle_is_that_of_the_index(comparison: Comparison) -> None:
    for angle, truth in zip(comparison.brewster, TRUTH, strict=True):
        expected = np.degrees(np.arctan(truth["eta"]))
        assert angle.models[MODEL] == pytest.approx(expected, abs=0.1)
        assert angle.measured_deg is not None
        assert angle.standard_error_deg is not None
        # steps of 2° are bridged by straight lines
        assert abs(angle.measured_deg - expected) < 0.1 + 3 * angle.standard_error_deg


def test_brewsters_angle_scatters_by_its_standard_error() -> None:
    found = []
    for seed in range(60):
        table = made_table(TRUTH[:1], noise=0.3, shape=(16, 31, 31), seed=seed)
        angle = brewster_angle(table, 0, {})
        found.append((angle.measured_deg, angle.standard_error_deg))
    measured, errors = np.array(found, dtype=float).T
    assert np.std(measured) == pytest.approx(np.median(errors), rel=0.3)


def test_a_surface_without_a_jump_of_phase_has_no_brewster_angle() -> None:
    matt = [{"alpha": 0.3, "eta": 1.5, "specular": 0.0, "albedo": 0.6}]
    table = made_table(matt)
    (angle,) = compare("made", table, [pbrdf.fit(table, downsample=2, starts=1)]).brewster
    assert angle.measured_deg is None
    assert angle.models[MODEL] is None


def test_dolp_curves_lie_beside_their_model_within_their_errors(
    comparison: Comparison, table: TableData
) -> None:
    assert [round(curve.theta_h_deg) for curve in comparison.dolp] == [0, 10, 40] * 3
    scores = []
    for curve in comparison.dolp:
        assert len(curve.theta_d_deg) == len(table.theta_d)
        for measured, error, model in zip(
            curve.measured, curve.standard_error, curve.models[MODEL], strict=True
        ):
            # where there is next to no DoLP, noise alone makes some
            if measured is not None and error is not None and measured > 5 * error:
                scores.append((measured - model) / error)
    assert len(scores) > 100
    assert np.std(scores) == pytest.approx(1.0, abs=0.25)


def test_dolp_is_that_of_the_matrix() -> None:
    light, camera = directions(0.1, 0.9, np.pi / 2)
    mueller = BAEK.evaluate(light, camera, TRUTH[0])
    stokes = mueller @ [1, 0, 0, 0]
    assert dolp(mueller) == pytest.approx(np.hypot(stokes[1], stokes[2]) / stokes[0])


def test_energy_is_told_in_words(table: TableData, fitted: FitResult, comparison: Comparison) -> None:
    assert any(s.startswith(f"{MODEL} conserves energy at the angles") for s in comparison.words)
    bright = tuple(
        dataclasses.replace(p, values=(30.0,) * 3) if p.name == "specular" else p for p in fitted.parameters
    )
    words = compare("made", table, [dataclasses.replace(fitted, parameters=bright)]).words
    assert any(s.startswith(f"{MODEL} does not conserve energy: it reflects") for s in words)


def test_document_and_rows_hold_the_same_values(comparison: Comparison, tmp_path: Path) -> None:
    comparison.write(tmp_path / "c.json", tmp_path / "c.csv")
    content = json.loads((tmp_path / "c.json").read_text(encoding="utf-8"))
    assert content["schema"] == "pbrdf/comparison/1"
    with (tmp_path / "c.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert {row["material"] for row in rows} == {"made"}

    def values(quantity: str, of: str) -> list[float]:
        return [float(row["value"]) for row in rows if (row["quantity"], row["of"]) == (quantity, of)]

    model = content["models"][0]
    np.testing.assert_allclose(values("eta", MODEL), model["parameters"]["eta"]["values"], rtol=1e-6)
    np.testing.assert_allclose(
        values("residual", MODEL), np.ravel(model["fitted"]["relative"]["values"]), rtol=1e-6
    )
    assert len(values("residual_held_out", MODEL)) == 3 * 16
    assert len(values("reflectance", "table")) == len(content["albedo"])
    assert len(values("dolp", MODEL)) == 9 * 46


def test_materials_are_put_side_by_side(comparison: Comparison, tmp_path: Path) -> None:
    paths = []
    for name in ("jade", "peek"):
        paths.append(tmp_path / f"{name}.json")
        dataclasses.replace(comparison, material=name).write(paths[-1], tmp_path / f"{name}.csv")
    gather(paths, tmp_path / "all.json", tmp_path / "all.csv")
    content = json.loads((tmp_path / "all.json").read_text(encoding="utf-8"))
    assert content["schema"] == "pbrdf/comparisons/1"
    assert [material["material"] for material in content["materials"]] == ["jade", "peek"]
    rows = (tmp_path / "all.csv").read_text(encoding="utf-8").splitlines()
    assert any(row.startswith("peek,brewster,table,550") for row in rows)
    assert not any(",dolp," in row for row in rows)


def test_fits_of_other_bands_are_refused(table: TableData, fitted: FitResult) -> None:
    other = dataclasses.replace(fitted, wavelengths_nm=(1.0, 2.0, 3.0))
    with pytest.raises(InputError, match="fit of baek2018: is of other bands"):
        compare("made", table, [other])
    with pytest.raises(InputError, match="fits: are none"):
        compare("made", table, [])
