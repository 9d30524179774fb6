"""A Lambertian sphere, reconstructed with a measured radiometry, reads its albedo over π."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from rig_truth import write_truth
from small_workflow import small_settings, snakemake, write_project

import pbrdf
from pbrdf.formats.table_data import Origin
from pbrdf.settings.rig import read_rig

BANDS = (450, 650)
ALBEDO = 0.5
OBLIQUE_DEG = 60.0
"""Beyond it a pixel of this small sphere covers degrees."""


@pytest.mark.workflow
def test_a_lambertian_sphere_reads_its_albedo_over_pi(tmp_path: Path) -> None:
    """Noise and power are measured, the geometry is given.

    The lamp does not drift: its power while the tile is photographed and while the sphere is would differ
    by as much, and the albedo with it.
    """
    given = {kind: f"true_{kind}.json" for kind in ("camera", "polarimeter", "lights", "sphere")}
    settings = small_settings() | {"calibration": given, "reconstruction": {"keep_images": []}}
    settings["plan"] |= {"lights_deg": [40, 60], "bands_nm": list(BANDS)}
    flawless = {"index": 1.0, "specular": 0.0, "albedo": ALBEDO}
    matte = {"model": "baek2018", "roughness": 0.3, "bands": {str(nm): flawless for nm in BANDS}}
    lamp = {"amplitude": 0.0, "period_states": 150}
    config = write_project(
        tmp_path, settings, filters_nm=list(BANDS), spheres={"plastic": matte}, lamp_drift=lamp
    )
    rig = read_rig(tmp_path / "rig.yaml")
    for kind, name in given.items():
        write_truth(kind, rig, tmp_path / name)

    run = snakemake(tmp_path, "results/plastic/table.zarr", "--configfile", config.name)
    assert run.returncode == 0, run.stderr

    document = json.loads((tmp_path / "results/calibration/monday/radiometry.json").read_text())
    assert document["verdict"].startswith("good: ")
    table = pbrdf.open_table(tmp_path / "results/plastic/table.zarr").data
    assert table.origin is not None
    theta_h, theta_d, phi_d = np.meshgrid(table.theta_h, table.theta_d, table.phi_d, indexing="ij")
    # the cosines of light and view, at φd = 0 with the light beyond the half vector
    level, lean = np.cos(theta_h) * np.cos(theta_d), np.sin(theta_h) * np.sin(theta_d) * np.cos(phi_d)
    steep = np.minimum(level - lean, level + lean) > np.cos(np.deg2rad(OBLIQUE_DEG))
    for band, m00, origin in zip(BANDS, table.mueller[..., 0, 0], table.origin, strict=True):
        lit = steep & (origin == Origin.MEASURED)
        assert lit.sum() > 200
        assert m00[lit].mean() == pytest.approx(ALBEDO / np.pi, rel=0.005), band
