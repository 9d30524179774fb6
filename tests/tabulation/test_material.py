"""Slices become a table on the disk band by band, and the table goes out to Mitsuba."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.formats.pbsdf import read_pbsdf
from pbrdf.formats.receipt import receipt_summary
from pbrdf.formats.table_data import Origin, TableData
from pbrdf.formats.table_zarr import read_table, write_table
from pbrdf.models import MODELS
from pbrdf.optics.rusinkiewicz import directions
from pbrdf.reconstruction.physicality import is_physical
from pbrdf.tabulation.axes import Axes, table_axes
from pbrdf.tabulation.band import possible_nodes
from pbrdf.tabulation.consistency import read_consistency
from pbrdf.tabulation.export import band_groups, export_groups, export_pbsdf
from pbrdf.tabulation.material import Tabulation, import_table, tabulate
from pbrdf.tabulation.slices import Slice, write_slice

NODES = (10, 19, 37)
AXES = table_axes(*NODES)
SETTINGS = Tabulation(NODES, 12.0, True, 1.5)
PLASTIC = {"alpha": 0.3, "eta": 1.5, "specular": 0.8, "albedo": 0.5}


def truth(theta_d: NDArray[np.float64]) -> NDArray[np.float64]:
    """Matrices (H, …, P, 4, 4) at θd (H, …, P)."""
    middle = (1,) * (theta_d.ndim - 2)
    grid = np.broadcast_arrays(AXES.theta_h.reshape(-1, *middle, 1), np.maximum(theta_d, 1e-6), AXES.phi_d)
    return MODELS["baek2018"].evaluate(*directions(*grid), PLASTIC)


def photographs(folder: Path, bands: tuple[int, ...], axes: Axes = AXES) -> list[Path]:
    """Slices of lights from 20° to 160° in steps of 10°."""
    paths = []
    possible = possible_nodes(axes)
    for angle in range(20, 161, 10):
        theta_d = np.full((NODES[0], NODES[2]), np.radians(angle / 2))
        seen = possible[:, round(angle / 2 / 5)] & (truth(theta_d)[..., 0, 0] > 0)
        mueller = np.where(seen[..., None, None], truth(theta_d), np.nan).astype(np.float32)
        every = np.stack([mueller * np.float32(1 + 0.1 * band) for band in range(len(bands))])
        count = np.broadcast_to(seen * 3, every.shape[:3]).astype(np.uint16)
        part = Slice(float(angle), bands, every, np.full_like(every, 1e-6), count, theta_d)
        paths.append(folder / f"{angle:03d}.00.zarr")
        write_slice(paths[-1], part)
    return paths


def made(folder: Path, bands: tuple[int, ...] = (450, 550), settings: Tabulation = SETTINGS) -> Path:
    slices = photographs(folder, bands)
    out = [folder / name for name in ("table.zarr", "consistency.json", "table.json")]
    tabulate(slices, [], *out, material="jade", settings=settings, code="")
    return out[0]


def test_slices_become_a_table_that_is_the_truth(tmp_path: Path) -> None:
    table = read_table(made(tmp_path))
    assert table.origin is not None and table.count is not None and table.variance is not None
    expected = truth(np.broadcast_to(AXES.theta_d[:, None], (NODES[0], NODES[1], NODES[2])))
    for band in range(2):
        for origin, bound in ((Origin.MEASURED, 1e-5), (Origin.INPAINTED, 0.02)):
            found = table.origin[band] == origin
            error = np.abs(table.mueller[band] / (1 + 0.1 * band) - expected)[found]
            assert np.median(error.max(axis=(1, 2)) / expected[found][:, 0, 0]) < bound
    # four partners of three pixels, or one at the pole
    assert set(np.unique(table.count[table.origin == Origin.MEASURED])) == {3, 6, 12}
    assert np.isfinite(table.variance[table.origin == Origin.MEASURED]).all()
    assert np.isnan(table.variance[table.origin == Origin.INPAINTED]).all()
    summary = receipt_summary(tmp_path / "table.json")
    assert summary["measured_share"] + summary["inpainted_share"] == pytest.approx(1)
    assert summary["possible_nodes"] == 2 * possible_nodes(AXES).sum()
    told = read_consistency(tmp_path / "consistency.json")
    assert told["pooled"] is True
    assert max(told["mirror"]["by_band_nm"]["450"]["relative"]) < 1e-5


def test_without_symmetries_nodes_keep_what_was_measured(tmp_path: Path) -> None:
    table = read_table(made(tmp_path, settings=replace(SETTINGS, symmetrise=False)))
    assert table.origin is not None and table.count is not None
    assert set(np.unique(table.count[table.origin == Origin.MEASURED])) == {3}
    assert read_consistency(tmp_path / "consistency.json")["pooled"] is False


def test_same_slices_give_the_same_bytes_in_any_order(tmp_path: Path) -> None:
    slices = photographs(tmp_path, (450,))
    for name, paths in (("a", slices), ("b", slices[::-1])):
        out = [tmp_path / name / file for file in ("table.zarr", "consistency.json", "table.json")]
        tabulate(paths, [], *out, material="jade", settings=SETTINGS, code="")
    contents = [json.loads((tmp_path / name / "table.json").read_text())["content"] for name in "ab"]
    assert contents[0] == contents[1]


def test_one_light_makes_no_table(tmp_path: Path) -> None:
    one = photographs(tmp_path, (450,))[:1]
    out = [tmp_path / name for name in ("table.zarr", "consistency.json", "table.json")]
    with pytest.raises(InputError, match="jade: slices: there are 1"):
        tabulate(one, [], *out, material="jade", settings=SETTINGS, code="")
    assert not any(path.exists() for path in out)


def test_a_slice_that_breaks_midway_leaves_no_table(tmp_path: Path) -> None:
    slices = photographs(tmp_path, (450, 550))
    chunk = slices[5] / "mueller" / "c" / "1" / "0" / "0" / "0" / "0"
    chunk.write_bytes(chunk.read_bytes()[:-5])
    out = [tmp_path / name for name in ("table.zarr", "consistency.json", "table.json")]
    with pytest.raises(InputError) as caught:
        tabulate(slices, [], *out, material="jade", settings=SETTINGS, code="")
    assert caught.value.source == str(slices[5])
    assert not any(path.exists() for path in out)


def test_memory_does_not_grow_with_bands_or_lights(tmp_path: Path) -> None:
    """Eleven times as many bands, and nearly the same peak."""
    program = """
