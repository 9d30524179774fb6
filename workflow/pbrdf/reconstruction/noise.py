"""How the noise of the sixteen elements of a pixel hangs together: what turning its frames has to know."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pbrdf.reconstruction.reduction import DataReduction

Float = NDArray[np.float64]


@dataclass(frozen=True)
class NoiseModel:
    """What made the noise of a Mueller image: states, exposures and sensor.

    Attributes
    ----------
    solution : DataReduction
        W and its pseudo-inverse.
    exposures_s : ndarray, shape (exposures,), float64
        Ascending.
    saturation : float
        DN above the dark level from which on an exposure is not used.
    dn_per_electron, read_noise_dn : float
        DN; `pbrdf.calibration.radiometry.Radiometry`.
    darks : int
        Frames in the mean dark frame of each exposure.
    """

    solution: DataReduction
    exposures_s: Float
    saturation: float
    dn_per_electron: float
    read_noise_dn: float
    darks: int

    def covariance(self, mueller: Float) -> Float:
        """Covariance of the elements of matrices that are reconstructed from frames.

        Parameters
        ----------
        mueller : ndarray, shape (n, 16), float64
            True or fitted elements, DN/s as measured, before a flat field is applied.

        Returns
        -------
        ndarray, shape (n, 16, 16), float64
            (DN/s)². Of W⁺ i it is W⁺ Σ W⁺ᵀ; where the states differ in exposures, of the weighted
            solution, (Wᵀ Σ⁻¹ W)⁻¹ (Goldstein, *Polarized Light*, on least squares). To either
            comes the noise of the mean dark frame, which all states share.
        """
        rate = mueller @ self.solution.measurement.T
        certainty, used = self._certainties(rate)
        inverse_variance = certainty.sum(axis=-1)
        covariance = self._plain(1.0 / inverse_variance)
        uneven = np.any(used != used[:, :1], axis=1)
        if uneven.any():
            covariance[uneven] = self._weighted(inverse_variance[uneven])
        if self.darks:
            shift = self._shift_by_dark(certainty, inverse_variance, covariance, uneven)
            covariance += np.einsum("pke,ple->pkl", shift, shift) * (self.read_noise_dn**2 / self.darks)
        return covariance

    def _certainties(self, rate: Float) -> tuple[Float, NDArray[np.intp]]:
        """Inverse variance that each exposure adds, (n, states, exposures), and how many are used."""
        signal = np.maximum(rate, 0.0)[..., None] * self.exposures_s
        usable = signal < self.saturation
        # the shortest is all there is of a state that would saturate in it
        usable[..., 0] = True
        value_variance = self.read_noise_dn**2 + self.dn_per_electron * signal
        return np.where(usable, self.exposures_s**2 / value_variance, 0.0), usable.sum(axis=-1)

    def _plain(self, variance: Float) -> Float:
        reduction = self.solution.reduction
        products = (reduction[:, None, :] * reduction[None, :, :]).reshape(256, -1)
        covariance: Float = (variance @ products.T).reshape(-1, 16, 16)
        return covariance

    def _weighted(self, inverse_variance: Float) -> Float:
        w = self.solution.measurement
        products = (w[:, :, None] * w[:, None, :]).reshape(-1, 256)
        normal: Float = (inverse_variance @ products).reshape(-1, 16, 16)
        return np.asarray(np.linalg.inv(normal), np.float64)

    def _shift_by_dark(
        self, certainty: Float, inverse_variance: Float, covariance: Float, uneven: NDArray[np.bool_]
    ) -> Float:
        """What one DN of each exposure's dark frame does to the elements, (n, 16, exposures)."""
        # of the states' rates, times their inverse variances
        moved = certainty / self.exposures_s
        shift: Float = np.einsum("kn,pne->pke", self.solution.reduction, moved / inverse_variance[..., None])
        if uneven.any():
            right = np.einsum("nk,pne->pke", self.solution.measurement, moved[uneven])
            shift[uneven] = covariance[uneven] @ right
        return shift
