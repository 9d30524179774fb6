"""Stokes vectors as colours: how much is polarised, how it vibrates, which way it turns, of what type.

The four pictures of Wilkie & Weidlich 2010, *A standardised polarisation visualisation for images*, in the
colours of Mitsuba's polarisation viewer and of the figures of Baek et al. 2020.
"""

from __future__ import annotations

import numpy as np

from pbrdf.optics.stokes import degree_of_polarisation, type_of_polarisation
from pbrdf.report.figures import Float


def degree_colours(stokes: Float) -> Float:
    """Red as bright as the light is polarised (DoP), shape (..., 3) for Stokes vectors (..., 4)."""
    dop = degree_of_polarisation(stokes)
    return _rgb(dop, np.zeros_like(dop), np.zeros_like(dop))


def orientation_colours(stokes: Float) -> Float:
    """Green and red for s1 above and below zero, yellow and blue for s2, by the linear share."""
    linear, _ = type_of_polarisation(stokes)
    s1, s2 = (stokes[..., k] / stokes[..., 0] * linear for k in (1, 2))
    yellow = np.maximum(s2, 0)
    return _rgb(np.maximum(-s1, 0) + yellow, np.maximum(s1, 0) + yellow, np.maximum(-s2, 0))


def chirality_colours(stokes: Float) -> Float:
    """Blue for right circular light, s3 > 0, and yellow for left, by the circular share."""
    _, circular = type_of_polarisation(stokes)
    s3 = stokes[..., 3] / stokes[..., 0] * circular
    left = np.maximum(-s3, 0)
    return _rgb(left, left, np.maximum(s3, 0))


def type_colours(stokes: Float) -> Float:
    """Cyan for linear and yellow for circular light, as bright as the light is polarised."""
    linear, circular = type_of_polarisation(stokes)
    dop = degree_of_polarisation(stokes)
    return _rgb(circular * dop, (linear + circular) * dop, linear * dop)


def _rgb(red: Float, green: Float, blue: Float) -> Float:
    return np.clip(np.stack([red, green, blue], axis=-1), 0.0, 1.0)