import resource, sys
from pathlib import Path
from pbrdf.tabulation.material import Tabulation, tabulate
slices, out = sorted(Path(sys.argv[1]).glob("*.zarr")), Path(sys.argv[1]) / "out"
files = [out / name for name in ("table.zarr", "consistency.json", "table.json")]
tabulate(slices, [], *files, material="jade", settings=Tabulation((10, 19, 37), 12.0, True, 1.5), code="")
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""
    peaks = []
    for count in (2, 22):
        folder = tmp_path / str(count)
        photographs(folder, tuple(400 + 5 * band for band in range(count)))
        run = subprocess.run(
            [sys.executable, "-c", program, str(folder)], capture_output=True, text=True, check=True
        )
        peaks.append(int(run.stdout) * 1024)
    band_bytes = 2 * 64 * np.prod(NODES)
    assert peaks[1] - peaks[0] < 10 * band_bytes  # of twenty bands more


def random_table(bands: int) -> TableData:
    random = np.random.default_rng(1)
    shape = (bands, 4, 3, 7)
    origin = random.choice([Origin.NEVER_VISIBLE, Origin.MEASURED, Origin.INPAINTED], shape).astype(np.uint8)
    mueller = random.normal(size=(*shape, 4, 4)).astype(np.float32)
    mueller[..., 0, 0] = 1
    mueller[origin == Origin.NEVER_VISIBLE] = np.nan
    axes = table_axes(4, 3, 7)
    wavelengths = 400.0 + 5 * np.arange(bands)
    return TableData(
        "random", wavelengths, axes.theta_h, axes.theta_d, axes.phi_d, mueller, mueller**2, None, origin
    )


@pytest.mark.parametrize(
    ("count", "expected"),
    [
        (4, []),
        (5, [(0, 5)]),
        (10, [(0, 5), (5, 10)]),
        (12, [(0, 5), (5, 10), (7, 12)]),
        (68, [*((start, start + 5) for start in range(0, 65, 5)), (63, 68)]),
    ],
)
def test_bands_are_written_five_to_a_file_and_none_is_made_up(
    count: int, expected: list[tuple[int, int]]
) -> None:
    assert [(group.start, group.stop) for group in band_groups(count)] == expected


