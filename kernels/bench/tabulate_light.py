"""One light at the paper's size, 3376 × 2704 pixels and five bands, into its slice, against NumPy's bincount.

The limit: to read all of the images, matrices and variances, and to write the slice, at the machine's
copy bandwidth. The peer is what one writes in NumPy: the angles and frames of every lit pixel, its
matrix turned and added to the nearest node's. It takes the variances as uncorrelated, and its nodes are
plain means.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.limits import Copy, cores
from bench.measure import interleaved, peak_mb, row
from pbrdf.calibration.camera import Camera
from pbrdf.calibration.sphere import Sphere
from pbrdf.optics.arm import Arm
from pbrdf.optics.frames import angle_between, normalised, table_axis, transverse
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.reconstruction.noise import NoiseModel
from pbrdf.reconstruction.reduction import data_reduction
from pbrdf.tabulation.axes import table_axes
from pbrdf.tabulation.sampling import make_slice
from pbrdf.tabulation.view import BandImage, Viewpoint

ROWS, COLUMNS, BANDS = 2704, 3376, (450, 500, 550, 600, 650)
DISTANCE_MM, RADIUS_MM, RADIUS_PX = 700.0, 25.0, 1300.0
ANGLE_DEG, GRAZING_DEG = 40.0, 85.0
AXES = table_axes()

Float = NDArray[np.float64]


def run() -> list[dict[str, Any]]:
    """Row `tabulate-light`."""
    view = viewpoint()
    random = np.random.default_rng(1)
    images = [
        (nm, BandImage(*random.random((2, 16, ROWS, COLUMNS), np.float32), (0, 0), noise(), 1.0))
        for nm in BANDS
    ]

    def ours() -> Any:
        return make_slice(view, images, AXES, GRAZING_DEG)

    def peer() -> tuple[Float, Float]:
        return binned(view, images)

    part = ours()
    peak = peak_mb()
    many = part.count[0] > 500
    plain = peer()[0][0].reshape(91, 361, 4, 4)
    off = np.abs(part.mueller[0][many] - plain[many]) / plain[many][:, :1, :1]
    assert np.median(off) < 0.05
    seconds = interleaved({"ours": (ours, 3), "copy": (Copy(cores()), 5), "peer": (peer, 1)}, rounds=3)
    moved = sum(image.mueller.nbytes + image.variance.nbytes for _, image in images)
    moved += part.mueller.nbytes + part.variance.nbytes + part.count.nbytes
    return [
        row(
            "tabulate-light",
            ours_s=seconds["ours"],
            peer="numpy.bincount",
            peer_s=seconds["peer"],
            limit_s=Copy.seconds_for(moved, seconds["copy"]),
            peak_mb=peak,
        )
    ]


def viewpoint() -> Viewpoint:
    """The sphere nearly as high as the frame."""
    focal = RADIUS_PX * DISTANCE_MM / RADIUS_MM
    camera = Camera((focal, focal), (COLUMNS / 2, ROWS / 2), ROWS, COLUMNS)
    centre = (0.0, 0.0, DISTANCE_MM)
    arm = Arm(centre, (0.0, -1.0, 0.0), (0.0, 0.0, -1.0), 800.0, (0.0, -1.0, 0.0))
    return Viewpoint(camera, Sphere(centre, RADIUS_MM), arm, ANGLE_DEG, (0.0, -1.0, 0.0))


def noise() -> NoiseModel:
    """36 states, three exposures."""
    states = [[0.0, 25.0 * n, 5.0 * n, 90.0] for n in range(36)]
    solution = data_reduction(Polarimeter(np.pi / 2, np.pi / 2), states, "bench")
    return NoiseModel(solution, np.array([0.01, 0.04, 0.16]), 6e4, 0.5, 10.0, 4)


def binned(view: Viewpoint, images: list[tuple[int, BandImage]]) -> tuple[Float, Float]:
    """Mean matrices (bands, nodes, 16) of the pixels nearest to each node, and their variances."""
    rays = view.camera.rays(*np.meshgrid(np.arange(COLUMNS), np.arange(ROWS)))
    centre, light = np.array(view.sphere.centre_mm), view.light_mm
    along = rays @ centre
    root = along**2 - centre @ centre + view.sphere.radius_mm**2
    hit = root > 0
    point = (along[hit] - np.sqrt(root[hit]))[:, None] * rays[hit]
    normal = (point - centre) / view.sphere.radius_mm
    to_light, to_camera = normalised(light - point), -rays[hit]
    cosines = np.sum(normal * to_light, axis=-1), np.sum(normal * to_camera, axis=-1)
    lit = np.minimum(*cosines) > np.cos(np.deg2rad(GRAZING_DEG))
    normal, to_light, to_camera = normal[lit], to_light[lit], to_camera[lit]
    gain = (np.linalg.norm(light - point[lit], axis=-1) * 1e-3) ** 2 / cosines[0][lit]
    half = normalised(to_light + to_camera)
    b = normalised(np.cross(normal, half))
    theta_h = np.arccos(np.clip(np.sum(normal * half, axis=-1), -1, 1))
    phi_d = np.arctan2(np.sum(b * to_light, axis=-1), np.sum(np.cross(b, half) * to_light, axis=-1))
    j = np.rint(np.sqrt(theta_h / (np.pi / 2)) * 90).astype(np.intp)
    node = j * 361 + np.rint(np.rad2deg(phi_d) + 180).astype(np.intp)
    s = table_axis(to_light, to_camera)
    turn_in = 2 * angle_between(transverse(view.arm.generator_x(ANGLE_DEG), -to_light), s, -to_light)
    turn_out = 2 * angle_between(transverse(view.analyser_axis, to_camera), s, to_camera)
    cos_in, sin_in, cos_out, sin_out = np.cos(turn_in), np.sin(turn_in), np.cos(turn_out), np.sin(turn_out)
    count = np.maximum(np.bincount(node, minlength=91 * 361), 1)
    means, variances = np.empty((2, len(images), 91 * 361, 16))
    for band, (_, image) in enumerate(images):
        pixels = image.mueller.reshape(16, -1)[:, hit.ravel()][:, lit].reshape(4, 4, -1) * gain
        pixels[1], pixels[2] = (
            cos_out * pixels[1] + sin_out * pixels[2],
            cos_out * pixels[2] - sin_out * pixels[1],
        )
        pixels[:, 1], pixels[:, 2] = (
            cos_in * pixels[:, 1] + sin_in * pixels[:, 2],
            cos_in * pixels[:, 2] - sin_in * pixels[:, 1],
        )
        spread = image.variance.reshape(16, -1)[:, hit.ravel()][:, lit].reshape(4, 4, -1) * gain**2
        spread[1:3] = _mixed(spread[1], spread[2], cos_out, sin_out)
        spread[:, 1:3] = np.swapaxes(_mixed(spread[:, 1], spread[:, 2], cos_in, sin_in), 0, 1)
        for element, (values, squares) in enumerate(
            zip(pixels.reshape(16, -1), spread.reshape(16, -1), strict=True)
        ):
            means[band, :, element] = np.bincount(node, values, 91 * 361) / count
            variances[band, :, element] = np.bincount(node, squares, 91 * 361) / count**2
    return means, variances


def _mixed(first: Float, second: Float, cosine: Float, sine: Float) -> Float:
    """Variances of two uncorrelated elements in turned frames."""
    return np.stack([cosine**2 * first + sine**2 * second, cosine**2 * second + sine**2 * first])
