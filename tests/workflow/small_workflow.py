"""A workflow small enough for a test: how to write its project and how to run it."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray
from rig_truth import write_truth

import pbrdf
from pbrdf.calibration.documents import KINDS
from pbrdf.formats.receipt import digest
from pbrdf.formats.table_data import Origin
from pbrdf.models import MODELS
from pbrdf.optics.rusinkiewicz import directions
from pbrdf.settings.materials import COLUMNS
from pbrdf.settings.rig import read_rig

ROOT = Path(__file__).resolve().parents[2]
TRUTH = {kind: f"truth/{kind}.json" for kind in KINDS}
"""Files for a config's `calibration`: a sphere 40 px across and a board of 48 px tell too little."""


def command_line(*arguments: str, project: Path = ROOT, profile: tuple[str, ...] = ()) -> list[str]:
    """How the workflow of `project` is run, by its default profile or another."""
    command = [sys.executable, "-m", "snakemake", "--snakefile", str(project / "Snakefile")]
    default = ("--workflow-profile", str(project / "profiles/default"), "--cores", "2")
    return [*command, *(profile or default), *arguments]


def snakemake(
    folder: Path, *arguments: str, project: Path = ROOT, profile: tuple[str, ...] = ()
) -> subprocess.CompletedProcess[str]:
    """Run the workflow in `folder`; collects what it says."""
    command = command_line(*arguments, project=project, profile=profile)
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def rules_due(folder: Path) -> set[str]:
    """Rules that a dry run with the project's config would run."""
    run = snakemake(folder, "--configfile", "config.yaml", "--dry-run")
    assert run.returncode == 0, run.stderr
    return set(re.findall(r"^(?:local)?rule (\w+):", run.stdout + run.stderr, re.MULTILINE)) - {"all"}


def results(folder: Path) -> dict[str, str]:
    """Digest of every result by its path, and of whatever else lies among them."""
    paths = sorted(path for path in (folder / "results").rglob("*") if path.is_file())
    own = [path for path in paths if path.name != ".snakemake_timestamp"]
    return {str(path.relative_to(folder)): digest([path]) for path in own}


def small_settings() -> dict[str, Any]:
    """Config of a small run: few lights, small frames, a coarse table, calibrations from `TRUTH`."""
    return {
        "materials": "materials.tsv",
        "rig": "rig.yaml",
        "plan": {
            "lights_deg": [30, 50, 70, 90],
            "bands_nm": [450, 500, 550, 600, 650],
            "states": {"count": 36, "step_deg": 5, "ratio": 5},
            "exposures_ms": [5, 80],
            "darks": 2,
        },
        "calibration": dict(TRUTH),
        "reconstruction": {"keep_images": ["050.00"]},
        "tabulation": {"theta_h": 12, "theta_d": 16, "phi_d": 25, "widest_gap_deg": 12},
        "fitting": {"models": ["baek2018"], "downsample": 1, "starts": 1, "seed": 1},
    }


def measured_settings() -> dict[str, Any]:
    """Config of a run with the project's own rig: few lights, one band, the arm's radius alone given."""
    config = small_settings() | {"calibration": {}, "session": {"arm": {"radius_mm": 803, "deviation_mm": 8}}}
    config["plan"] |= {"lights_deg": [20, 45, 70, 95, 120], "bands_nm": [550], "references": 4}
    config["tabulation"]["widest_gap_deg"] = 15
    config["reconstruction"] = {"keep_images": []}
    return config


def table_errors(folder: Path, material: str) -> dict[int, NDArray[np.float64]]:
    """Largest error of an element over the true M00, of each measured node, by band (nm)."""
    table = pbrdf.open_table(folder / f"results/{material}/table.zarr").data
    rig = yaml.safe_load((folder / "rig.yaml").read_text(encoding="utf-8"))
    truth = rig["spheres"][material]
    grid = np.meshgrid(table.theta_h, table.theta_d, table.phi_d, indexing="ij")
    to_light, to_camera = directions(*grid)
    errors = {}
    for band, nm in enumerate(table.wavelengths_nm):
        at = truth["bands"][str(int(nm))]
        known = (table.origin[band] == Origin.MEASURED) & (grid[1] > 0)
        parameters = {"alpha": truth["roughness"], "eta": at["index"]}
        parameters |= {name: at[name] for name in ("specular", "albedo")}
        expected = MODELS["baek2018"].evaluate(to_light[known], to_camera[known], parameters)
        off = np.abs(table.mueller[band][known] - expected).max(axis=(1, 2))
        errors[int(nm)] = off / expected[:, 0, 0]
    return errors


def write_materials(folder: Path, *rows: tuple[str, ...]) -> None:
    """Write a table of materials into `folder`."""
    lines = "".join("\t".join(row) + "\n" for row in (COLUMNS, *rows))
    (folder / "materials.tsv").write_text(lines, encoding="utf-8")


def write_project(folder: Path, settings: dict[str, Any] | None = None, **rig_changes: Any) -> Path:
    """Write config, materials, a small virtual rig and its truth into `folder`; gives the config's path."""
    rig = yaml.safe_load((ROOT / "config/rig/virtual.yaml").read_text(encoding="utf-8"))
    rig["camera"] |= {"rows": 48, "columns": 48, "focal_px": 800, "principal_px": [23.6, 23.9]}
    rig |= rig_changes
    (folder / "rig.yaml").write_text(yaml.safe_dump(rig), encoding="utf-8")
    for kind, path in TRUTH.items():
        write_truth(kind, read_rig(folder / "rig.yaml"), folder / path)
    write_materials(folder, ("plastic", "rig", "monday", "25", "-", "-"))
    config = folder / "config.yaml"
    config.write_text(yaml.safe_dump(settings or small_settings()), encoding="utf-8")
    return config
