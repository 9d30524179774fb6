"""Slices of a table as data: every node in a JSON document, and fewer in scripts that a page draws."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pbrdf.fitting import FitResult
from pbrdf.formats.documents import write_document, write_text
from pbrdf.formats.folders import replace_folder
from pbrdf.formats.table_data import TableData
from pbrdf.report.figures import Float
from pbrdf.report.fit_view import model_at, model_title
from pbrdf.report.mueller_panels import difference_limits, first_limits, normalised_by_first
from pbrdf.report.scales import GAMMA, bar_colours
from pbrdf.report.visibility import visible_nodes

KIND = "slices/1"
SYMBOLS = {"theta_d": "θd", "phi_d": "φd"}
MOST_DRAWN = 46
"""Nodes of an axis that the page draws: sixteen panels side by side have no room for more."""


@dataclass(frozen=True)
class TableSlice:
    """Nodes of a table at one θd or one φd, all bands.

    Attributes
    ----------
    held, across : {"theta_d", "phi_d"}
        The angle that is held, and the one that runs beside θh.
    node : int
        Of the angle that is held.
    """

    held: Literal["theta_d", "phi_d"]
    across: Literal["theta_d", "phi_d"]
    node: int

    def label(self, table: TableData) -> str:
        """Such as ``θd = 30°``."""
        return f"{SYMBOLS[self.held]} = {self.held_deg(table):.4g}°"

    def held_deg(self, table: TableData) -> float:
        """Angle that is held."""
        return float(np.degrees(getattr(table, self.held)[self.node]))

    def of(self, values: NDArray[Any]) -> NDArray[Any]:
        """Cut arrays (H, D, P, ...) to (H, N, ...)."""
        return values[:, self.node] if self.held == "theta_d" else values[:, :, self.node]


def write_slices(path: str | Path, table: TableData, slices: Sequence[TableSlice]) -> None:
    """Write every node of some slices as a document of schema ``pbrdf/slices/1``.

    Elements are little-endian float32 in base64, in the order (band, θh, other angle, row, column), 1/sr; NaN
    where nothing is known, −∞ where light or camera would be below the horizon.
    """
    content: dict[str, Any] = {
        "frames": "light and camera, x along L × V; no cosine",
        "wavelengths": {"unit": "nm", "values": table.wavelengths_nm.tolist()},
        "theta_h": {"unit": "deg", "values": np.degrees(table.theta_h).tolist()},
    }
    content["slices"] = [
        {
            "label": each.label(table),
            each.held: {"unit": "deg", "value": each.held_deg(table)},
            each.across: {"unit": "deg", "values": np.degrees(getattr(table, each.across)).tolist()},
            "mueller": {
                "unit": "1/sr",
                "dtype": "<f4",
                "shape": [len(table.wavelengths_nm), *each.of(table.mueller[0]).shape],
                "base64": _encoded(np.stack([_marked(table, each, b) for b in _bands(table)])),
            },
        }
        for each in slices
    ]
    write_document(path, KIND, content)


@dataclass(frozen=True)
class DrawnSlice:
    """Nodes of a slice that a page draws.

    Attributes
    ----------
    cut : TableSlice
    held_deg : float
    across_deg : list of float
    sources : tuple of ndarray, shape (B, H, N, 4, 4), float32
        The table's matrices and, where there is a fit, the model's; marked as in the document.
    """

    cut: TableSlice
    held_deg: float
    across_deg: list[float]
    sources: tuple[NDArray[np.float32], ...]

    def about(self) -> dict[str, Any]:
        """What the page holds of it: angles, and the ends of its scales over all bands."""
        shown = [normalised_by_first(np.where(np.isinf(s), np.nan, s)) for s in self.sources]
        told: dict[str, Any] = {
            "held": SYMBOLS[self.cut.held],
            "held_deg": self.held_deg,
            "across": SYMBOLS[self.cut.across],
            "across_deg": self.across_deg,
            "first": first_limits(shown[0][..., 0, 0]),
        }
        if len(shown) > 1:
            told["difference"] = difference_limits(*shown)
        return told


@dataclass(frozen=True)
class Panels:
    """Slices that a page's controls choose from.

    The values are in scripts of their own, one a slice and band: a page that is opened from the disk may load
    scripts, but no data, and only what is looked at needs to be loaded.

    Attributes
    ----------
    address : str
        Relative address of the folder of scripts; the document of whole slices is ``<address>.json``.
    wavelengths_nm, theta_h_deg : list of float
    titles : list of str
        Table, and the model where there is one.
    slices : list of DrawnSlice
    opens : list of int
        Slices that the page begins with, one for each angle that is held; the document holds them whole.
    every_node : bool
        Whether every node is drawn.
    """

    address: str
    wavelengths_nm: list[float]
    theta_h_deg: list[float]
    titles: list[str]
    slices: list[DrawnSlice]
    opens: list[int]
    every_node: bool

    def about(self) -> dict[str, Any]:
        """What the page itself holds."""
        signed, size = bar_colours()
        return {
            "address": self.address,
            "wavelengths_nm": self.wavelengths_nm,
            "theta_h_deg": self.theta_h_deg,
            "sources": self.titles,
            "slices": [drawn.about() for drawn in self.slices],
            "opens": self.opens,
            "every_node": self.every_node,
            "gamma": GAMMA,
            "signed": signed,
            "size": size,
        }

    def write(self, folder: str | Path) -> None:
        """Write the scripts, which take the place of what is in `folder`."""
        with replace_folder(folder) as beside:
            for index, drawn in enumerate(self.slices):
                for band in range(len(self.wavelengths_nm)):
                    values = [_encoded(source[band]) for source in drawn.sources]
                    text = f"panelValues({index}, {band}, {json.dumps(values)});\n"
                    write_text(beside / f"slice{index}_band{band}.js", text)


def drawn_panels(
    address: str,
    table: TableData,
    fit: FitResult | None,
    slices: Sequence[TableSlice],
    opens: Sequence[TableSlice],
) -> Panels:
    """Cut slices out of table and fit, on every few nodes; `opens` are some of them."""
    halves = _drawn(len(table.theta_h))
    return Panels(
        address=address,
        wavelengths_nm=table.wavelengths_nm.tolist(),
        theta_h_deg=np.degrees(table.theta_h[halves]).tolist(),
        titles=["Table"] if fit is None else ["Table", model_title(fit.model)],
        slices=[_drawn_slice(table, fit, each, halves) for each in slices],
        opens=[slices.index(each) for each in opens],
        every_node=max(len(table.theta_h), len(table.theta_d), len(table.phi_d)) <= MOST_DRAWN,
    )


def _drawn_slice(
    table: TableData, fit: FitResult | None, each: TableSlice, halves: NDArray[np.intp]
) -> DrawnSlice:
    along = _drawn(len(getattr(table, each.across)))
    sources = [np.stack([_marked(table, each, band)[np.ix_(halves, along)] for band in _bands(table)])]
    if fit is not None:
        sources.append(np.stack([_model(table, fit, each, band, halves, along) for band in _bands(table)]))
    across_deg = np.degrees(getattr(table, each.across)[along]).tolist()
    return DrawnSlice(each, each.held_deg(table), across_deg, tuple(sources))


def _marked(table: TableData, each: TableSlice, band: int) -> NDArray[np.float32]:
    """Matrices (H, N, 4, 4) of a slice, with −∞ where nothing can be seen."""
    values = np.array(each.of(table.mueller[band]), dtype=np.float32)
    values[~each.of(visible_nodes(table, band))] = -np.inf
    return values


def _model(
    table: TableData,
    fit: FitResult,
    each: TableSlice,
    band: int,
    halves: NDArray[np.intp],
    along: NDArray[np.intp],
) -> NDArray[np.float32]:
    held = np.asarray(getattr(table, each.held)[each.node])
    angles = {each.held: held, each.across: getattr(table, each.across)[along][None, :]}
    theta_h = table.theta_h[halves][:, None]
    values = model_at(fit, band, theta_h, angles["theta_d"], angles["phi_d"]).astype(np.float32)
    values[~each.of(visible_nodes(table, band))[np.ix_(halves, along)]] = -np.inf
    return values


def _bands(table: TableData) -> range:
    return range(len(table.wavelengths_nm))


def _drawn(length: int) -> NDArray[np.intp]:
    """Nodes that are drawn: evenly spaced ones, both ends among them where that can be."""
    step = -(-(length - 1) // (MOST_DRAWN - 1)) if length > MOST_DRAWN else 1
    return np.arange(0, length, step)


def _encoded(values: NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode("ascii")


def decoded(text: str, shape: Sequence[int]) -> Float:
    """Read back what `write_slices` wrote."""
    return np.frombuffer(base64.b64decode(text), "<f4").reshape(shape).astype(np.float64)
