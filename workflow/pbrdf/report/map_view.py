"""The maps of an image's page, each with the words that say what it is of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf.report.cyclic import half_turn
from pbrdf.report.figures import Float, Picture, number
from pbrdf.report.map_pictures import eigenvalue_scale, map_picture, range_scale, share_scale
from pbrdf.report.scalar_maps import CERTAIN, ScalarMaps

NOISE_UNKNOWN = "The noise of this image is not known: weak pixels are drawn like the others."


@dataclass(frozen=True)
class MapView:
    """A map and its caption."""

    picture: Picture
    words: str


def map_views(shown: ScalarMaps, every: ScalarMaps, title: str) -> list[MapView]:
    """Draw the maps of an image.

    Parameters
    ----------
    shown : ScalarMaps
        What is drawn: of the mean matrices of blocks.
    every : ScalarMaps
        What the words are of: every pixel by itself.
    title : str
        Band and light.
    """
    return [
        MapView(
            map_picture(f"DoLP, {title}", shown.dolp, share_scale(shown.dolp, "DoLP, no unit")),
            "Degree of linear polarisation (DoLP) of the light that comes back when unpolarised light "
            f"falls in: √(M10² + M20²)/M00. {spread(every.dolp)} {_noise_floor(every)}",
        ),
        MapView(
            map_picture(f"AoLP, {title}", np.degrees(shown.aolp), half_turn("AoLP, °"), shown.aolp_weak),
            "Angle of linear polarisation (AoLP) of that light: from the x axis of the analyser's frame, "
            "counter-clockwise to one who looks into the beam, as the camera does. 0° and 180° are the same. "
            + _weak(
                every,
                every.aolp_weak,
                f"a DoLP below {CERTAIN:g} standard errors, the angle known to "
                f"±{number(np.degrees(0.5 / CERTAIN), 2)}° or worse",
            ),
        ),
        MapView(
            map_picture(f"DoCP, {title}", shown.docp, share_scale(shown.docp, "DoCP, no unit")),
            f"Degree of circular polarisation (DoCP) of that light: |M30|/M00. {spread(every.docp)}",
        ),
        MapView(
            map_picture(
                f"Depolarisation power, {title}",
                shown.depolarisation,
                range_scale(shown.depolarisation, 0.1, 1.0, "depolarisation power Δ, no unit"),
            ),
            "Lu and Chipman's depolarisation power Δ of the matrix: 0 where polarised light stays as "
            f"polarised as it was, 1 for an ideal depolariser. {spread(every.depolarisation)}",
        ),
        MapView(
            map_picture(
                f"Depolarisation index, {title}",
                shown.depolarisation_index,
                share_scale(shown.depolarisation_index, "depolarisation index DI, no unit"),
            ),
            "Gil and Bernabeu's depolarisation index DI of the matrix, which runs the other way: 1 for a "
            "matrix that depolarises nothing, 0 for an ideal depolariser. "
            + spread(every.depolarisation_index),
        ),
        MapView(_physicality(shown, title), _physicality_words(every)),
        MapView(
            map_picture(
                f"Diattenuation, {title}",
                shown.diattenuation,
                share_scale(shown.diattenuation, "diattenuation D, no unit"),
            ),
            "Diattenuation D: contrast, (largest − smallest)/(largest + smallest), of what comes back over "
            f"all polarisations that may fall in; 1 for a polariser. {spread(every.diattenuation)}",
        ),
        MapView(
            map_picture(
                f"Retardance, {title}",
                np.degrees(shown.retardance),
                range_scale(_strong_retardance(shown), 10.0, 180.0, "retardance R, °"),
                shown.retardance_weak,
            ),
            "Lu and Chipman's retardance R: by how much the matrix turns the Poincaré sphere. A mirror has "
            f"180°, since it reverses s2 and s3. {spread(_strong_retardance(every), '°')} "
            + _weak(
                every,
                every.retardance_weak,
                f"less kept of one direction of the sphere than {CERTAIN:g} standard errors of an element, "
                "the turn not known",
            ),
        ),
    ]


def quantities(every: ScalarMaps) -> list[dict[str, Any]]:
    """Median and quartiles over the pixels that are known, and not weak; NaN where there are none."""
    rows = [
        ("DoLP", "", every.dolp),
        ("standard error of the DoLP", "", every.dolp_error),
        ("DoCP", "", every.docp),
        ("depolarisation power Δ", "", every.depolarisation),
        ("depolarisation index DI", "", every.depolarisation_index),
        ("diattenuation D", "", every.diattenuation),
        ("retardance R", "°", _strong_retardance(every)),
    ]
    return [{"name": name, "unit": unit, "quartiles": quartiles(values)} for name, unit, values in rows]


def quartiles(values: Float) -> tuple[float, float, float]:
    """Lower quartile, median, upper quartile of the known values; NaN if none is known."""
    known = values[np.isfinite(values)]
    if not known.size:
        return (float("nan"),) * 3
    low, middle, high = (float(v) for v in np.percentile(known, [25, 50, 75]))
    return low, middle, high


def spread(values: Float, unit: str = "") -> str:
    """Median and middle half in words."""
    low, middle, high = (number(v) + unit for v in quartiles(values))
    return f"Median {middle}; the middle half of the pixels lies from {low} to {high}."


def _strong_retardance(maps: ScalarMaps) -> Float:
    """Degrees; NaN where it is noise."""
    return np.where(maps.retardance_weak, np.nan, np.degrees(maps.retardance))


def _noise_floor(every: ScalarMaps) -> str:
    error = quartiles(every.dolp_error)[1]
    if not np.isfinite(error):
        return NOISE_UNKNOWN
    # Rayleigh's distribution: two components of equal noise and no signal
    return f"Noise alone would bring a pixel to {number(error * np.sqrt(np.pi / 2), 2)}."


def _weak(every: ScalarMaps, weak: NDArray[np.bool_], reason: str) -> str:
    if not np.isfinite(every.dolp_error).any():
        return NOISE_UNKNOWN
    percent = number(100 * every.share_of_known(weak))
    return f"Light grey: {reason}. Of the pixels by themselves, {percent}\u00a0% are so weak."


def _physicality(shown: ScalarMaps, title: str) -> Picture:
    eigenvalue = shown.smallest_eigenvalue
    # rounding may leave a pure state's slightly negative
    eigenvalue = np.where(shown.physical, np.maximum(eigenvalue, 0.0), eigenvalue)
    scale = eigenvalue_scale("smallest eigenvalue/M00, no unit")
    return map_picture(f"Physicality, {title}", eigenvalue, scale)


def _physicality_words(every: ScalarMaps) -> str:
    words = (
        "Smallest eigenvalue of the coherency matrix, divided by M00: negative, and vermilion, where no sum "
        "of Jones matrices makes the matrix; 0 for a matrix that depolarises nothing, 0.25 for an ideal "
        "depolariser. "
    )
    words += f"Physical: {number(100 * every.share_of_known(every.physical), 4)}\u00a0% of the pixels."
    error = quartiles(every.eigenvalue_error)[1]
    if np.isfinite(error):
        words += f" Noise alone moves an eigenvalue by {number(error, 2)}: what depolarises little may fail."
    return words