def test_five_bands_go_out_raw_and_filled(tmp_path: Path) -> None:
    table = random_table(5)
    assert table.origin is not None
    write_table(tmp_path / "t.zarr", table, {})
    export_pbsdf(tmp_path / "t.zarr", tmp_path / "raw.pbsdf", tmp_path / "filled.pbsdf", project=False)
    raw, filled = (read_pbsdf(tmp_path / f"{name}.pbsdf").mueller for name in ("raw", "filled"))
    np.testing.assert_array_equal(filled, table.mueller)
    measured = table.origin == Origin.MEASURED
    np.testing.assert_array_equal(np.isfinite(raw[..., 0, 0]), measured)
    np.testing.assert_array_equal(raw[measured], table.mueller[measured])


def test_projection_changes_the_filled_file_alone(tmp_path: Path) -> None:
    table = random_table(5)
    write_table(tmp_path / "t.zarr", table, {})
    export_pbsdf(tmp_path / "t.zarr", tmp_path / "raw.pbsdf", tmp_path / "filled.pbsdf", project=True)
    raw, filled = (read_pbsdf(tmp_path / f"{name}.pbsdf").mueller for name in ("raw", "filled"))
    known = np.isfinite(filled[..., 0, 0])
    assert is_physical(filled[known], 1e-5).all()
    measured = np.isfinite(raw[..., 0, 0])
    assert not is_physical(raw[measured]).any()
    np.testing.assert_array_equal(raw[measured], table.mueller[measured])
    np.testing.assert_array_equal(read_table(tmp_path / "t.zarr").mueller, table.mueller)


def test_sixty_eight_bands_become_fourteen_pairs_of_files(tmp_path: Path) -> None:
    table = random_table(68)
    write_table(tmp_path / "t.zarr", table, {})
    export_groups(tmp_path / "t.zarr", tmp_path / "out", material="jade", project=False)
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert len(names) == 28
    assert names[:2] == ["jade_400-420nm.pbsdf", "jade_400-420nm_filled.pbsdf"]
    covered = set()
    for name in names[1::2]:
        one = read_pbsdf(tmp_path / "out" / name)
        rows = [int(np.flatnonzero(table.wavelengths_nm == nm)[0]) for nm in one.wavelengths_nm]
        assert len(rows) == 5 and rows == sorted(rows)
        np.testing.assert_array_equal(one.mueller, table.mueller[rows])
        covered |= set(rows)
    assert covered == set(range(68))


def test_fewer_than_five_bands_are_not_padded(tmp_path: Path) -> None:
    write_table(tmp_path / "t.zarr", random_table(3), {})
    with pytest.raises(InputError, match="has 3 bands where Mitsuba reads exactly 5"):
        export_groups(tmp_path / "t.zarr", tmp_path / "out", material="jade", project=False)
    assert not (tmp_path / "out").exists()


def test_a_table_from_elsewhere_is_judged_too(tmp_path: Path) -> None:
    """Origins are not told by every format: what is finite was measured, or filled, by somebody."""
    table = replace(random_table(2), origin=None, variance=None)
    write_table(tmp_path / "theirs.zarr", table, {})
    out = [tmp_path / name for name in ("t.zarr", "c.json", "t.json")]
    import_table(tmp_path / "theirs.zarr", None, *out, material="jade", code="")
    told = read_consistency(out[1])
    assert told["mirror"]["by_band_nm"]["400"]["pairs"] > 0
    assert told["mirror"]["by_band_nm"]["400"]["standard_errors"] == [None] * 16
    assert told["mirror"]["by_band_nm"]["400"]["relative"][5] > 0.1
    assert read_table(out[0]).origin is None


def test_a_table_whose_azimuths_do_not_close_is_taken_and_not_judged(tmp_path: Path) -> None:
    table = random_table(2)
    part = replace(
        table, phi_d=table.phi_d[:4], mueller=table.mueller[:, :, :, :4], variance=None, origin=None
    )
    write_table(tmp_path / "theirs.zarr", part, {})
    out = [tmp_path / name for name in ("t.zarr", "c.json", "t.json")]
    import_table(tmp_path / "theirs.zarr", None, *out, material="jade", code="")
    assert read_consistency(out[1])["mirror"]["by_band_nm"]["400"]["pairs"] == 0
