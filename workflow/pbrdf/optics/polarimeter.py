"""Polarisation state generator and analyser (PSG, PSA), and the matrix that links them to a sample."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf.optics.mueller import linear_polariser, linear_retarder

Float = NDArray[np.float64]


@dataclass(frozen=True)
class Polarimeter:
    """Polariser and retarder on either side of the sample, in one band.

    Attributes
    ----------
    generator_retardance, analyser_retardance : float
        δ of the two retarders, radians.
    zeros : tuple of four float
        Angle of the axis of generator polariser, generator retarder, analyser retarder and
        analyser polariser where its scale reads zero, radians, in the frames of the modules.
    extinction : float
        Share of light across the axis that both polarisers let through; 0 is ideal.
    """

    generator_retardance: float
    analyser_retardance: float
    zeros: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    extinction: float = 0.0

    def generated(self, states: ArrayLike) -> Float:
        """Stokes vectors g = Q P (1, 0, 0, 0)ᵀ that leave the generator, shape (N, 4)."""
        polariser, retarder, _, _ = self._axes(states)
        g: Float = (
            linear_retarder(self.generator_retardance, retarder)
            @ linear_polariser(polariser, self.extinction)
        )[..., 0]
        return g

    def analysed(self, states: ArrayLike) -> Float:
        """First rows a of P Q, so that the detector sees a · s; shape (N, 4)."""
        _, _, retarder, polariser = self._axes(states)
        a: Float = (
            linear_polariser(polariser, self.extinction) @ linear_retarder(self.analyser_retardance, retarder)
        )[..., 0, :]
        return a

    def measurement_matrix(self, states: ArrayLike) -> Float:
        """Rows a ⊗ g, so that intensities are W · vec(M) with M row-major.

        Parameters
        ----------
        states : array_like, shape (N, 4)
            Scale readings of generator polariser, generator retarder, analyser retarder and
            analyser polariser, radians.

        Returns
        -------
        ndarray, shape (N, 16)
            Goldstein & Chipman 1990; Chenault et al. 1992.
        """
        a, g = self.analysed(states), self.generated(states)
        w: Float = (a[:, :, None] * g[:, None, :]).reshape(len(a), 16)
        return w

    def _axes(self, states: ArrayLike) -> Float:
        """True angles of the four axes, shape (4, N), radians."""
        readings = np.asarray(states, dtype=np.float64)
        axes: Float = (readings + np.asarray(self.zeros)).T
        return axes
