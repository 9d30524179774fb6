from __future__ import annotations

import json
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pbrdf.errors import InputError
from pbrdf.fitting import FitResult
from pbrdf.formats.pbsdf import write_pbsdf
from pbrdf.formats.table_data import TableData
from pbrdf.formats.table_zarr import write_table
from pbrdf.models import MODELS
from pbrdf.optics.rusinkiewicz import directions
from pbrdf.report import environment_render as renders
from pbrdf.report.paper_figures import FORMATS, retardance_figure, write_figure, write_material_figures

NAMES = ("mueller_table", "mueller_fit", "mueller_difference", "curves", "sphere")
MAGIC = {"pdf": b"%PDF", "svg": b"<?xml", "png": b"\x89PNG"}


@pytest.fixture
def polarimeter(tmp_path: Path) -> Path:
    bands = {
        str(nm): {"generator_retardance_deg": 90 + k, "analyser_retardance_deg": 90 - k}
        for k, nm in enumerate((450, 550, 650))
    }
    zeros = dict.fromkeys(
        ("generator_polariser", "generator_retarder", "analyser_retarder", "analyser_polariser"), 0.0
    )
    content = {
        "schema": "pbrdf/polarimeter/1",
        "bands": bands,
        "zeros_deg": zeros,
        "analyser_axis": [1.0, 0.0, 0.0],
    }
    path = tmp_path / "polarimeter.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


def test_the_retardances_are_told_in_waves(polarimeter: Path) -> None:
    alt = retardance_figure(polarimeter).alt
    assert "generator from 0.25 to 0.2556 waves; analyser from 0.2444 to 0.25 waves" in alt


def test_every_format_is_written_with_the_same_bytes_again(polarimeter: Path, tmp_path: Path) -> None:
    shown = retardance_figure(polarimeter)
    for folder in ("a", "b"):
        write_figure(shown, [tmp_path / folder / f"retardance.{kind}" for kind in FORMATS])
    for kind in FORMATS:
        one, two = ((tmp_path / folder / f"retardance.{kind}").read_bytes() for folder in ("a", "b"))
        assert one == two
        assert one.startswith(MAGIC[kind])


def test_a_material_has_all_its_figures(table: TableData, fitted: FitResult, tmp_path: Path) -> None:
    write_table(tmp_path / "table.zarr", table, {})
    fitted.write(tmp_path / "fit.json")
    paths = [tmp_path / f"figures/gold_{name}.png" for name in NAMES]
    write_material_figures(tmp_path / "table.zarr", [tmp_path / "fit.json"], paths)
    for path in paths:
        image = np.asarray(Image.open(BytesIO(path.read_bytes())).convert("L"))
        assert image.shape[1] > 1500
        assert image.std() > 10, path.name


def test_without_mitsuba_a_render_is_refused_in_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(renders, "find_spec", lambda name: None)
    with pytest.raises(InputError, match="mitsuba: is not installed"):
        renders.environment_render("gold.pbsdf", "gold")


def test_a_dielectric_in_an_environment_is_polarised_at_its_rim(tmp_path: Path) -> None:
    pytest.importorskip("mitsuba")
    axes = (
        np.linspace(0, 1, 19) ** 2 * np.pi / 2,
        np.linspace(0, np.pi / 2, 19),
        np.linspace(-np.pi, np.pi, 37),
    )
    grid = np.meshgrid(axes[0], np.maximum(axes[1], 1e-6), axes[2], indexing="ij")
    parameters = {"alpha": 0.3, "eta": 1.5, "specular": 1.0, "albedo": 0.1}
    band = MODELS["baek2018"].evaluate(*directions(*grid), parameters)
    bands = np.array([450.0, 500.0, 550.0, 600.0, 650.0])
    write_pbsdf(
        tmp_path / "glass.pbsdf", TableData("x", bands, *axes, np.stack([band] * 5).astype(np.float32))
    )
    image = renders._rendered(tmp_path / "glass.pbsdf", 24, 16)
    stokes = renders._stokes(image)
    degree = np.linalg.norm(stokes[..., 1:3], axis=-1) / stokes[..., 0]
    # seen from the front the middle reflects at normal incidence, the rim beyond Brewster's angle
    assert degree[12, 12] < 0.15
    assert degree[12, 20:23].mean() > 2 * degree[12, 12]
