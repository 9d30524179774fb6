"""The circle in which a far camera sees a ball, from one photograph and nothing else."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf.errors import InputError

Float = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Smoothing before the gradient, px, and the gradient in medians from which it counts as an edge.
_SMOOTHING_PX = 1.5
_EDGE = 4.0
# How far an edge may lie from a circle, px, and turn from its radius (cosine), to belong to it.
_NEAR_PX = 2.5
_FINAL_NEAR_PX = 4.0
_RADIAL = 0.96
# Radii of circles that are looked for, in the picture's shorter side.
_RADII = (0.1, 0.6)
_PAIRS, _CANDIDATES, _SAMPLE, _FINALISTS = 200_000, 6000, 4000, 50
# Share of the full turn that must show the outline: below, the circle found may be of mirror images. And by
# how much more than other circles about the same centre, which show edges by chance.
_LEAST_COVER = 0.85
_LEAST_EXCESS = 0.2
_DEGREES = 360
# Edges within such an arc err together: what the background does to one, it does to its neighbours.
_ARC_DEG = 10


@dataclass(frozen=True)
class Circle:
    """Outline of a ball; the first pixel's centre is (0, 0).

    Attributes
    ----------
    column, row, radius_px : float
    error_px : float
        Standard error of the centre's coordinates, ten degrees of the outline counted as one measurement.
    cover : float
        Share of the full turn in which the outline shows.
    """

    column: float
    row: float
    radius_px: float
    error_px: float
    cover: float

    def inside(self, shape: tuple[int, int], share: float = 1.0) -> Mask:
        """Pixels within `share` of the radius, shape `shape`."""
        rows, columns = np.ogrid[: shape[0], : shape[1]]
        mask: Mask = np.hypot(columns - self.column, rows - self.row) < share * self.radius_px
        return mask


@dataclass(frozen=True)
class _Edges:
    """Places (n, 2), column and row, and unit gradients (n, 2)."""

    places: Float
    gradients: Float

    def on(self, centre: Float, radius: float, near_px: float) -> Mask:
        """Which edges lie on a circle and along it, shape (n,)."""
        spokes = self.places - centre
        length = np.hypot(spokes[:, 0], spokes[:, 1])
        radial = np.abs(np.sum(spokes * self.gradients, axis=-1))
        mask: Mask = (np.abs(length - radius) < near_px) & (radial > _RADIAL * length)
        return mask

    def cover(self, centre: Float, radius: float, near_px: float) -> int:
        """Degrees of the circle that show an edge; strong and dense edges count no more than weak ones."""
        return int(np.unique(_degree(self.places[self.on(centre, radius, near_px)] - centre)).size)


def find_circle(image: ArrayLike, source: str | Path = "photograph") -> Circle:
    """Find the outline of a ball by the edges along it.

    Circles through pairs of edges whose gradients point at one centre are candidates. The one whose outline
    shows in most directions wins, so that bright mirror images within the ball do not count by their
    strength, and among whole circles the largest. A robust fit to its edges follows.

    Parameters
    ----------
    image : array_like, shape (rows, columns)
        A photograph with light on the background.
    source : str or Path
        Name of the photograph for errors.

    Raises
    ------
    InputError
        If no circle stands out.
    """
    edges = _edges(image, source)
    shorter = min(np.shape(image))
    best = _best_candidate(edges, shorter)
    if best is None:
        raise InputError(
            source, "outline", "no two edges lie on a circle", "light the background of the ball"
        )
    _refuse_chance(edges, *best, source)
    centre, radius, deviation = _refined(edges, *best)
    cover = edges.cover(centre, radius, _NEAR_PX)
    error = float(deviation * np.sqrt(2 * _ARC_DEG / cover))
    return Circle(float(centre[0]), float(centre[1]), radius, error, cover / _DEGREES)


def _edges(image: ArrayLike, source: str | Path) -> _Edges:
    """Ridges of the gradient, to a fraction of a pixel."""
    picture = np.asarray(image, dtype=np.float32)
    if picture.ndim != 2 or min(picture.shape) < 32 or not np.isfinite(picture).all():
        problem = f"has shape {picture.shape}, or values that are not finite"
        raise InputError(source, "image", problem, "give one plane of at least 32 × 32 finite values")
    smooth = cv2.GaussianBlur(picture, (0, 0), _SMOOTHING_PX)
    across = cv2.Sobel(smooth, cv2.CV_32F, 1, 0, scale=1 / 8)
    down = cv2.Sobel(smooth, cv2.CV_32F, 0, 1, scale=1 / 8)
    strength = np.hypot(across, down)
    length = np.where(strength > 0, strength, 1)
    along = np.stack([across / length, down / length], axis=-1)
    rows, columns = np.mgrid[: picture.shape[0], : picture.shape[1]].astype(np.float32)
    ahead, behind = (
        cv2.remap(strength, columns + sign * along[..., 0], rows + sign * along[..., 1], cv2.INTER_LINEAR)
        for sign in (1, -1)
    )
    ridge = (strength >= ahead) & (strength > behind) & (strength > _EDGE * np.median(strength))
    ridge[:3] = ridge[-3:] = False
    ridge[:, :3] = ridge[:, -3:] = False
    # the top of the parabola through the three strengths
    top = 0.5 * (ahead[ridge] - behind[ridge]) / (2 * strength[ridge] - ahead[ridge] - behind[ridge])
    gradients = along[ridge].astype(np.float64)
    places = np.stack([columns[ridge], rows[ridge]], axis=-1) + top[:, np.newaxis] * gradients
    return _Edges(places, gradients)


def _best_candidate(edges: _Edges, shorter: int) -> tuple[Float, float] | None:
    if len(edges.places) < 3:
        return None
    # the seed is fixed so that a photograph always gives the same circle
    draw = np.random.default_rng(0)
    first, second = draw.integers(len(edges.places), size=(2, _PAIRS))
    chord = edges.places[second] - edges.places[first]
    towards = 2 * np.sum(chord * edges.gradients[first], axis=-1)
    # the centre lies on the first edge's gradient, as far from the second edge
    with np.errstate(divide="ignore", invalid="ignore"):
        steps = np.sum(chord**2, axis=-1) / towards
        centres = edges.places[first] + steps[:, np.newaxis] * edges.gradients[first]
        spokes = (edges.places[second] - centres) / steps[:, np.newaxis]
        agree = np.abs(np.sum(spokes * edges.gradients[second], axis=-1)) > 0.99
    radii = np.abs(steps)
    sensible = agree & (radii > _RADII[0] * shorter) & (radii < _RADII[1] * shorter)
    sensible &= np.sum(chord**2, axis=-1) > radii**2
    chosen = np.flatnonzero(sensible)[:_CANDIDATES]
    if chosen.size == 0:
        return None
    few = draw.permutation(len(edges.places))[:_SAMPLE]
    sample = _Edges(edges.places[few], edges.gradients[few])
    rough = np.array([sample.cover(centres[k], radii[k], _NEAR_PX) for k in chosen])

    def fullest(among: NDArray[np.intp]) -> tuple[int, int]:
        """Degrees and number of the candidate that shows in most directions."""
        finalists = chosen[among[np.argsort(-rough[among], kind="stable")[:_FINALISTS]]]
        return max((edges.cover(centres[k], radii[k], _NEAR_PX), -int(k)) for k in finalists)

    best = -fullest(np.arange(chosen.size))[1]
    while True:
        # the mirror image of a ring may be a whole circle too, but it lies within the outline
        larger = np.flatnonzero(radii[chosen] > radii[best] + 4 * _NEAR_PX)
        if larger.size == 0:
            break
        cover, number = fullest(larger)
        if cover < _LEAST_COVER * _DEGREES:
            break
        best = -number
    return centres[best], float(radii[best])


def _refuse_chance(edges: _Edges, centre: Float, radius: float, source: str | Path) -> None:
    cover = edges.cover(centre, radius, _NEAR_PX) / _DEGREES
    apart = 4 * _NEAR_PX * np.arange(1, 6)
    radii = radius + np.concatenate([-apart, apart])
    others = float(np.median([edges.cover(centre, other, _NEAR_PX) for other in radii])) / _DEGREES
    if cover < _LEAST_COVER or cover - others < _LEAST_EXCESS:
        problem = (
            f"no circle stands out: the best shows an edge in {cover:.0%} of all directions, others about "
            f"the same centre in {others:.0%}"
        )
        raise InputError(
            source, "outline", problem, "light the background of the ball, or focus on its outline"
        )


def _refined(edges: _Edges, centre: Float, radius: float) -> tuple[Float, float, float]:
    """Robust circle through the edges near it, each degree with the same weight; and their deviation."""
    deviation = _NEAR_PX
    for _ in range(20):
        members = edges.on(centre, radius, _FINAL_NEAR_PX)
        spokes = edges.places[members] - centre
        length = np.hypot(spokes[:, 0], spokes[:, 1])
        apart = length - radius
        # Cauchy's weights: mirror images beside the outline pull little
        deviation = max(1.4826 * float(np.median(np.abs(apart))), 0.1)
        degrees = _degree(spokes)
        weights = 1 / (1 + (apart / deviation) ** 2) / np.bincount(degrees, minlength=_DEGREES)[degrees]
        jacobian = np.column_stack([spokes / length[:, np.newaxis], np.ones(len(length))])
        weighted = jacobian * weights[:, np.newaxis]
        step = np.linalg.solve(jacobian.T @ weighted, weighted.T @ apart)
        centre, radius = centre + step[:2], radius + float(step[2])
    return centre, radius, deviation


def _degree(spokes: Float) -> NDArray[np.intp]:
    turn = np.degrees(np.arctan2(spokes[:, 1], spokes[:, 0]))
    return np.floor(turn).astype(np.intp) % _DEGREES
