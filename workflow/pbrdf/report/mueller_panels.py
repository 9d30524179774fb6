"""A table's slice at one θd as sixteen panels: table, model and their difference."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pbrdf.formats.table_data import TableData
from pbrdf.report.figures import THETA_H_TICKS, Float, Picture, number, picture, raster
from pbrdf.report.scales import Scale, logarithmic, round_up, signed, signed_gamma
from pbrdf.report.sixteen import draw_bars, draw_sixteen
from pbrdf.report.visibility import visible_nodes

SIZE = (5.4, 5.7)
MOST_THETA_H = 91
PHI_D_TICKS = (-90.0, 0.0, 90.0)
MOST_PHI_D = 121
"""Pixels of a panel: a third of the published φd nodes is what a panel of 110 CSS pixels can show."""


@dataclass(frozen=True)
class Slice:
    """What a table says at one wavelength and one θd.

    Attributes
    ----------
    wavelength_nm, theta_d : float
        nm, radians.
    theta_h, phi_d : ndarray, shapes (H,), (P,)
        Node positions, radians.
    mueller : ndarray, shape (H, P, 4, 4)
        1/sr, table frames; NaN where nothing is known.
    visible : ndarray, shape (H, P), bool
        Light and camera are above the horizon.
    """

    wavelength_nm: float
    theta_d: float
    theta_h: Float
    phi_d: Float
    mueller: NDArray[np.floating]
    visible: NDArray[np.bool_]

    @property
    def known(self) -> Float:
        """Matrices of the visible nodes with a positive M00, NaN elsewhere, shape (H, P, 4, 4)."""
        m = np.asarray(self.mueller, dtype=np.float64)
        usable = self.visible & (m[..., 0, 0] > 0)
        return np.where(usable[..., None, None], m, np.nan)

    @property
    def where(self) -> str:
        """Wavelength and θd in words."""
        return f"{number(self.wavelength_nm, 4)} nm, θd = {number(np.degrees(self.theta_d))}°"


def slice_at(table: TableData, band: int, theta_d_node: int) -> Slice:
    """Slice of a table at node indices of wavelength and θd."""
    return Slice(
        wavelength_nm=float(table.wavelengths_nm[band]),
        theta_d=float(table.theta_d[theta_d_node]),
        theta_h=table.theta_h,
        phi_d=table.phi_d,
        mueller=table.mueller[band, :, theta_d_node],
        visible=visible_nodes(table, band)[:, theta_d_node],
    )


def normalised_by_first(mueller: NDArray[np.floating]) -> Float:
    """Divide elements (..., 4, 4) by M00 and leave M00 itself as it is."""
    m = np.array(mueller, dtype=np.float64)
    first = m[..., 0, 0].copy()
    with np.errstate(invalid="ignore", divide="ignore"):
        m /= first[..., None, None]
    m[..., 0, 0] = first
    return m


TITLES = ("Table", "Model", "Model − table")


def compared(
    measured: Slice, model: NDArray[np.floating] | None, titles: tuple[str, str, str] = TITLES
) -> list[Picture]:
    """Draw a slice and, where a model is given, the model and the difference.

    Parameters
    ----------
    measured : Slice
        The table's slice.
    model : ndarray, shape (H, P, 4, 4), or None
        The model, or another table, at the same nodes, 1/sr.
    titles : tuple of str
        Of the slice, the model and the difference.

    Returns
    -------
    list of Picture
        Table and model share their colours: M00 on one logarithmic scale in 1/sr, the other
        elements divided by M00. The difference is model − table: of M00 in percent of the
        table's, of the others as they are drawn.
    """
    reference = normalised_by_first(measured.known)
    scales = (_logarithmic(reference[..., 0, 0]), signed_gamma("Mij/M00"))
    pictures = [_block(titles[0], measured, reference, scales, "M00, 1/sr")]
    if model is None:
        return pictures
    shown = normalised_by_first(np.where(measured.visible[..., None, None], model, np.nan))
    pictures.append(_block(titles[1], measured, shown, scales, "M00, 1/sr"))
    difference = differences(reference, shown)
    first, others = difference_limits(reference, shown)
    scales = (signed(first, "ΔM00 / M00, %"), signed(others, "Δ(Mij/M00), no unit"))
    pictures.append(_block(titles[2], measured, difference, scales, "M00, %"))
    return pictures


def differences(reference: Float, shown: Float) -> Float:
    """Difference of matrices as `normalised_by_first` gives them: of M00 in % of the reference's."""
    difference = shown - reference
    with np.errstate(invalid="ignore", divide="ignore"):
        difference[..., 0, 0] *= 100.0 / reference[..., 0, 0]
    return difference


