"""What a fit has to say in words: bounds, parameters that are not determined, what no parameter can do."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pbrdf.fitting.objective import Objective
from pbrdf.fitting.residuals import Residuals, band_difference
from pbrdf.fitting.uncertainty import Uncertainty, correlations
from pbrdf.models.interface import CostKind, Parameter

Float = NDArray[np.float64]

_TOGETHER = 0.9
"""Correlation from which two parameters are told together."""
_RETARDING = 0.02
"""Mean of (M32 − M23)/2, over the mean of M00, from which a surface retards like a metal."""
_BEYOND_NOISE = 2.0
"""Weighted squares per degree of freedom, which noise alone makes 1, from which a model is called wrong."""


class Labels:
    """What each entry of a parameter vector is called.

    Parameters
    ----------
    objective : Objective
        Whose layout it is.
    wavelengths : ndarray, shape (B,)
        nm.
    """

    def __init__(self, objective: Objective, wavelengths: Float) -> None:
        self.names: dict[int, str] = {}
        self.parameters: dict[int, Parameter] = {}
        for band in range(objective.bands):
            for entry, parameter in zip(
                objective.band_entries(band), objective.model.parameters, strict=True
            ):
                place = "" if parameter.shared else f" at {wavelengths[band]:g} nm"
                self.names[int(entry)] = parameter.name + place
                self.parameters[int(entry)] = parameter


def bounds_met(objective: Objective, vector: Float, labels: Labels) -> tuple[str, ...]:
    """Tell which parameters ended on a bound."""
    sentences = []
    for side, bounds in (("lower", objective.lower), ("upper", objective.upper)):
        for entry in map(int, np.flatnonzero(vector == bounds)):
            sentences.append((entry, f"{labels.names[entry]} ended on its {side} bound {bounds[entry]:g}"))
    return tuple(sentence for _, sentence in sorted(sentences))


def undetermined(vector: Float, uncertainty: Uncertainty, labels: Labels) -> tuple[str, ...]:
    """Tell which parameters the table does not, or hardly, determine."""
    sentences = [
        f"{labels.names[int(entry)]} is not determined: the other parameters leave it no effect"
        for entry in np.flatnonzero(uncertainty.without_effect)
    ]
    for group in uncertainty.ambiguous:
        names = ", ".join(labels.names[entry] for entry in group)
        sentences.append(f"{names} are not determined: they can change together while nothing else does")
    partners = correlations(uncertainty.covariance)
    for entry, error in enumerate(uncertainty.standard_errors):
        if not _is_wide(labels.parameters[entry], vector[entry], error):
            continue
        sentence = f"{labels.names[entry]} is hardly determined: {vector[entry]:.3g} ± {error:.2g}"
        partner, correlation = partners.get(entry, (entry, 0.0))
        if abs(correlation) > _TOGETHER:
            sentence += f"; it moves together with {labels.names[partner]} (correlation {correlation:.3f})"
        sentences.append(sentence)
    return tuple(sentences)


def remarks(
    objective: Objective, vector: Float, found: Residuals, uncertainty: Uncertainty, wavelengths: Float
) -> tuple[str, ...]:
    """Tell what else a reader of the fit should know."""
    sentences = [*_retardance(objective, vector, wavelengths), *_below_zero(objective, wavelengths)]
    if objective.kind is CostKind.ROOTS:
        sentences.append(
            "No standard errors: the sum of roots has a cusp at every residual of zero, and no Hessian there"
        )
    if objective.kind is CostKind.SQUARES:
        known = int(np.isfinite(uncertainty.standard_errors).sum())
        reduced = found.cost / max(16 * sum(found.nodes) - known, 1)
        if reduced > _BEYOND_NOISE:
            sentences.append(
                f"The weighted squares are {reduced:.3g} times what the table's variances predict: "
                "what is left over is the model's error, and standard errors do not tell of it"
            )
    return tuple(sentences)


def _is_wide(parameter: Parameter, value: float, error: float) -> bool:
    """Whether ± two standard errors cover half the bounds, or as much as the value itself.

    A weight that cannot be told from zero is no more than that: a bound of half the range remains.
    """
    if not np.isfinite(error):
        return False
    half_range = (parameter.upper - parameter.lower) / 2
    return 4 * error > half_range or (2 * error > value and not np.isfinite(half_range))


def _retardance(objective: Objective, vector: Float, wavelengths: Float) -> list[str]:
    """One sentence if the table retards like a metal and the model, with a real index, cannot."""
    if any(p.name == "kappa" for p in objective.model.parameters):
        return []
    shares = {}
    for band in range(objective.bands):
        _, table = band_difference(objective, vector, band)
        share = np.mean(table[:, 3, 2] - table[:, 2, 3]) / (2 * np.mean(table[:, 0, 0]))
        if share > _RETARDING:
            shares[f"{wavelengths[band]:g} nm"] = float(share)
    if not shares:
        return []
    most = max(shares.values())
    return [
        f"The table retards like a metal at {', '.join(shares)}: (M32 − M23)/2 is on average up to "
        f"{100 * most:.2g} % of M00. A real index has M23 = M32 = 0 and cannot follow; fit the form with a "
        f"complex index, {objective.model.name}_complex"
    ]


def _below_zero(objective: Objective, wavelengths: Float) -> list[str]:
    sentences = []
    for band, nm in enumerate(wavelengths):
        known = objective.nodes.mueller[band, objective.nodes.weight[band] > 0, 0, 0]
        if negative := int(np.count_nonzero(known < 0)):
            sentences.append(f"M00 is negative at {negative} of {len(known)} nodes at {nm:g} nm")
    return sentences
