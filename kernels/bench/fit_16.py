"""The supplement's fit of 16 parameters to a table of 91 × 23 × 23 nodes in five bands.

Rows: one evaluation of cost and gradient over all of it against the NumPy twin's, in single precision,
as most of a search goes, and in double, as it ends; the same at three sizes, whose time a node tells
whether the work is linear; and the whole fit, with all its starts, against SciPy's L-BFGS-B over NumPy
from the same starts. The twin is written for speed and knows float64 alone. The limit: to read as much.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

import pbrdf
from bench.limits import Copy, cores
from bench.measure import interleaved, peak_mb, row
from bench.numpy_facets import NumpyBaek
from pbrdf.fitting.nodes import Nodes, select_nodes
from pbrdf.fitting.objective import Objective
from pbrdf.fitting.solver import LAST_EPSILON
from pbrdf.fitting.starts import find_starts
from pbrdf.formats.table_data import TableData
from pbrdf.models import MODELS
from pbrdf.optics.rusinkiewicz import directions

MODEL = MODELS["baek2018"]
TRUTH = [
    {"alpha": 0.18, "eta": 1.50 - 0.003 * band, "specular": 1.0, "albedo": albedo}
    for band, albedo in enumerate((0.06, 0.07, 0.10, 0.42, 0.55))
]
NOISE = 0.02
"""Of each element, relative to the median M00."""
STARTS, SEED = 3, 1
MOST_CALLS = 600
"""Of the peer for each start: L-BFGS stalls at the kinks of the norms and may go on for long."""
GEOMETRY_BYTES, TABLE_BYTES = 4 * 8, 4 * 14
"""Of a node in single precision; of its elements, what is left of the others and weight in each band."""

Float = NDArray[np.float64]


def table(nodes: tuple[int, int, int] = (91, 23, 23)) -> TableData:
    """Table of the model with noise."""
    theta_h = (np.arange(nodes[0]) / (nodes[0] - 1)) ** 2 * np.pi / 2
    theta_d = np.linspace(0, np.pi / 2, nodes[1])
    phi_d = np.linspace(-np.pi, np.pi, nodes[2])
    light, camera = directions(*np.meshgrid(theta_h, theta_d, phi_d, indexing="ij"))
    mueller = np.stack([MODEL.evaluate(light, camera, parameters) for parameters in TRUTH])
    below = (light[..., 2] <= 1e-9) | (camera[..., 2] <= 1e-9)
    scale = NOISE * np.median(mueller[:, ~below, 0, 0])
    mueller += scale * np.random.default_rng(2).normal(size=mueller.shape)
    mueller[:, below] = np.nan
    wavelengths = np.array([450.0, 500.0, 550.0, 600.0, 650.0])
    return TableData("bench", wavelengths, theta_h, theta_d, phi_d, mueller.astype(np.float32))


class NumpyObjective:
    """`pbrdf.fitting.objective.Objective.cost` with NumPy alone."""

    def __init__(self, nodes: Nodes, objective: Objective) -> None:
        self._geometry = NumpyBaek(nodes.to_light, nodes.to_camera)
        self._mueller = [
            np.ascontiguousarray(np.moveaxis(m.astype(np.float64), 0, -1)) for m in nodes.mueller
        ]
        self._scale = nodes.scale
        self._objective = objective

    def cost(self, vector: Float, epsilon: float) -> tuple[float, Float]:
        """Cost and gradient by the vector."""
        total, gradient = 0.0, np.zeros_like(vector)
        for band, mueller in enumerate(self._mueller):
            parameters = self._objective.band_parameters(vector, band)
            value, slope = self._geometry.cost_gradient(
                mueller, parameters, epsilon * float(self._scale[band])
            )
            total += value
            gradient[self._objective.band_entries(band)] += slope
        return total, gradient


def evaluations(data: TableData) -> list[dict[str, Any]]:
    """Rows of one evaluation: in both precisions, and in single over a half and a quarter of the nodes."""
    nodes = select_nodes(data, 1)
    objective = Objective(MODEL, nodes)
    twin = NumpyObjective(nodes, objective)
    vector = np.array([0.2, *(1.5, 0.9, 0.3) * len(TRUTH)])
    expected, found = twin.cost(vector, 1e-2), objective.cost(vector, 1e-2)
    np.testing.assert_allclose(found[0], expected[0], rtol=1e-8)
    np.testing.assert_allclose(found[1], expected[1], rtol=1e-6, atol=1e-8 * np.abs(expected[1]).max())

    count = len(nodes.indices)

    def ours_of(some: Objective, *, single: bool = True) -> Callable[[], Any]:
        return lambda: some.cost(vector, 1e-2, single=single)

    ours = {"fit-16": ours_of(objective), "fit-16-float64": ours_of(objective, single=False)}
    sizes = dict.fromkeys(ours, count)
    peers = {"twin": (lambda: twin.cost(vector, 1e-2), 5)}
    for part in (2, 4):
        name = f"fit-16-nodes/{part}"
        some = nodes.subset(np.arange(0, count, part))
        ours[name], sizes[name] = ours_of(Objective(MODEL, some)), len(some.indices)
        part_twin = NumpyObjective(some, objective)
        peers[f"twin{part}"] = (lambda part_twin=part_twin: part_twin.cost(vector, 1e-2), 5)
    peak = peak_mb()
    functions = {name: (one, 100) for name, one in ours.items()} | {"copy": (Copy(cores()), 3)} | peers
    seconds = interleaved(functions, rounds=5)
    return [
        row(
            name,
            ours_s=seconds[name],
            peer=f"NumPy twin, {size} nodes; {1e9 * seconds[name] / (size * len(TRUTH)):.1f} ns each",
            peer_s=seconds["twin" + name.partition("/")[2]],
            limit_s=Copy.seconds_for(size * (GEOMETRY_BYTES + len(TRUTH) * TABLE_BYTES), seconds["copy"]),
            peak_mb=peak,
        )
        for name, size in sizes.items()
    ]


def whole_fit(data: TableData) -> dict[str, Any]:
    """Row of a whole fit: the search, standard errors and residuals; the peer searches alone."""
    times = []
    for _ in range(3):
        start = time.perf_counter()
        result = pbrdf.fit(data, downsample=1, starts=STARTS, seed=SEED)
        times.append(time.perf_counter() - start)
    ours_s = float(np.median(times))

    nodes = select_nodes(data, 1)
    objective = Objective(MODEL, nodes)
    twin = NumpyObjective(nodes, objective)
    begins = find_starts(objective, STARTS, SEED)
    bounds = list(zip(objective.lower, objective.upper, strict=True))
    start = time.perf_counter()
    ends = [
        minimize(
            twin.cost, x, (LAST_EPSILON,), "L-BFGS-B", jac=True, bounds=bounds, options={"maxfun": MOST_CALLS}
        )
        for x in begins
    ]
    peer_s = time.perf_counter() - start
    ours_cost, peer_cost = min(result.starts), min(float(end.fun) for end in ends)
    return row(
        "fit-16-whole",
        ours_s=ours_s,
        peer=f"SciPy L-BFGS-B with NumPy; final costs {ours_cost:.6g} (ours), {peer_cost:.6g}",
        peer_s=peer_s,
        limit_s=ours_s,
        peak_mb=peak_mb(),
    )


def run() -> list[dict[str, Any]]:
    """Rows `fit-16`, with those of precision, size and whole fit."""
    data = table()
    return [*evaluations(data), whole_fit(data)]
