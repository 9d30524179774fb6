"""Write the series of ``kernels/include/pbrdf/grooved_metal_series.hpp``.

A perfect conductor's facets have Gaussian slopes p, q of standard deviation σ and are shadowed as by
V-grooves (Blinn's G). With t = tan θi, and p counted away from the light, light from θi is reflected
once into the hemisphere by the share

    ρ(t, σ) = ∫∫ max(0, min(v, 2, 4 v / (1 + p² + q²) − 2)) N(p; σ) N(q; σ) dp dq,    v = 1 − p t,

which follows from ∫ D G cosθo dωo / (4 cosθi cosθo) by dωo = 4 cosθd dωh, D cosθh dωh = N N dp dq and
cosθd = v cosθi cosθh. Its integrand is smooth between the curves where the least of the three changes;
Gauss-Legendre's rule between those gives eleven digits. The series is Chebyshev's in
u = (σ t − c)/(σ t + c) and in σ, through the values at Chebyshev's points.

    python tools/grooved_metal.py            # writes the header
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

Float = NDArray[np.float64]

HEADER = Path(__file__).resolve().parents[1] / "kernels" / "include" / "pbrdf" / "grooved_metal_series.hpp"
DEGREES, SIGMA_DEGREES = 24, 16
MIDDLE = 0.5
MOST_SIGMA = 0.75
_REACH = 9.0
"""Slopes beyond so many standard deviations do not count."""
_PANELS, _ORDER, _ACROSS = 24, 24, 60


def _legendre(order: int) -> tuple[Float, Float]:
    """Points and weights on [0, 1]."""
    points, weights = np.polynomial.legendre.leggauss(order)
    return 0.5 * (points + 1.0), 0.5 * weights


def _edges(t: float, reach: float) -> Float:
    """Slopes p between which the integral over q is smooth, within what is reflected upward at all."""
    root = np.hypot(1.0, t)
    low, high = max(-t - root, -reach), min(root - t, reach)
    if high <= low:
        return np.empty(0)
    # where v = 2, and where the curve on which the third of the three becomes the least meets q = 0
    inner = [-1.0 / t] if t > 0 else []
    inner += [0.0, -t, *(r.real for r in np.roots([-t, 3.0, 3.0 * t, -1.0]) if abs(r.imag) < 1e-12)]
    return np.unique([low, high, *(p for p in inner if low < p < high)])


def _integral_over_q(p: Float, t: float, sigma: float) -> Float:
    v = 1.0 - p * t
    least = np.minimum(v, 2.0)
    q_end = np.sqrt(np.maximum(2.0 * v - 1.0 - p * p, 0.0))
    q_change = np.sqrt(np.maximum(4.0 * v / (least + 2.0) - 1.0 - p * p, 0.0))
    q_end, q_change = (np.minimum(q, _REACH * sigma)[:, None] for q in (q_end, q_change))
    points, weights = _legendre(_ACROSS)

    def normal(q: Float) -> Float:
        values: Float = np.exp(-0.5 * (q / sigma) ** 2) / (np.sqrt(2.0 * np.pi) * sigma)
        return values

    inner = np.maximum(least, 0.0) * np.sum(weights * q_change * normal(q_change * points), axis=1)
    q = q_change + (q_end - q_change) * points
    third = 4.0 * v[:, None] / (1.0 + (p**2)[:, None] + q**2) - 2.0
    outer = np.sum(weights * (q_end - q_change) * normal(q) * third, axis=1)
    return 2.0 * (inner + outer)


def reflectance(t: float, sigma: float) -> float:
    """Share of the light from θi = atan t that single reflections send on, for slopes of deviation σ."""
    reach = _REACH * sigma
    edges = _edges(t, reach)
    points, weights = _legendre(_ORDER)
    total = 0.0
    for low, high in pairwise(edges):
        panels = int(np.ceil(_PANELS * (high - low) / (2.0 * reach))) + 1
        u = ((np.arange(panels)[:, None] + points) / panels).ravel()
        # the integral over q may begin like a root at an edge: a cosine takes that away
        p = 0.5 * (low + high) - 0.5 * (high - low) * np.cos(np.pi * u)
        stretch = 0.5 * np.pi * (high - low) * np.sin(np.pi * u) * np.tile(weights, panels) / panels
        normal = np.exp(-0.5 * (p / sigma) ** 2) / (np.sqrt(2.0 * np.pi) * sigma)
        total += float(np.sum(stretch * normal * _integral_over_q(p, t, sigma)))
    return total


def series() -> Float:
    """Coefficients, shape (DEGREES, SIGMA_DEGREES)."""

    def nodes(count: int) -> Float:
        points: Float = np.cos(np.pi * (np.arange(count) + 0.5) / count)
        return points

    u, w = nodes(DEGREES), nodes(SIGMA_DEGREES)
    sigma = 0.5 * MOST_SIGMA * (1.0 + w)
    scaled = MIDDLE * (1.0 + u) / (1.0 - u)
    values = np.array([[reflectance(x / s, s) for s in sigma] for x in scaled])
    by_u = np.linalg.solve(chebyshev.chebvander(u, DEGREES - 1), values)
    coefficients: Float = np.linalg.solve(chebyshev.chebvander(w, SIGMA_DEGREES - 1), by_u.T).T
    return coefficients


def header() -> str:
    """Text of the header."""
    rows = "".join("    {" + ", ".join(f"{value:.10e}" for value in row) + "},\n" for row in series())
    return (
        "// Written by tools/grooved_metal.py, which says what these numbers are.\n#pragma once\n\n"
        "namespace pbrdf {\n\n"
        f"inline constexpr int grooved_metal_degrees = {DEGREES}, "
        f"grooved_metal_sigma_degrees = {SIGMA_DEGREES};\n"
        f"inline constexpr double grooved_metal_middle = {MIDDLE}, "
        f"grooved_metal_most_sigma = {MOST_SIGMA};\n\n"
        "// clang-format off\n"
        "inline constexpr double grooved_metal_series[grooved_metal_degrees]"
        "[grooved_metal_sigma_degrees] = {\n"
        f"{rows}}};\n// clang-format on\n\n}}  // namespace pbrdf\n"
    )


if __name__ == "__main__":
    HEADER.write_text(header())
