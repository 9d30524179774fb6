"""How exact tabulation is: photographs of Mitsuba's materials without noise, at random directions.

    python tools/tabulation_accuracy.py [--grid] [NAME ...]

One row a material: share of the directions that are covered, median and 90th percentile of the error, the
largest of an element over the true M00, by the light with the nearest θt (the supplement's map) and by
the two lights that bracket θd; with ``--grid`` also through the nodes of a table of 91 × 91 × 361, as slices
are merged into it.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.sphere import Sphere
from pbrdf.formats.table_data import TableData
from pbrdf.instruments.virtual_geometry import UP, virtual_arm
from pbrdf.instruments.virtual_sphere import VirtualSphere
from pbrdf.models.mitsuba_bsdf import MitsubaBsdf
from pbrdf.models.table import Table
from pbrdf.optics.frames import change_frames
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.optics.rusinkiewicz import directions
from pbrdf.reconstruction.noise import NoiseModel
from pbrdf.reconstruction.reduction import data_reduction
from pbrdf.tabulation.axes import table_axes
from pbrdf.tabulation.closed_loop import random_bins
from pbrdf.tabulation.corners import Corners
from pbrdf.tabulation.inverse_map import circle_crossing, nearest_light
from pbrdf.tabulation.merge import merge_band, open_slices
from pbrdf.tabulation.sampling import make_slice
from pbrdf.tabulation.slices import write_slice
from pbrdf.tabulation.surface import SurfacePoints, node_points, normal_points
from pbrdf.tabulation.view import BandImage, Viewpoint

Float = NDArray[np.float64]

BAND_NM = 550
RADIUS_MM, DISTANCE_MM, ARM_MM = 25.0, 1000.0, 800.0
PLACES, SEED = 20_000, 5
GRAZING_DEG = 85.0
MARGIN = 1.03
"""Half the image over the radius of the sphere's outline."""


@dataclass(frozen=True)
class Trial:
    """A material, and how it is photographed; lights evenly spaced from half a step on."""

    bsdf: dict[str, Any]
    lights: int
    pixels: int

    @property
    def angles_deg(self) -> Float:
        """Angles of the arm."""
        step = 180.0 / self.lights
        return step * (np.arange(self.lights) + 0.5)

    @property
    def rig(self) -> dict[str, Any]:
        """What of a virtual rig's file photographs without an instrument need."""
        outline = np.tan(np.arcsin(RADIUS_MM / DISTANCE_MM))
        return {
            "camera": {
                "rows": self.pixels,
                "columns": self.pixels,
                "focal_px": self.pixels / 2 / (MARGIN * outline),
                "principal_px": [self.pixels / 2 - 0.5] * 2,
            },
            "arm": {"radius_mm": ARM_MM},
            "distance_mm": DISTANCE_MM,
            "samples": 1,
            "spheres": {"ball": {"mitsuba": self.bsdf}},
        }

    def view(self, angle_deg: float) -> Viewpoint:
        """Where camera, sphere and light stand."""
        camera = self.rig["camera"]
        focal, principal = camera["focal_px"], tuple(camera["principal_px"])
        return Viewpoint(
            Camera((focal, focal), principal, self.pixels, self.pixels),
            Sphere((0.0, 0.0, DISTANCE_MM), RADIUS_MM),
            virtual_arm(self.rig),
            angle_deg,
            UP,
        )

    def photographs(self) -> Iterator[tuple[Viewpoint, Float]]:
        """Mueller images (16, rows, columns) of all lights, ascending."""
        sphere = VirtualSphere(self.rig, "ball", RADIUS_MM, "trial")
        for angle_deg in self.angles_deg:
            image = sphere.mueller_image(angle_deg, BAND_NM)
            yield self.view(angle_deg), np.moveaxis(image, -1, 0).astype(np.float64)


TRIALS = {
    "plastic .3": Trial({"type": "pplastic", "alpha": 0.3}, 45, 256),
    "plastic .1": Trial({"type": "pplastic", "alpha": 0.1}, 45, 256),
    # Beckmann's distribution, the plugins' default, leaves no light to compare far from the highlight
    "gold .15": Trial(
        {"type": "roughconductor", "distribution": "ggx", "material": "Au", "alpha": 0.15}, 90, 512
    ),
}


def errors(found: Float, truth: Float) -> Float:
    """Largest error of an element over M00, (n,); NaN where nothing was found."""
    largest: Float = np.abs(found - truth).max(axis=(1, 2)) / truth[:, 0, 0]
    return largest


def sampled(view: Viewpoint, image: Float, points: SurfacePoints) -> Float:
    """Matrices (n, 4, 4) in table frames, bilinear between pixels; NaN where nothing is seen."""
    shown = (points.cos_light > 0) & (points.cos_camera > 0)
    column, row = (np.where(shown, place, 0.0) for place in view.camera.project(points.position_mm))
    corners, inside = Corners.around(column, row).within((0, 0), image.shape[1:])
    value = np.full((16, len(column)), np.nan)
    value[:, inside] = np.einsum("pn,kpn->kn", corners.weight, image[:, corners.row, corners.column])
    value[:, ~shown] = np.nan
    turn = points.frame_angles(view.arm.generator_x(view.angle_deg), view.analyser_axis)
    gain = (points.light_distance_mm * 1e-3) ** 2 / points.cos_light
    return change_frames(value.T.reshape(-1, 4, 4), *turn) * gain[:, None, None]


