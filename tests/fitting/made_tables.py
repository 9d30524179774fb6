"""Tables made of a model, whose parameters are therefore known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from pbrdf.fitting import FitResult
from pbrdf.formats.table_data import TableData
from pbrdf.models import MODELS
from pbrdf.optics.rusinkiewicz import directions

Bands = Sequence[Mapping[str, float]]

TRUTH: Bands = [
    {"alpha": 0.2, "eta": 1.4, "specular": 1.0, "albedo": 0.3},
    {"alpha": 0.2, "eta": 1.5, "specular": 0.9, "albedo": 0.6},
    {"alpha": 0.2, "eta": 1.7, "specular": 0.4, "albedo": 0.1},
]


def truth_of(model: str) -> Bands:
    """Parameters of three bands for any model."""
    bands = ((1.4, 0.3, 1.0, 0.3), (1.5, 2.0, 0.9, 0.6), (1.7, 3.0, 0.4, 0.1))
    every = [
        {"alpha": 0.2, "sigma": 0.15, "eta": eta, "kappa": kappa, "specular": specular, "albedo": albedo}
        for eta, kappa, specular, albedo in bands
    ]
    return [{p.name: values[p.name] for p in MODELS[model].parameters} for values in every]


def made_table(
    truth: Bands = TRUTH,
    model: str = "baek2018",
    *,
    noise: float = 0.0,
    scale: Sequence[float] | None = None,
    shape: tuple[int, int, int] = (16, 16, 33),
    seed: int = 3,
) -> TableData:
    """Table of a model; `noise` is relative to the median M00, and its variance goes with the table."""
    theta_h = (np.arange(shape[0]) / (shape[0] - 1)) ** 2 * np.pi / 2
    theta_d = np.linspace(0, np.pi / 2, shape[1])
    phi_d = np.linspace(-np.pi, np.pi, shape[2])
    light, camera = directions(*np.meshgrid(theta_h, theta_d, phi_d, indexing="ij"))
    mueller = np.stack([MODELS[model].evaluate(light, camera, parameters) for parameters in truth])
    below = (light[..., 2] <= 1e-9) | (camera[..., 2] <= 1e-9)
    deviation = noise * np.median(mueller[:, ~below, 0, 0])
    mueller += deviation * np.random.default_rng(seed).normal(size=mueller.shape)
    if scale is not None:
        mueller *= np.asarray(scale)[:, None, None, None, None, None]
    mueller[:, below] = np.nan
    variance = np.full(mueller.shape, deviation**2, np.float32) if noise else None
    wavelengths = 450.0 + 50.0 * np.arange(len(truth))
    return TableData(
        "made", wavelengths, theta_h, theta_d, phi_d, mueller.astype(np.float32), variance=variance
    )


def deviations(result: FitResult, truth: Bands = TRUTH) -> NDArray[np.float64]:
    """Fitted minus true value of every parameter, shared ones once a band; (bands, parameters)."""
    return np.array(
        [
            [result.band(band)[name] - value for name, value in parameters.items()]
            for band, parameters in enumerate(truth)
        ]
    )


def largest_error(result: FitResult, truth: Bands = TRUTH) -> float:
    return float(np.abs(deviations(result, truth)).max())
