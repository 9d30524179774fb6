"""A camera's noise and range, put together from photographs of an evenly bright field."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pbrdf.calibration.linearity import TOLERANCE, Linearity
from pbrdf.calibration.photon_transfer import PhotonTransfer, TransferPoint


@dataclass(frozen=True)
class Sensor:
    """Noise and range of raw values.

    Attributes
    ----------
    transfer : PhotonTransfer
    linearity : Linearity
    step_dn : float
        Step of the converter in stored values, DN; zero where none is known.
    saturation_dn : float
        Value that the frames themselves call saturated, DN.
    dark : tuple of TransferPoint
        Dark frames by exposure.
    dark_clipped_share : float
        Share of the dark values that lie at zero, where the converter clips their noise.
    darks_at_ends : bool
        Whether dark frames are from start and end of the run only.
    """

    transfer: PhotonTransfer
    linearity: Linearity
    step_dn: float
    saturation_dn: float
    dark: tuple[TransferPoint, ...]
    dark_clipped_share: float
    darks_at_ends: bool = False

    @property
    def read_noise_dn(self) -> float:
        """Noise of a value without signal, DN: not below that of rounding to the converter's steps."""
        # a step is the least even where dark values happen never to leave it
        return max(self.transfer.read_noise_dn, self.step_dn / 12**0.5)

    @property
    def noise(self) -> tuple[float, float]:
        """DN per electron, not below zero, and read noise in DN: what the weights of values follow from."""
        return max(self.transfer.dn_per_electron, 0.0), self.read_noise_dn

    @property
    def usable_below_dn(self) -> float:
        """Value from which on frames are not to be used, DN."""
        limit = self.linearity.limit_dn
        return self.saturation_dn if limit is None else min(limit, self.saturation_dn)

    def content(self) -> dict[str, Any]:
        """As ``radiometry.json`` tells it."""
        transfer, straight = self.transfer, self.linearity
        content: dict[str, Any] = {
            "dn_per_electron": transfer.dn_per_electron,
            "dn_per_electron_standard_error": transfer.dn_per_electron_error,
            "read_noise_dn": self.read_noise_dn,
            "read_noise_standard_error_dn": transfer.read_variance_error / (2 * self.read_noise_dn),
            "chi_square_per_freedom": transfer.chi_square_per_freedom,
        }
        if straight.limit_dn is not None:
            content["saturation_dn"] = self.usable_below_dn
        content["dark"] = [
            {"exposure_s": p.exposure_s, "level_dn": p.level_dn, "noise_dn": p.variance_dn2**0.5}
            for p in self.dark
        ]
        content["photon_transfer"] = [
            {
                "band_nm": point.band_nm,
                "exposure_s": point.exposure_s,
                "signal_dn": point.signal_dn,
                "variance_dn2": point.variance_dn2,
                "relative_residual": residual,
                "relative_standard_error": error,
            }
            for point, residual, error in zip(
                transfer.points, transfer.residuals, transfer.errors, strict=True
            )
        ]
        content["linearity"] = {
            "tolerance": TOLERANCE,
            "largest_deviation": straight.largest_deviation,
            "tested_to_dn": straight.tested_to_dn,
            "level_dn": straight.level_dn.tolist(),
            "deviation": straight.deviation.tolist(),
            "deviation_standard_error": straight.deviation_error.tolist(),
        }
        return content
