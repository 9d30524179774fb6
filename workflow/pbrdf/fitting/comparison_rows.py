"""A comparison's document as rows of a CSV: one row a value."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

COLUMNS = (
    *("material", "quantity", "of", "wavelength_nm", "theta_h_deg", "theta_d_deg", "theta_i_deg"),
    *("row", "column", "value", "standard_error", "unit"),
)


def csv_text(rows: Iterable[Mapping[str, Any]]) -> str:
    """Rows by column name as CSV, numbers to seven digits."""
    stream = io.StringIO()
    writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow({k: f"{v:.7g}" if isinstance(v, float) else v for k, v in row.items()})
    return stream.getvalue()


def csv_rows(content: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """One row a value of a comparison's document, each of one `quantity` of a model or of the `table`."""
    for row in _rows(content):
        yield {"material": content["material"], **row}


def _rows(content: dict[str, Any]) -> Iterator[dict[str, Any]]:
    bands = content["wavelengths"]["values"]
    for model in content["models"]:
        yield from _model_rows(model, bands)
    for curve in content.get("dolp", []):
        for index, theta_d in enumerate(curve["theta_d_deg"]):
            at = {"quantity": "dolp", "wavelength_nm": curve["wavelength_nm"], "unit": "1"}
            at |= {"theta_h_deg": curve["theta_h_deg"], "theta_d_deg": theta_d}
            if curve["measured"][index] is not None:
                error = curve["standard_error"][index]
                yield {**at, "of": "table", "value": curve["measured"][index], "standard_error": error}
            for name, values in curve["models"].items():
                yield {**at, "of": name, "value": values[index]}
    for angle in content["brewster"]:
        at = {"quantity": "brewster", "wavelength_nm": angle["wavelength_nm"], "unit": "deg"}
        if angle["measured_deg"] is not None:
            error = angle["standard_error_deg"]
            yield {**at, "of": "table", "value": angle["measured_deg"], "standard_error": error}
        for name, value in angle["models"].items():
            if value is not None:
                yield {**at, "of": name, "value": value}
    for albedo in content["albedo"]:
        at = {key: albedo[key] for key in ("wavelength_nm", "theta_i_deg")} | {"unit": "1"}
        yield {**at, "quantity": "reflectance", "of": "table", "value": albedo["measured"]["value"]}
        yield {**at, "quantity": "reflectance_known", "of": "table", "value": albedo["measured"]["known"]}
        for name, value in albedo["models"].items():
            yield {**at, "quantity": "reflectance", "of": name, "value": value}


def _model_rows(model: dict[str, Any], bands: Sequence[float]) -> Iterator[dict[str, Any]]:
    of = {"of": model["model"]}
    for name, parameter in model["parameters"].items():
        shared = parameter["shared"]
        values = [parameter["value"]] if shared else parameter["values"]
        errors = [parameter["standard_error"]] if shared else parameter["standard_errors"]
        for band, (value, error) in enumerate(zip(values, errors, strict=True)):
            row = {**of, "quantity": name, "value": value, "standard_error": error}
            yield {**row, "unit": parameter["unit"], "wavelength_nm": None if shared else bands[band]}
    for quantity, found in (("residual", model["fitted"]), ("residual_held_out", model["held_out"])):
        if found is None:
            continue
        unit = found["cost"]["unit"]
        yield {
            **of,
            "quantity": f"{quantity}_cost_per_node",
            "value": found["cost"]["per_node"],
            "unit": unit,
        }
        for band, matrix in enumerate(found["relative"]["values"]):
            for row, column in np.ndindex(4, 4):
                yield {
                    **of,
                    "quantity": quantity,
                    "wavelength_nm": bands[band],
                    "row": row,
                    "column": column,
                    "value": matrix[row][column],
                    "unit": found["relative"]["unit"],
                }
