from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from pbrdf.fitting import FitResult
from pbrdf.formats.table_data import Origin, TableData
from pbrdf.report.fit_view import model_at
from pbrdf.report.panels_data import MOST_DRAWN, decoded, panels_data, write_slices
from pbrdf.report.table_view import interactive_slices


def test_the_document_holds_every_node_as_the_table_does(tmp_path: Path, table: TableData) -> None:
    slices = interactive_slices(table)
    write_slices(tmp_path / "values.json", table, slices)
    document = json.loads((tmp_path / "values.json").read_text(encoding="utf-8"))
    assert document["wavelengths"]["values"] == [450.0, 550.0]
    for each, said in zip(slices, document["slices"], strict=True):
        values = decoded(said["mueller"]["base64"], said["mueller"]["shape"])
        for band in range(2):
            ours = each.of(table.mueller[band])
            np.testing.assert_array_equal(np.isfinite(values[band]), np.isfinite(ours))
            np.testing.assert_array_equal(
                values[band][np.isfinite(ours)], ours[np.isfinite(ours)].astype(np.float64)
            )
            assert table.origin is not None
            never = each.of(table.origin[band]) == Origin.NEVER_VISIBLE
            np.testing.assert_array_equal(np.isinf(values[band]).all(axis=(-2, -1)), never)


def test_the_page_draws_nodes_of_the_document_and_the_fit_there(table: TableData, fitted: FitResult) -> None:
    data = panels_data(table, fitted, interactive_slices(table))
    assert data["sources"] == ["Table", "Baek 2018"]
    over_phi = data["slices"][0]
    shape = (2, len(data["theta_h_deg"]), len(over_phi["across_deg"]), 4, 4)
    drawn, model = (decoded(text, shape) for text in over_phi["values"])
    node = int(np.abs(np.degrees(table.theta_d) - 30).argmin())
    np.testing.assert_array_equal(drawn[1, 3, 4], table.mueller[1, 3, node, 4])
    expected = model_at(fitted, 1, table.theta_h[3], table.theta_d[node], table.phi_d[4])
    np.testing.assert_allclose(model[1, 3, 4], expected, rtol=1e-6)


def test_a_fine_grid_is_thinned_for_the_screen(table: TableData) -> None:
    fine = np.linspace(-np.pi, np.pi, 361)
    mueller = np.repeat(table.mueller[:, :, :, :1], 361, axis=3)
    dense = TableData("dense", table.wavelengths_nm, table.theta_h, table.theta_d, fine, mueller)
    data = panels_data(dense, None, interactive_slices(dense))
    across = data["slices"][0]["across_deg"]
    assert len(across) <= MOST_DRAWN
    assert (across[0], across[-1]) == (-180.0, 180.0)
    assert not data["whole"]
