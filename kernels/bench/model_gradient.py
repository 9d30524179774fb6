"""Baek's cost and gradient over a million directions against Mitsuba's values; the limit: to read as much."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from bench.limits import Copy, cores
from bench.measure import interleaved, peak_mb, row
from bench.numpy_facets import NumpyBaek
from pbrdf.models import MODELS

DIRECTIONS = 1_000_000
BYTES = 4 * (8 + 14)
"""Of a direction: eight numbers of geometry, twelve elements, what is left of the others, a weight."""
PARAMETERS = {"alpha": 0.25, "eta": 1.6, "specular": 0.9, "albedo": 0.4}
TRUTH = {"alpha": 0.2, "eta": 1.5, "specular": 1.0, "albedo": 0.5}
EPSILON = 1e-3
OLDEST_LLVM = (17, 0, 0)
"""That compiles `pplastic`; Debian has it as libllvm19."""


def directions() -> tuple[np.ndarray, np.ndarray]:
    """Two arrays (DIRECTIONS, 3) of unit vectors above the horizon."""
    vectors = np.random.default_rng(1).normal(size=(2, DIRECTIONS, 3))
    vectors[..., 2] = np.maximum(np.abs(vectors[..., 2]), 1e-3)
    vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors[0], vectors[1]


def mitsuba_values(to_light: np.ndarray, to_camera: np.ndarray) -> Callable[[], Any] | None:
    """`pplastic.eval` as compiled by LLVM, or None where Mitsuba or LLVM's library is not installed."""
    try:
        import drjit
        import mitsuba

        mitsuba.set_variant("llvm_ad_mono_polarized")
        version = drjit.detail.llvm_version()
    except (ImportError, RuntimeError):
        return None
    # older ones end the process: they have no instruction for the larger of two numbers
    if version < OLDEST_LLVM:
        return None
    plastic = mitsuba.load_dict(
        {
            "type": "pplastic",
            "distribution": "ggx",
            "alpha": PARAMETERS["alpha"],
            "int_ior": PARAMETERS["eta"],
            "ext_ior": 1.0,
            "specular_reflectance": {"type": "uniform", "value": PARAMETERS["specular"]},
            "diffuse_reflectance": {"type": "uniform", "value": PARAMETERS["albedo"]},
        }
    )
    surface = drjit.zeros(mitsuba.SurfaceInteraction3f, len(to_light))
    surface.wi = mitsuba.Vector3f(to_camera.T.astype(np.float32))
    light = mitsuba.Vector3f(to_light.T.astype(np.float32))
    drjit.eval(surface, light)
    context = mitsuba.BSDFContext()

    def values() -> None:
        drjit.eval(plastic.eval(context, surface, light))
        drjit.sync_thread()

    return values


def run() -> list[dict[str, Any]]:
    """Row `model-gradient`."""
    model = MODELS["baek2018"]
    to_light, to_camera = directions()
    mueller = model.evaluate(to_light, to_camera, TRUTH).astype(np.float32)
    weight = np.ones(DIRECTIONS, np.float32)
    cost = model.node_cost(to_light, to_camera, mueller[None], weight[None])
    shared = np.array([PARAMETERS["alpha"]])
    own = np.array([[PARAMETERS[name] for name in ("eta", "specular", "albedo")]])
    epsilon = np.array([EPSILON])

    def ours() -> tuple[Any, Any]:
        return cost(shared, own, epsilon, single=True)

    values = mitsuba_values(to_light, to_camera)
    twin = NumpyBaek(to_light, to_camera)
    measured = np.ascontiguousarray(np.moveaxis(mueller.astype(np.float64), 0, -1))
    expected, slopes = twin.cost_gradient(measured, PARAMETERS, EPSILON)
    found, gradient = ours()
    np.testing.assert_allclose(found[0], expected, rtol=1e-6)
    np.testing.assert_allclose(gradient[0], slopes, rtol=1e-4)

    peers: dict[str, tuple[Callable[[], Any], int]] = {
        "NumPy, cost and gradient": (lambda: twin.cost_gradient(measured, PARAMETERS, EPSILON), 1)
    }
    if values is not None:
        values()
        peers["Mitsuba pplastic.eval by LLVM, values alone"] = (values, 20)
    peak = peak_mb()
    functions = {"ours": (ours, 20), "copy": (Copy(cores()), 3), **peers}
    seconds = interleaved(functions, rounds=5)
    return [
        row(
            "model-gradient",
            ours_s=seconds["ours"],
            peer=peer,
            peer_s=seconds[peer],
            limit_s=Copy.seconds_for(DIRECTIONS * BYTES, seconds["copy"]),
            peak_mb=peak,
        )
        for peer in peers
    ]