def difference_limits(reference: Float, shown: Float) -> tuple[float, float]:
    """Ends of the scales of these differences, of M00 and of the other elements."""
    difference = differences(reference, shown)
    first, others = difference[..., 0, 0], difference.reshape(-1, 16)[:, 1:]
    return min(100.0, _reach(first)), min(2.0, _reach(others))


def first_limits(values: Float) -> tuple[float, float]:
    """Ends of the logarithmic scale of M00."""
    known = values[np.isfinite(values) & (values > 0)]
    # a handful of nodes near zero must not take the scale
    low, high = (float(v) for v in np.percentile(known, [0.5, 100.0])) if known.size else (0.1, 1.0)
    return max(low, 1e-5 * high), high


def _block(title: str, where: Slice, values: Float, scales: tuple[Scale, Scale], first_title: str) -> Picture:
    across = raster(np.sqrt(np.degrees(where.theta_h)), MOST_THETA_H)
    up = raster(np.degrees(where.phi_d), MOST_PHI_D)
    pixels = np.ix_(across.nodes, up.nodes)
    visible = where.visible[pixels].T

    def paint(i: int, j: int) -> NDArray[np.uint8]:
        scale = scales[0] if i == j == 0 else scales[1]
        return scale.paint(values[..., i, j][pixels].T, visible)

    def draw(figure: Figure) -> None:
        figure.text(0.1, 0.985, f"{title}: {where.where}", fontsize=8.5, va="top", weight="bold")
        x_ticks = [(across.place(float(np.sqrt(tick))), f"{tick:g}") for tick in THETA_H_TICKS]
        y_ticks = [(up.place(tick), f"{tick:g}".replace("-", "−")) for tick in PHI_D_TICKS]
        draw_sixteen(figure, paint, first_title, left=0.1, bottom=0.15, x_ticks=x_ticks, y_ticks=y_ticks)
        figure.text(0.54, 0.1, "θh, ° (drawn over √θh)", fontsize=7.5, ha="center")
        figure.text(0.008, 0.55, "φd, °", fontsize=7.5, va="center", rotation=90)
        draw_bars(figure, scales, bottom=0.06)

    return picture(SIZE, draw, _words(title, where, values, first_title))


def _logarithmic(values: Float) -> Scale:
    return logarithmic(*first_limits(values), "M00, 1/sr (logarithmic)")


def _reach(values: Float) -> float:
    """Round limit that 99 % of the absolute values stay below."""
    known = np.abs(values[np.isfinite(values)])
    if known.size == 0:
        return 1.0
    return round_up(max(float(np.percentile(known, 99)), 1e-6))


def _words(title: str, where: Slice, values: Float, first_title: str) -> str:
    first = values[..., 0, 0]
    known = np.isfinite(first)
    text = f"{title}, sixteen panels over θh and φd at {where.where}; {np.count_nonzero(known)} of "
    text += f"{np.count_nonzero(where.visible)} visible nodes known."
    if not known.any():
        return text
    unit = first_title.rpartition(" ")[2]
    middle = np.median(values[known], axis=0)
    text += f" M00: median {number(middle[0, 0])} {unit}, from {number(float(first[known].min()))} to "
    diagonal = ", ".join(f"M{k}{k}/M00 {number(middle[k, k])}" for k in (1, 2, 3))
    return text + f"{number(float(first[known].max()))} {unit}. Medians: {diagonal}."
