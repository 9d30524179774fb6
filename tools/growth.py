"""How time and memory of the large steps grow with pixels, lights and bands.

Run by ``make growth``, for some minutes; it writes docs/growth.csv and docs/growth.svg. Every step is a
process of its own with one thread, as the workflow starts it, measured by the operating system: its seconds
of the processor and its largest resident memory.
"""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import yaml
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator
from rig_truth import write_truth
from straight_photographs import photograph

from pbrdf.fitting.material import fit_material
from pbrdf.fitting.options import FitOptions
from pbrdf.reconstruction.light import reconstruct_light
from pbrdf.report.figures import STYLE
from pbrdf.settings.checked import check
from pbrdf.settings.plan import Light, capture_plan, light_id
from pbrdf.settings.rig import RigSettings, read_rig
from pbrdf.tabulation.export import export_pbsdf
from pbrdf.tabulation.light import slice_light
from pbrdf.tabulation.material import Tabulation, tabulate
from pbrdf.tabulation.slices import read_slice, write_slice

ROOT = Path(__file__).resolve().parents[1]
BANDS = (450, 500, 550, 600, 650)
NODES = (91, 91, 361)
FIRST_DEG, LAST_DEG = 6.0, 174.0
CALIBRATIONS = ("camera", "sphere", "lights", "polarimeter", "radiometry")


@dataclass(frozen=True)
class Size:
    """Of a problem: side of the frame in px, lights, bands."""

    side: int
    lights: int
    bands: int

    @property
    def angles_deg(self) -> list[float]:
        """Of the lights, evenly spread."""
        return [round(float(angle), 2) for angle in np.linspace(FIRST_DEG, LAST_DEG, self.lights)]


BASE = Size(512, 30, 3)
GROWN = {
    "pixels": [replace(BASE, side=side) for side in (256, 512, 1024)],
    "lights": [replace(BASE, lights=lights) for lights in (15, 30, 90)],
    "bands": [replace(BASE, bands=bands) for bands in (1, 3, 5)],
}


def paper_rig(side: int) -> RigSettings:
    """The rig of config/paper.yaml with a smaller, square frame."""
    rig = read_rig(ROOT / "config/paper/rig.yaml")
    camera = rig["camera"]
    scale = side / camera["rows"]
    smaller = {
        "rows": side,
        "columns": side,
        "focal_px": scale * camera["focal_px"],
        "principal_px": [side / 2, side / 2],
    }
    return RigSettings({**rig, "camera": {**camera, **smaller}})


# Steps: each a process with the folder and the size as arguments.


def photographs(folder: Path, size: Size) -> None:
    """One light's."""
    config = yaml.safe_load((ROOT / "config/paper.yaml").read_text(encoding="utf-8"))
    rig, angle = paper_rig(size.side), size.angles_deg[0]
    plan = capture_plan(check(config, "config", "paper.yaml")["plan"], rig, "paper.yaml")
    plan = replace(plan, lights=(Light(light_id(angle), angle),), bands_nm=BANDS[: size.bands])
    photograph(plan, rig, "paper.yaml", "plastic", 25.0, folder / "capture")
    for kind in CALIBRATIONS:
        write_truth(kind, rig, folder / f"{kind}.json")


def calibrations(folder: Path, *kinds: str) -> dict[str, Path]:
    """Documents by kind."""
    return {kind: folder / f"{kind}.json" for kind in kinds or CALIBRATIONS}


def manifest(folder: Path, size: Size) -> Path:
    """Of the light that is photographed."""
    return folder / "capture/lights" / light_id(size.angles_deg[0]) / "manifest.json"


def reconstruct(folder: Path, size: Size) -> None:
    """Mueller images of a light."""
    kinds = calibrations(folder, "camera", "sphere", "polarimeter", "radiometry")
    reconstruct_light(
        manifest(folder, size), kinds, folder / "images", folder / "images.json", margin_px=2, code=""
    )


def make_slice(folder: Path, size: Size) -> None:
    """Slice of a light."""
    slice_light(
        folder / "images",
        folder / "images.json",
        manifest(folder, size),
        calibrations(folder),
        folder / "slices/0.zarr",
        folder / "slices/0.json",
        nodes=NODES,
        grazing_deg=80.0,
        code="",
    )


def merge(folder: Path, size: Size) -> None:
    """Table of all slices."""
    names = range(size.lights)
    tabulate(
        [folder / f"slices/{name}.zarr" for name in names],
        [folder / "slices/0.json"] * size.lights,
        folder / "table.zarr",
        folder / "consistency.json",
        folder / "table.json",
        material="plastic",
        settings=Tabulation(NODES, widest_gap_deg=15.0, symmetrise=True, fill_sigma=1.5),
        code="",
    )


def export(folder: Path, _: Size) -> None:
    """Files for Mitsuba, of five bands."""
    export_pbsdf(folder / "table.zarr", folder / "raw.pbsdf", folder / "filled.pbsdf", project=False)