class NearestLight:
    """The supplement's way: of each direction, the light with the nearest θt."""

    def __init__(self, trial: Trial, bins: tuple[Float, Float, Float]) -> None:
        view = trial.view(0.0)
        lights = [view.arm.light_position(angle) for angle in trial.angles_deg]
        self._bins, self._sphere = bins, view.sphere
        self._index, _ = nearest_light(view.sphere, lights, bins)
        self._light = 0
        self.found = np.full((len(bins[0]), 4, 4), np.nan)

    def take(self, view: Viewpoint, image: Float) -> None:
        """See the photograph of the next light."""
        mine = self._index == self._light
        bins = tuple(part[mine] for part in self._bins)
        light = view.arm.light_position(view.angle_deg)
        normal = circle_crossing(self._sphere, light, bins)
        self.found[mine] = sampled(view, image, normal_points(self._sphere, light, normal))
        self._light += 1


class BracketingLights:
    """Of each direction, the two lights between whose actual θd it lies."""

    def __init__(self, trial: Trial, bins: tuple[Float, Float, Float]) -> None:
        self._bins = bins
        self._reach = np.radians(2 * 90.0 / trial.lights) + 2 * RADIUS_MM / ARM_MM
        self._below = np.full(len(bins[0]), np.nan)
        self._matrix = np.full((len(bins[0]), 4, 4), np.nan)
        self.found = np.full((len(bins[0]), 4, 4), np.nan)

    def take(self, view: Viewpoint, image: Float) -> None:
        """See the photograph of the next light."""
        theta_h, theta_d, phi_d = self._bins
        near = np.abs(theta_d - np.radians(view.angle_deg) / 2) < self._reach
        light = view.arm.light_position(view.angle_deg)
        points = node_points(view.sphere, light, theta_h[near], phi_d[near])
        matrices = sampled(view, image, points)
        low, high = self._below[near], points.theta_d
        weight = (theta_d[near] - low) / (high - low)
        between = (low <= theta_d[near]) & (high > theta_d[near])
        where = np.flatnonzero(near)
        w = weight[between, None, None]
        self.found[where[between]] = (1 - w) * self._matrix[where[between]] + w * matrices[between]
        self._below[where], self._matrix[where] = high, matrices


def run(trial: Trial, count: int = PLACES) -> dict[str, Float]:
    """Errors (n,) at random directions, by way: ``nearest``, ``bracketing``."""
    bins = random_bins(count, SEED)
    to_light, to_camera = directions(*bins)
    ways = {"nearest": NearestLight(trial, bins), "bracketing": BracketingLights(trial, bins)}
    for view, image in trial.photographs():
        for way in ways.values():
            way.take(view, image)
    truth = MitsubaBsdf(trial.bsdf, "trial", "bsdf").evaluate(to_light, to_camera, BAND_NM)
    return {name: errors(way.found, truth) for name, way in ways.items()}


def through_grid(trial: Trial, nodes: tuple[int, int, int] = (91, 91, 361)) -> Float:
    """Errors (n,) at random directions of a table made of the photographs."""
    bins = random_bins(PLACES, SEED)
    to_light, to_camera = directions(*bins)
    axes = table_axes(*nodes)
    with TemporaryDirectory() as folder:
        paths = []
        for view, image in trial.photographs():
            shown = BandImage(
                np.ascontiguousarray(image, np.float32),
                np.ones(image.shape, np.float32),
                (0, 0),
                _noise(),
                1.0,
            )
            paths.append(Path(folder) / f"{view.angle_deg:06.2f}.zarr")
            write_slice(paths[-1], make_slice(view, [(BAND_NM, shown)], axes, GRAZING_DEG))
        band = merge_band(open_slices(paths, axes, "trial"), 0, axes)
    table = Table(
        TableData(
            "trial", np.array([float(BAND_NM)]), axes.theta_h, axes.theta_d, axes.phi_d, band.mueller[None]
        )
    )
    truth = MitsubaBsdf(trial.bsdf, "trial", "bsdf").evaluate(to_light, to_camera, BAND_NM)
    return errors(table.evaluate(to_light, to_camera, BAND_NM), truth)


def _noise() -> NoiseModel:
    """Of a polarimeter, for variances that nobody looks at."""
    states = [[0.0, 25.0 * n, 5.0 * n, 90.0] for n in range(36)]
    solution = data_reduction(Polarimeter(np.pi / 2, np.pi / 2), states, "trial")
    return NoiseModel(solution, np.ones(1), np.inf, 0.0, 1.0, 0)


def figures(error: Float) -> tuple[float, float, float]:
    """Share covered, median and 90th percentile of errors."""
    known = np.isfinite(error)
    median, p90 = np.quantile(error[known], [0.5, 0.9])
    return float(known.mean()), float(median), float(p90)


def main() -> None:
    """Print the rows."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*", choices=[[], *TRIALS], help="materials; all if none is named")
    parser.add_argument("--grid", action="store_true", help="also through a table of 91 × 91 × 361")
    arguments = parser.parse_args()
    print("material     lights       covered   median      p90")
    for name in arguments.names or TRIALS:
        found = run(TRIALS[name])
        if arguments.grid:
            found["through grid"] = through_grid(TRIALS[name])
        for way, error in found.items():
            covered, median, p90 = (100 * figure for figure in figures(error))
            print(f"{name:12} {way:12} {covered:5.1f} % {median:7.3f} % {p90:7.3f} %", flush=True)


if __name__ == "__main__":
    main()
