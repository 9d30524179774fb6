"""The sphere's centre from its outline in an image of it, with its radius given."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.outline_cone import (
    angles,
    moved_by_centre,
    off_outline,
    off_outline_px,
    solve_cone,
    sphere_in,
)
from pbrdf.calibration.outline_edges import Edges, find_edges, without_dead_pixels
from pbrdf.calibration.outline_search import find_cones, reduction
from pbrdf.calibration.sphere import Sphere, across
from pbrdf.errors import InputError

Float = NDArray[np.float64]

LEAST_DEG, ENOUGH_DEG = 120.0, 180.0
DOUBTFUL_RESIDUAL_PX = 0.3
DOUBTFUL_SHARE = 0.5
_CANDIDATES = 4
_ROUGH_PX = 6.0
_BAND_PER_BLUR = 5.0
_HALF_PX = 8.0
_TRIPLES = 600
_ON_OUTLINE_PX, _ON_OUTLINE_PER_BLUR = 0.75, 0.75
# a shift or a growth that the whole outline shares, so that its scatter cannot tell: in drawn images 0.004 px
# in even light, and four times that where the rim of a shadow crosses the outline
_COMMON_PX = 0.015
_ARC_DEG, _FEWEST_ARCS = 10.0, 6
_SHARPEST_PER_BLUR = 0.06
_TUKEY = 4.685
_STEPS = 50


@dataclass(frozen=True)
class OutlineFit:
    """A sphere and how well its outline is known.

    Attributes
    ----------
    sphere : Sphere
    covariance : ndarray
        Of the centre (3, 3), mm².
    outline_deg : float
        How much of the outline was seen.
    share : float
        Share of clear edges about the outline that lie on it.
    residual_px : float
        Root mean square distance of those from it.
    blur_px : float
        Standard deviation of the image's blur.
    """

    sphere: Sphere
    covariance: Float
    outline_deg: float
    share: float
    residual_px: float
    blur_px: float


def measure_sphere(
    image: NDArray[Any], camera: Camera, radius_mm: float, saturation: float | None = None
) -> dict[str, Any]:
    """Content of ``sphere.json`` from an image of the sphere in ambient light.

    Parameters
    ----------
    image : ndarray
        (rows, columns) of the camera, any real dtype.
    camera : Camera
    radius_mm : float
        Radius measured by hand; an error of it moves the centre along the view in proportion.
    saturation : float, optional
        Edges beside pixels of this value and above are left out: they lie elsewhere.

    Raises
    ------
    InputError
        If the image is not of this camera, or shows less than `LEAST_DEG` of a sphere's outline.
    """
    fit = fit_outline(image, camera, radius_mm, saturation)
    centre = np.array(fit.sphere.centre_mm)
    axes = np.stack([*across(centre), centre / np.linalg.norm(centre)])
    right, down, along = np.sqrt(np.diag(axes @ fit.covariance @ axes.T))
    return {
        "source": "measured",
        "centre_mm": list(fit.sphere.centre_mm),
        "radius_mm": radius_mm,
        "standard_errors_mm": {"across": float(max(right, down)), "along": float(along)},
        "outline_deg": fit.outline_deg,
        "inlier_share": fit.share,
        "residual_px": fit.residual_px,
        "blur_px": fit.blur_px,
        "verdict": _verdict(fit),
    }


def fit_outline(
    image: NDArray[Any], camera: Camera, radius_mm: float, saturation: float | None = None
) -> OutlineFit:
    """Sphere whose outline the image shows; parameters and errors as of `measure_sphere`."""
    if image.shape != (camera.rows, camera.columns):
        problem = f"has shape {image.shape} where the camera's is {(camera.rows, camera.columns)}"
        raise InputError("sphere image", "image", problem, "give a single-channel image of this camera")
    pixels = image.astype(np.float32)
    if not np.isfinite(pixels).all():
        raise InputError("sphere image", "image", "holds values that are not finite", "give a raw image")
    whole = without_dead_pixels(pixels)
    limit = np.inf if saturation is None else saturation
    fits: list[OutlineFit] = []
    for x in find_cones(whole, camera)[:_CANDIDATES]:
        if not any(_alike(x, fit.sphere, camera) for fit in fits):
            fit = _sharpened(whole, camera, sphere_in(x, radius_mm), limit)
            fits += [] if fit is None else [fit]
    if not fits:
        raise _refusal("shows no sphere")
    best = max(fits, key=lambda fit: fit.outline_deg * _radius(fit.sphere))
    if best.outline_deg < LEAST_DEG:
        raise _refusal(f"shows {best.outline_deg:.0f}° of a sphere's outline, {LEAST_DEG:.0f}° are needed")
    return best


def _refusal(problem: str) -> InputError:
    remedy = "light the sphere and what is behind it evenly, and uncover its outline"
    return InputError("sphere image", "image", problem, remedy)


def _alike(x: Float, sphere: Sphere, camera: Camera) -> bool:
    """Whether a rough cone is of a sphere that was found already."""
    outline = sphere.outline(np.linspace(0, 2 * np.pi, 36))
    off = angles(x, outline / np.linalg.norm(outline, axis=1, keepdims=True))
    return bool(np.abs(off).max() * max(camera.focal_px) < _ROUGH_PX * reduction(camera))


def _radius(sphere: Sphere) -> float:
    """Of the outline, rad."""
    return float(np.arcsin(sphere.radius_mm / np.linalg.norm(sphere.centre_mm)))


def _sharpened(
    image: NDArray[np.float32], camera: Camera, sphere: Sphere, saturation: float
) -> OutlineFit | None:
    """Fit from a rough sphere: a wide band first, then a narrow one about what it said."""
    blur_px = 1.0
    half_px = max(_HALF_PX, 3 * reduction(camera))
    fit = None
    # the first band is too far off to tell the blur; where that is large, the second is too narrow
    for measure_blur in (False, True, True, False):
        edges = find_edges(image, camera, sphere, half_px, saturation, blur_px, measure_blur)
        fit = fit_edges(edges, camera, sphere)
        if fit is None:
            return None
        sphere, blur_px = fit.sphere, fit.blur_px
        half_px = max(_HALF_PX, _BAND_PER_BLUR * blur_px)
    return fit


def fit_edges(edges: Edges, camera: Camera, rough: Sphere) -> OutlineFit | None:
    """Sphere through the edge points that agree on one, or None if too few do.

    A linear solution within the largest consensus is followed by robust least squares of the points'
    distances from the outline in the image.

    Parameters
    ----------
    edges : Edges
    camera : Camera
    rough : Sphere
        Roughly where it stands; its radius is the sphere's.
    """
    rays = camera.rays(edges.columns, edges.rows)
    if len(rays) < 20:
        return None
    _, _, scale = off_outline_px(rough, camera, edges.columns, edges.rows)
    near_px = max(_ON_OUTLINE_PX, _ON_OUTLINE_PER_BLUR * edges.blur_px)
    x = _consensus(rays, scale, near_px)
    if x is None:
        return None
    sphere = sphere_in(x, rough.radius_mm)
    arcs = np.floor(np.degrees(edges.turns) / _ARC_DEG).astype(np.intp)
    # a faint step is shifted most by what the model of it leaves out
    error = np.hypot(edges.errors_px, _SHARPEST_PER_BLUR * edges.blur_px)
    for _ in range(_STEPS):
        distance = scale * off_outline(sphere, rays)[0]
        u = distance / error / (_TUKEY * _spread(distance / error, np.abs(distance) < near_px))
        weights = np.clip(1 - u**2, 0, None) ** 2 / error**2
        # fewer arcs than these fix neither a centre nor its error
        if len(np.unique(arcs[weights > 0])) < _FEWEST_ARCS or sphere.centre_mm[2] <= sphere.radius_mm:
            return None
        slope = scale[:, None] * moved_by_centre(sphere, rays)
        normal = (slope * weights[:, None]).T @ slope
        step = np.linalg.solve(normal, -slope.T @ (weights * distance))
        ox, oy, oz = (float(c) for c in np.array(sphere.centre_mm) + step)
        sphere = Sphere((ox, oy, oz), sphere.radius_mm)
        if np.linalg.norm(step) < 1e-9 * oz:
            break
    on = weights > 0
    bend = np.where(on, (1 - u**2) * (1 - 5 * u**2), 0.0) / error**2
    covariance = _jackknife(arcs, slope, bend, weights * distance)
    centre = np.array(sphere.centre_mm)
    toward = centre / np.linalg.norm(centre)
    shift = _COMMON_PX * float(np.linalg.norm(centre) / np.mean(scale))
    growth = _COMMON_PX / float(np.mean(scale) * np.mean(moved_by_centre(sphere, rays) @ toward))
    common = shift**2 * np.eye(3) + growth**2 * np.outer(toward, toward)
    return OutlineFit(
        sphere,
        covariance + common,
        float(np.count_nonzero(on) * edges.arc_deg),
        float(np.mean(on)),
        float(np.sqrt(np.mean(distance[on] ** 2))),
        edges.blur_px,
    )


def _consensus(rays: Float, scale: Float, near_px: float) -> Float | None:
    """Cone on which most edges agree: of three at a time, then of all on it (Fischler and Bolles)."""
    random = np.random.default_rng(0)
    triples = random.integers(0, len(rays), (_TRIPLES, 3))
    cones = solve_cone(rays[triples])
    cones = cones[np.linalg.norm(cones, axis=1) > 1 + 1e-9]
    if not len(cones):
        return None
    on = np.abs(angles(cones, rays)) * scale < near_px
    members = on[np.argmax(on.sum(1))]
    for _ in range(5):
        if np.count_nonzero(members) < 10:
            return None
        x = solve_cone(rays[members])
        if not np.linalg.norm(x) > 1 + 1e-9:
            return None
        members = np.abs(angles(x, rays)) * scale < near_px
    return x


def _jackknife(arcs: NDArray[np.intp], slope: Float, bend: Float, pull: Float) -> Float:
    """Covariance (3, 3) of the centre, mm², from what leaving out one arc after the other does to it.

    Neighbouring edges share their errors (what lies behind them, a shadow's rim), so that arcs and not edges
    are what is independent (Efron, The Jackknife, the Bootstrap and Other Resampling Plans, 1982).

    Parameters
    ----------
    arcs : ndarray
        Of the edges (N,).
    slope : ndarray
        Derivatives (N, 3) of their distances by the centre, px/mm.
    bend, pull : ndarray
        Second and first derivatives (N,) of the loss by the distance.
    """
    whole = (slope * bend[:, None]).T @ slope
    moves = []
    for arc in np.unique(arcs):
        left_out = slope[arcs == arc]
        rest = whole - (left_out * bend[arcs == arc, None]).T @ left_out
        moves.append(np.linalg.solve(rest, left_out.T @ pull[arcs == arc]))
    moved = np.array(moves)
    covariance: Float = moved.T @ moved * (len(moved) - 1) / len(moved)
    return covariance


def _spread(normalised: Float, near: NDArray[np.bool_]) -> float:
    """Robust standard deviation of the edges that lie near the outline."""
    return max(1.4826 * float(np.median(np.abs(normalised[near]))), 0.1) if near.any() else 1.0


def _verdict(fit: OutlineFit) -> str:
    """``good``, or ``doubtful`` and why."""
    doubts = []
    if fit.outline_deg < ENOUGH_DEG:
        doubts.append(f"only {fit.outline_deg:.0f}° of the outline are seen")
    if fit.residual_px > DOUBTFUL_RESIDUAL_PX:
        doubts.append(f"edges lie {fit.residual_px:.2f} px from the outline")
    if fit.share < DOUBTFUL_SHARE:
        doubts.append(f"only {100 * fit.share:.0f} % of the edges about the outline lie on it")
    return f"doubtful: {'; '.join(doubts)}" if doubts else "good"