def fit(folder: Path, _: Size) -> None:
    """One model, by the config's defaults."""
    settings = check({"materials": "-", "fitting": {}}, "config", "growth")["fitting"]
    options = FitOptions.of({key: value for key, value in settings.items() if key != "models"})
    fit_material(folder / "table.zarr", folder / "table.json", "baek2018", folder / "fit.json", options)


STEPS: dict[str, Callable[[Path, Size], None]] = {
    "photographs": photographs,
    "reconstruct": reconstruct,
    "slice": make_slice,
    "tabulate": merge,
    "export": export,
    "fit": fit,
}
LIGHT_BY_LIGHT = ("photographs", "reconstruct", "slice")


def spread_slices(folder: Path, size: Size) -> None:
    """Slices of all lights: that of one, moved to their places."""
    taken = read_slice(folder / "slices/0.zarr")
    for name, angle in enumerate(size.angles_deg):
        moved = taken.theta_d + np.deg2rad(angle - taken.angle_deg) / 2
        write_slice(folder / f"slices/{name}.zarr", replace(taken, angle_deg=angle, theta_d=moved))


def measured(step: str, folder: Path, size: Size) -> dict[str, Any]:
    """Run a step in a process of its own; its seconds and memory."""
    arguments = [json.dumps([step, str(folder), size.side, size.lights, size.bands])]
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    paths = {"PYTHONPATH": os.pathsep.join(sys.path)}
    return spent([sys.executable, __file__, *arguments], env={**os.environ, **threads, **paths})


def spent(command: Sequence[str], **options: Any) -> dict[str, Any]:
    """Run a command: its seconds of the processor, largest memory (MiB) of it or of one that it started."""
    process = subprocess.Popen(command, **options)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if status:
        sys.exit(f"{' '.join(command)} failed")
    return {"core_s": round(usage.ru_utime + usage.ru_stime, 2), "rss_mb": round(usage.ru_maxrss / 1024)}


def rows_of(size: Size) -> Iterator[dict[str, Any]]:
    """All steps of a problem, measured."""
    with TemporaryDirectory(prefix="growth-") as name:
        folder = Path(name)
        for step in STEPS:
            if step == "export" and size.bands != len(BANDS):
                continue
            if step == "tabulate":
                spread_slices(folder, size)
            row = {"step": step, "side_px": size.side, "lights": size.lights, "bands": size.bands}
            yield row | measured(step, folder, size)


def draw(rows: list[Mapping[str, Any]], path: Path) -> None:
    """Seconds and memory of every step over pixels, lights and bands."""
    with rc_context(STYLE):
        figure = _drawn(rows)
        figure.savefig(path, metadata={"Date": None})


def _drawn(rows: list[Mapping[str, Any]]) -> Figure:
    figure = Figure(figsize=(10, 6), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(2, len(GROWN), sharey="row")
    for column, (grown, sizes) in enumerate(GROWN.items()):
        for step in STEPS:
            of_step = [_row(rows, step, size) for size in sizes]
            points = [
                (_amount(grown, size), row)
                for size, row in zip(sizes, of_step, strict=True)
                if row is not None
            ]
            for axis, figure_of in zip(axes[:, column], ("core_s", "rss_mb"), strict=True):
                places = [place for place, _ in points]
                axis.plot(places, [float(row[figure_of]) for _, row in points], "o-", label=step)
        for axis, told in zip(axes[:, column], ("core seconds", "peak memory, MiB"), strict=True):
            axis.set(xscale="log", yscale="log", xlabel=_LABELS[grown], ylabel=told if column == 0 else "")
            axis.set_xticks([_amount(grown, size) for size in sizes], minor=False)
            axis.minorticks_off()
            axis.xaxis.set_major_formatter("{x:.3g}")
            axis.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
            axis.yaxis.set_major_formatter("{x:g}")
            axis.grid(alpha=0.3)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=len(STEPS))
    return figure


_LABELS = {"pixels": "pixels of the frame, 10⁶", "lights": "lights", "bands": "bands"}


def _amount(grown: str, size: Size) -> float:
    return {"pixels": size.side**2 / 1e6, "lights": size.lights, "bands": size.bands}[grown]


def _row(rows: list[Mapping[str, Any]], step: str, size: Size) -> Mapping[str, Any] | None:
    wanted = (step, size.side, size.lights, size.bands)
    names = ("step", "side_px", "lights", "bands")
    found = [
        row for row in rows if tuple(type(w)(row[n]) for w, n in zip(wanted, names, strict=True)) == wanted
    ]
    return found[0] if found else None


def main() -> None:
    """Measure every size once, write the numbers, draw them; or run one step."""
    if len(sys.argv) > 1:
        step, folder, *size = json.loads(sys.argv[1])
        STEPS[step](Path(folder), Size(*size))
        return
    rows = []
    for size in dict.fromkeys(size for sizes in GROWN.values() for size in sizes):
        for row in rows_of(size):
            print(row, flush=True)
            rows.append(row)
    with (ROOT / "docs/growth.csv").open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    draw(rows, ROOT / "docs/growth.svg")


if __name__ == "__main__":
    main()
