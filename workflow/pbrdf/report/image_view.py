"""The parts of an image's page: sixteen panels, maps of the decomposition, and how it was solved."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf.errors import InputError
from pbrdf.report.figures import number
from pbrdf.report.map_view import map_views, quantities, quartiles
from pbrdf.report.mueller_image import (
    MOST_PIXELS,
    block_counts,
    block_for,
    block_means,
    image_panels,
    median_diagonal,
)
from pbrdf.report.scalar_maps import ScalarMaps, scalar_maps
from pbrdf.report.solution_figures import solution_figures

MOST_MAP_PIXELS = 320
"""Longest side of a map, which the screen shows about twice as large as one of sixteen panels."""

MOST_DRAWN = 5
"""Images with pictures on a page: of nothing but noise they fill 1.5 MB each."""


@dataclass(frozen=True)
class MuellerImage:
    """A Mueller image and what is known of how it was solved for.

    Attributes
    ----------
    mueller : array_like, shape (16, rows, cols) or (4, 4, rows, cols)
        Elements in `unit`; NaN where missing.
    unit : str
        Unit of M00: "DN/s", "1/sr".
    title : str
        Band and light, in words.
    variance : array_like of the same shape, or None
        Of the elements, in the square of `unit`; NaN or None where not known.
    summary : mapping
        Figures of the solution, as the receipt names them.
    """

    mueller: ArrayLike
    unit: str
    title: str
    variance: ArrayLike | None = None
    summary: Mapping[str, Any] = field(default_factory=dict)

    @property
    def by_pixel(self) -> NDArray[np.floating]:
        """Elements in the shape (rows, cols, 4, 4)."""
        return _by_pixel("mueller", self.mueller)

    @property
    def variance_by_pixel(self) -> NDArray[np.floating]:
        """Variances in the same shape."""
        if self.variance is None:
            return np.full_like(self.by_pixel, np.nan)
        return _by_pixel("variance", self.variance)


def image_views(images: Iterable[MuellerImage]) -> list[dict[str, Any]]:
    """Gather what the page's template shows of images, taken one at a time; the first few have pictures.

    Raises
    ------
    InputError
        If an image has another shape.
    """
    return [_image_view(image, drawn=place < MOST_DRAWN) for place, image in enumerate(images)]


def _image_view(image: MuellerImage, *, drawn: bool) -> dict[str, Any]:
    mueller, variance = image.by_pixel, image.variance_by_pixel
    every = scalar_maps(mueller, variance)
    return {
        "title": image.title,
        "rows": mueller.shape[0],
        "cols": mueller.shape[1],
        "unit": image.unit,
        "words": _words(image, every),
        "key_figures": _key_figures(image, every),
        "median_diagonal": median_diagonal(mueller),
        "quantities": quantities(every),
        "physical_percent": 100 * every.share_of_known(every.physical),
        "known_percent": 100 * float(every.known.mean()),
        "figures": solution_figures(image.summary, image.unit),
        "pictures": _pictures(image, mueller, variance, every) if drawn else None,
    }


def _pictures(
    image: MuellerImage, mueller: NDArray[np.floating], variance: NDArray[np.floating], every: ScalarMaps
) -> dict[str, Any]:
    block = block_for(mueller.shape[:2], MOST_MAP_PIXELS)
    counts = np.maximum(block_counts(mueller, block), 1.0)[..., None, None]
    shown = scalar_maps(block_means(mueller, block), block_means(variance, block) / counts)
    return {
        "panels": image_panels(mueller, image.unit, image.title),
        "panel_block": block_for(mueller.shape[:2], MOST_PIXELS),
        "maps": map_views(shown, every, image.title),
        "map_block": block,
    }


def _words(image: MuellerImage, every: ScalarMaps) -> str:
    if not every.known.any():
        return f"At {image.title} no pixel is known."
    words = (
        f"At {image.title}, unpolarised light comes back with a median degree of linear polarisation of "
        f"{number(quartiles(every.dolp)[1], 2)}, and the median depolarisation power is "
        f"{number(quartiles(every.depolarisation)[1], 2)}; "
    )
    physical = every.share_of_known(every.physical)
    if physical == 1.0:
        words += "every matrix is physical."
    else:
        words += f"{number(100 * physical, 4)}\u00a0% of the matrices are physical."
    residual = image.summary.get("residual_rms")
    if residual is not None:
        words += f" The measured intensities are met within {number(residual)} {image.unit} rms."
    return words


def _key_figures(image: MuellerImage, every: ScalarMaps) -> list[dict[str, Any]]:
    figures = [
        ("residual_rms", image.unit, "residual, rms"),
        ("condition", "", "condition number (no unit)"),
    ]
    shown: list[dict[str, Any]] = [
        {"value": image.summary[key], "unit": unit, "digits": 4, "label": label}
        for key, unit, label in figures
        if key in image.summary
    ]
    return [
        {
            "value": quartiles(every.dolp)[1],
            "unit": "",
            "digits": 3,
            "label": "median DoLP of what comes back of unpolarised light (no unit)",
        },
        {
            "value": quartiles(every.depolarisation)[1],
            "unit": "",
            "digits": 3,
            "label": "median depolarisation power Δ (no unit)",
        },
        {
            "value": 100 * every.share_of_known(every.physical),
            "unit": "%",
            "digits": 4,
            "label": "of the known pixels have a physical matrix",
        },
        *shown,
    ]


def _by_pixel(name: str, elements: ArrayLike) -> NDArray[np.floating]:
    m = np.asarray(elements)
    if m.dtype.kind != "f":
        m = m.astype(np.float64)
    if m.ndim == 3 and m.shape[0] == 16:
        m = m.reshape(4, 4, *m.shape[1:])
    if m.ndim != 4 or m.shape[:2] != (4, 4):
        remedy = "give (16, rows, cols) or (4, 4, rows, cols)"
        raise InputError("report", name, f"has shape {m.shape}", remedy)
    return np.moveaxis(m, (0, 1), (2, 3))
