"""Our search ends where SciPy's trust-constr does, the kind of solver that the supplement used."""

from __future__ import annotations

import numpy as np
import pytest
from made_tables import made_table
from scipy.optimize import Bounds, minimize

from pbrdf.fitting.nodes import select_nodes
from pbrdf.fitting.objective import Objective
from pbrdf.fitting.solver import LAST_EPSILON, solve
from pbrdf.models import MODELS


def test_trust_constr_finds_the_same_cost() -> None:
    table = made_table(noise=0.05, shape=(9, 10, 17))
    objective = Objective(MODELS["baek2018"], select_nodes(table, 1))
    ours = solve(objective, starts=3, seed=0)
    random = np.random.default_rng(0)
    # an interior point needs a start inside the bounds
    inside = np.clip(
        ours.vector * random.uniform(0.8, 1.2, len(ours.vector)),
        objective.lower + 1e-3,
        objective.upper - 1e-3,
    )
    theirs = minimize(
        lambda vector: objective.cost(vector, LAST_EPSILON),
        inside,
        jac=True,
        method="trust-constr",
        bounds=Bounds(objective.lower, objective.upper),
        options={"maxiter": 2000, "gtol": 1e-10, "xtol": 1e-12},
    )
    assert min(ours.costs) == pytest.approx(theirs.fun, rel=1e-6)
    np.testing.assert_allclose(ours.vector, theirs.x, atol=1e-4)
