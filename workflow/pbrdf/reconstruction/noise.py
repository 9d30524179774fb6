"""How the noise of the sixteen elements of a pixel hangs together: what turning its frames has to know."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pbrdf._kernels import turned_variance
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

    def turned_variance(self, mueller: Float, variance: Float, angle_in: Float, angle_out: Float) -> Float:
        """Variances of reconstructed matrices after a turn of their frames.

        Of W⁺ i the covariance is W⁺ Σ W⁺ᵀ; where the states differ in exposures, of the weighted
        solution, (Wᵀ Σ⁻¹ W)⁻¹ (Goldstein, *Polarized Light*, on least squares). To either comes the
        noise of the mean dark frame, which all states share.

        Parameters
        ----------
        mueller, variance : ndarray, shape (n, 16), float64
            Elements, DN/s as measured, before a flat field is applied, in the frames that they were
            reconstructed in, and the variances that are known of them: the model tells how the noise of
            the elements hangs together, `variance` how large it is.
        angle_in, angle_out : ndarray, shape (n,), float64
            As for `pbrdf.optics.frames.change_frames`, radians.

        Returns
        -------
        ndarray, shape (n, 16), float64
        """
        turns = np.stack(
            [np.cos(2 * angle_in), np.sin(2 * angle_in), np.cos(2 * angle_out), np.sin(2 * angle_out)],
            axis=-1,
        )
        turned = np.empty(mueller.shape)
        turned_variance.turn(
            np.ascontiguousarray(mueller, np.float64),
            np.ascontiguousarray(variance, np.float64),
            turns,
            np.ascontiguousarray(self.solution.reduction),
            np.ascontiguousarray(self.solution.measurement),
            self.exposures_s,
            self.saturation,
            self.dn_per_electron,
            self.read_noise_dn,
            self.read_noise_dn**2 / self.darks if self.darks else 0.0,
            turned,
        )
        return turned
