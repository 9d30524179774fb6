from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from pbrdf.fitting import FitResult
from pbrdf.formats.table_data import Origin, TableData
from pbrdf.report.fit_view import model_at
from pbrdf.report.panels_data import MOST_DRAWN, Panels, decoded, drawn_panels, write_slices
from pbrdf.report.table_view import MOST_BANDS_OFFERED, offered_slices, whole_slices


def test_the_document_holds_every_node_as_the_table_does(tmp_path: Path, table: TableData) -> None:
    slices = whole_slices(table)
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


def panels_of(table: TableData, fit: FitResult | None) -> Panels:
    return drawn_panels("values/a", table, fit, offered_slices(table), whole_slices(table))


def values_of(folder: Path, name: str) -> list[str]:
    """What a script gives to its page."""
    text = (folder / name).read_text(encoding="ascii")
    slice_, band, values = json.loads(text.replace("panelValues(", "[").replace(");", "]"))
    assert f"slice{slice_}_band{band}.js" == name
    return list(values)


def test_scripts_hold_nodes_of_the_table_and_the_fit_there(
    tmp_path: Path, table: TableData, fitted: FitResult
) -> None:
    panels = panels_of(table, fitted)
    panels.write(tmp_path / "a")
    about = panels.about()
    assert about["sources"] == ["Table", "Baek 2018"]
    assert len(list((tmp_path / "a").iterdir())) == 2 * len(about["slices"])
    opens = about["opens"][0]
    over_phi = about["slices"][opens]
    assert (over_phi["held"], over_phi["across"]) == ("θd", "φd")
    shape = (len(about["theta_h_deg"]), len(over_phi["across_deg"]), 4, 4)
    drawn, model = (decoded(t, shape) for t in values_of(tmp_path / "a", f"slice{opens}_band1.js"))
    node = int(np.abs(np.degrees(table.theta_d) - over_phi["held_deg"]).argmin())
    np.testing.assert_array_equal(drawn[3, 4], table.mueller[1, 3, node, 4])
    expected = model_at(fitted, 1, table.theta_h[3], table.theta_d[node], table.phi_d[4])
    np.testing.assert_allclose(model[3, 4], expected, rtol=1e-6)


def test_same_values_are_the_same_bytes(tmp_path: Path, table: TableData, fitted: FitResult) -> None:
    for name in ("a", "b"):
        panels_of(table, fitted).write(tmp_path / name)
    for script in (tmp_path / "a").iterdir():
        assert script.read_bytes() == (tmp_path / "b" / script.name).read_bytes()


def test_slices_go_through_the_table_both_ways_and_none_comes_twice(table: TableData) -> None:
    slices = offered_slices(table)
    assert len(set(slices)) == len(slices)
    over_phi = [np.degrees(table.theta_d[each.node]) for each in slices if each.held == "theta_d"]
    over_theta = [np.degrees(table.phi_d[each.node]) for each in slices if each.held == "phi_d"]
    assert (over_phi, over_theta) == (sorted(over_phi), sorted(over_theta))
    assert min(over_phi) <= 10 and max(over_phi) >= 70
    np.testing.assert_allclose(over_theta, [0, 45, 90, 135, 180])
    assert set(whole_slices(table)) <= set(slices)


def test_many_bands_leave_room_for_fewer_slices(table: TableData) -> None:
    bands = MOST_BANDS_OFFERED + 1
    mueller = np.repeat(table.mueller[:1], bands, axis=0)
    many = TableData("many", np.linspace(400, 700, bands), table.theta_h, table.theta_d, table.phi_d, mueller)
    assert offered_slices(many) == whole_slices(many)


def test_a_fine_grid_is_thinned_for_the_screen(table: TableData) -> None:
    fine = np.linspace(-np.pi, np.pi, 361)
    mueller = np.repeat(table.mueller[:, :, :, :1], 361, axis=3)
    dense = TableData("dense", table.wavelengths_nm, table.theta_h, table.theta_d, fine, mueller)
    about = panels_of(dense, None).about()
    across = about["slices"][0]["across_deg"]
    assert len(across) <= MOST_DRAWN
    assert (across[0], across[-1]) == (-180.0, 180.0)
    assert not about["every_node"]
