"""A measured Mueller matrix held against the ideal one of its element."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf.formats.documents import numbers, positive
from pbrdf.reconstruction.lamp import LampMatrix

Float = NDArray[np.float64]

MATRICES = ("mueller", "standard_error", "scatter", "drift_error", "ideal")


@dataclass(frozen=True)
class Comparison:
    """The lamp's matrix as measured and the element's ideal one, both divided by M00: without unit.

    Attributes
    ----------
    measured : LampMatrix
    ideal : ndarray, shape (4, 4)
    drift_error : ndarray, shape (4, 4)
        Standard error that `measured` has from the correction for the lamp's drift; all pixels share it.
    """

    measured: LampMatrix
    ideal: Float
    drift_error: Float

    @property
    def deviation(self) -> Float:
        """Measured − ideal, shape (4, 4)."""
        return self.measured.mueller - self.ideal

    @property
    def error(self) -> Float:
        """Standard error of the deviation, shape (4, 4).

        The larger of that from the stored variances, which takes elements as uncorrelated, and that
        from the scatter over the pixels, which knows their covariance with M00. Neither knows of an
        error that all pixels share: that of the lamp's drift is added in quadrature.
        """
        by_scatter = self.measured.scatter / np.sqrt(self.measured.pixels)
        error: Float = np.hypot(np.maximum(self.measured.standard_error, by_scatter), self.drift_error)
        return error

    @property
    def place(self) -> tuple[int, int]:
        """Row and column of the largest deviation."""
        row, column = divmod(int(np.abs(self.deviation).argmax()), 4)
        return row, column

    @property
    def largest(self) -> float:
        """Largest absolute deviation."""
        return float(np.abs(self.deviation).max())

    @property
    def largest_error(self) -> float:
        """Standard error of the element that deviates most."""
        return float(self.error[self.place])

    @property
    def rms(self) -> float:
        """Root mean square of the sixteen deviations."""
        return float(np.sqrt(np.mean(self.deviation**2)))

    @property
    def noise_rms(self) -> float:
        """What `rms` would be about if there were nothing but noise."""
        return float(np.sqrt(np.mean(self.error**2)))

    @property
    def in_errors(self) -> float:
        """Largest deviation in standard errors of its element, M00 left out: it is one by definition."""
        ratios = np.abs(self.deviation.ravel()[1:]) / self.error.ravel()[1:]
        return float(ratios.max())

    def plain(self) -> dict[str, Any]:
        """As a document holds it: what was measured, then what follows from it."""
        measured = self.measured
        return {
            "pixels": measured.pixels,
            "m00_dn_per_s": measured.m00_dn_per_s,
            "mueller": measured.mueller.ravel().tolist(),
            "standard_error": measured.standard_error.ravel().tolist(),
            "scatter": measured.scatter.ravel().tolist(),
            "drift_error": self.drift_error.ravel().tolist(),
            "ideal": self.ideal.ravel().tolist(),
            "deviation_max": self.largest,
            "deviation_max_standard_error": self.largest_error,
            "deviation_max_element": f"M{self.place[0]}{self.place[1]}",
            "deviation_rms": self.rms,
            "deviation_rms_of_noise": self.noise_rms,
            "deviation_max_in_standard_errors": self.in_errors,
        }

    @classmethod
    def from_plain(cls, path: str | Path, content: Mapping[str, Any], field: str) -> Comparison:
        """Undo `plain` at a dotted `field` of a document; raises `InputError` where that is damaged."""
        mueller, standard_error, scatter, drift_error, ideal = (
            np.array(numbers(path, content, f"{field}.{name}", 16)).reshape(4, 4) for name in MATRICES
        )
        m00 = positive(path, content, f"{field}.m00_dn_per_s")
        pixels = int(positive(path, content, f"{field}.pixels"))
        return cls(LampMatrix(mueller, standard_error, scatter, m00, pixels), ideal, drift_error)


def worst(comparisons: Sequence[Comparison]) -> Comparison:
    """Comparison with the largest deviation."""
    return max(comparisons, key=lambda each: each.largest)


def rms_over(comparisons: Sequence[Comparison]) -> float:
    """Root mean square of the deviations of several matrices."""
    return float(np.sqrt(np.mean([each.rms**2 for each in comparisons])))
