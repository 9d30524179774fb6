"""Slices of a table as data: every node in a JSON document, and fewer of them in the page that draws them."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pbrdf.fitting import FitResult
from pbrdf.formats.documents import write_document
from pbrdf.formats.table_data import TableData
from pbrdf.report.figures import Float
from pbrdf.report.fit_view import model_at, model_title
from pbrdf.report.mueller_panels import difference_limits, first_limits, normalised_by_first
from pbrdf.report.scales import GAMMA, bar_colours
from pbrdf.report.visibility import visible_nodes

KIND = "slices/1"
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
        symbol = {"theta_d": "θd", "phi_d": "φd"}[self.held]
        return f"{symbol} = {np.degrees(getattr(table, self.held)[self.node]):.4g}°"

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
            each.held: {"unit": "deg", "value": float(np.degrees(getattr(table, each.held)[each.node]))},
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


def panels_data(table: TableData, fit: FitResult | None, slices: Sequence[TableSlice]) -> Mapping[str, Any]:
    """What the page's script draws: slices of table and fit on every few nodes, colours and limits."""
    halves = _drawn(len(table.theta_h))
    drawn = [_slice_data(table, fit, each, halves) for each in slices]
    signed, size = bar_colours()
    return {
        "wavelengths_nm": table.wavelengths_nm.tolist(),
        "theta_h_deg": np.degrees(table.theta_h[halves]).tolist(),
        "sources": ["Table"] if fit is None else ["Table", model_title(fit.model)],
        "slices": drawn,
        "whole": max(len(table.theta_h), len(table.theta_d), len(table.phi_d)) <= MOST_DRAWN,
        "gamma": GAMMA,
        "signed": signed,
        "size": size,
    }


def _slice_data(
    table: TableData, fit: FitResult | None, each: TableSlice, halves: NDArray[np.intp]
) -> dict[str, Any]:
    along = _drawn(len(getattr(table, each.across)))
    nodes = np.ix_(halves, along)
    measured = [_marked(table, each, band)[nodes] for band in _bands(table)]
    sources = [measured]
    if fit is not None:
        sources.append([_model(table, fit, each, band, halves, along) for band in _bands(table)])
    known = [np.where(np.isinf(m), np.nan, m.astype(np.float64)) for m in measured]
    data: dict[str, Any] = {
        "label": each.label(table),
        "across": {"theta_d": "θd", "phi_d": "φd"}[each.across],
        "across_deg": np.degrees(getattr(table, each.across)[along]).tolist(),
        "first": first_limits(np.stack([normalised_by_first(m)[..., 0, 0] for m in known])),
        "values": [_encoded(np.stack(source)) for source in sources],
    }
    if fit is not None:
        pairs = [
            (normalised_by_first(m), normalised_by_first(np.where(np.isinf(s), np.nan, s)))
            for m, s in zip(known, sources[1], strict=True)
        ]
        data["difference"] = difference_limits(*(np.stack(side) for side in zip(*pairs, strict=True)))
    return data


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
