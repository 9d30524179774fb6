"""Standard errors: they are what repeated measurements scatter by."""

from __future__ import annotations

import numpy as np
import pytest
from made_tables import TRUTH, deviations, made_table

import pbrdf
from pbrdf.fitting import FitResult
from pbrdf.fitting.nodes import select_nodes
from pbrdf.fitting.objective import Objective
from pbrdf.fitting.solver import solve
from pbrdf.fitting.uncertainty import estimate, jacobian
from pbrdf.models import MODELS, CostKind

REPEATS = 60


def errors(result: FitResult) -> np.ndarray:
    bands = range(len(result.wavelengths_nm))
    rows = [[p.standard_errors[0 if p.shared else b] for p in result.parameters] for b in bands]
    return np.array(rows, dtype=float)


@pytest.mark.parametrize("cost", ["norms", "squares"])
@pytest.mark.parametrize("options", [{}, {"solid_angle": True}], ids=["alike", "solid angle"])
def test_repeated_tables_scatter_by_their_standard_errors(cost: str, options: dict[str, bool]) -> None:
    scores = []
    for seed in range(REPEATS):
        table = made_table(noise=0.1, shape=(7, 8, 13), seed=seed)
        result = pbrdf.fit(table, downsample=1, starts=1, cost=cost, **options)
        scores.append(deviations(result) / errors(result))
    found = np.array(scores)
    # ten different parameters, correlated within a band: the deviation of each is known to a tenth
    assert np.std(found, axis=0).max() < 1.35
    assert np.std(found, axis=0).min() > 0.7
    assert np.std(found) == pytest.approx(1.0, abs=0.07)
    assert np.abs(found.mean(axis=0)).max() < 3.5 / np.sqrt(REPEATS)


def test_four_times_the_nodes_halve_the_errors() -> None:
    few, many = (errors(pbrdf.fit(made_table(noise=0.05, shape=(16, 16, p)), downsample=1)) for p in (17, 65))
    np.testing.assert_allclose(many / few, 0.5, atol=0.1)


def test_a_clean_table_leaves_next_to_no_error() -> None:
    assert np.nanmax(errors(pbrdf.fit(made_table(), downsample=1))) < 1e-6


def test_a_parameter_on_a_bound_has_no_error() -> None:
    result = pbrdf.fit(made_table(noise=0.02, scale=[1.0, 3.0, 1.0]), downsample=1)
    found = {p.name: p.standard_errors for p in result.parameters}
    assert found["albedo"][1] is None
    assert None not in found["specular"]


def test_the_index_under_a_rough_diffuse_is_called_hardly_determined() -> None:
    """A faint and wide highlight: what is left to tell the index is the diffuse term's edge."""
    rough = [{"alpha": 0.9, "eta": 1.5, "specular": 0.3, "albedo": 0.8} for _ in TRUTH]
    result = pbrdf.fit(made_table(rough, noise=2.0, shape=(7, 8, 13)), downsample=1)
    words = " ".join(result.undetermined)
    assert "eta at 450 nm is hardly determined" in words
    calm = pbrdf.fit(made_table(rough, noise=0.01), downsample=1)
    assert calm.undetermined == ()


def test_what_changes_together_is_told_together() -> None:
    """A faint highlight: wide and strong, or narrow and weak, look alike."""
    faint = [{"alpha": 0.6, "eta": 1.5, "specular": 0.05, "albedo": 0.8} for _ in TRUTH]
    words = pbrdf.fit(made_table(faint, noise=0.3, shape=(7, 8, 13)), downsample=1).undetermined
    assert any(
        sentence.startswith("alpha is hardly determined") and "together with specular" in sentence
        for sentence in words
    )


def test_known_variances_imply_the_errors_of_weighted_squares() -> None:
    """With the right variances the sandwich is the textbook's (J'WJ)^-1."""
    table = made_table(noise=0.05)
    objective = Objective(MODELS["baek2018"], select_nodes(table, 1, with_variance=True), CostKind.SQUARES)
    vector = solve(objective, 1, 0).vector
    information = np.zeros((len(vector), len(vector)))
    for band in range(3):
        slope = jacobian(objective, vector, band, slice(None)).reshape(-1, 4)
        weight = objective.weight(band).reshape(-1).astype(float)
        entries = objective.band_entries(band)
        information[np.ix_(entries, entries)] += np.einsum("nk,n,nl->kl", slope, weight, slope)
    expected = np.sqrt(np.diagonal(np.linalg.inv(information)))
    np.testing.assert_allclose(estimate(objective, vector, 1e-4).standard_errors, expected, rtol=0.05)


def test_squares_beyond_the_variances_are_called_the_models_error() -> None:
    metal = [{"alpha": 0.2, "eta": 1.5, "kappa": 2.0, "specular": 0.9, "albedo": 0.0}]
    result = pbrdf.fit(made_table(metal, "baek2018_complex", noise=0.05), downsample=1, cost="squares")
    assert any("times what the table's variances predict" in remark for remark in result.remarks)


def test_a_sum_of_roots_tells_no_errors_and_says_why() -> None:
    result = pbrdf.fit(made_table(noise=0.05), downsample=1, cost="roots")
    assert np.isnan(errors(result)).all()
    assert any(remark.startswith("No standard errors") for remark in result.remarks)
