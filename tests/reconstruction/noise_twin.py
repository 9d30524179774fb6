"""Covariance of a pixel's sixteen elements in plain NumPy, beside the kernel `turned_variance`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pbrdf.optics.mueller import rotator
from pbrdf.reconstruction.noise import NoiseModel

Float = NDArray[np.float64]


def covariance(noise: NoiseModel, mueller: Float) -> Float:
    """Covariance (n, 16, 16) of the elements of matrices (n, 16) as the model has them made."""
    rate = mueller @ noise.solution.measurement.T
    certainty, used = _certainties(noise, rate)
    inverse_variance = certainty.sum(axis=-1)
    w, reduction = noise.solution.measurement, noise.solution.reduction
    result = np.einsum("kn,pn,ln->pkl", reduction, 1 / inverse_variance, reduction)
    uneven = np.any(used != used[:, :1], axis=1)
    result[uneven] = np.linalg.inv(np.einsum("nk,pn,nl->pkl", w, inverse_variance[uneven], w))
    if noise.darks:
        # of the states' rates, times their inverse variances
        moved = certainty / noise.exposures_s
        shift = np.einsum("kn,pne->pke", reduction, moved / inverse_variance[..., None])
        shift[uneven] = result[uneven] @ np.einsum("nk,pne->pke", w, moved[uneven])
        result += np.einsum("pke,ple->pkl", shift, shift) * (noise.read_noise_dn**2 / noise.darks)
    return result


def turned_variance(
    noise: NoiseModel, mueller: Float, variance: Float, angle_in: Float, angle_out: Float
) -> Float:
    """Twin of `NoiseModel.turned_variance`."""
    modelled = covariance(noise, mueller)
    # rows of the turn of a matrix written as a vector: out ⊗ in
    turn = np.einsum("pij,pkl->pikjl", rotator(angle_out), rotator(angle_in)).reshape(-1, 16, 16)
    turn = turn * np.sqrt(variance / np.einsum("pkk->pk", modelled))[:, None, :]
    return np.einsum("pkl,pkl->pk", turn @ modelled, turn)


def _certainties(noise: NoiseModel, rate: Float) -> tuple[Float, NDArray[np.intp]]:
    """Inverse variance that each exposure adds, (n, states, exposures), and how many are used."""
    signal = np.maximum(rate, 0.0)[..., None] * noise.exposures_s
    usable = signal < noise.saturation
    # the shortest is all there is of a state that would saturate in it
    usable[..., 0] = True
    value_variance = noise.read_noise_dn**2 + noise.dn_per_electron * signal
    return np.where(usable, noise.exposures_s**2 / value_variance, 0.0), usable.sum(axis=-1)
