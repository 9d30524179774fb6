"""Least squares for the arm's circle: what is unknown, and how far it is from the highlights found."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from scipy.special import chdtri

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.light_directions import highlight_pixels
from pbrdf.calibration.sphere import Sphere
from pbrdf.optics.arm import Vector, angle_key, turned

Float = NDArray[np.float64]
Mask = NDArray[np.bool_]

# An angle stands off the circle where its residuals would come once in so many angles by chance.
CHANCE = 1e-5
# centre (3), turn (3) and logarithm of the radius
ARM_UNKNOWNS = 7


@dataclass(frozen=True)
class BallHighlights:
    """Highlights of the lamp on one chrome ball that stands still.

    Attributes
    ----------
    ball : Sphere
        In the camera's frame, mm.
    angles_deg, columns, rows, errors_px : ndarray, shape (n,)
        The arm's angles, each once; places of the highlights and the standard error of a coordinate.
    centre_covariance_mm2 : ndarray, shape (3, 3), optional
        Covariance of the ball's centre; without it the centre counts as exact.
    """

    ball: Sphere
    angles_deg: Float
    columns: Float
    rows: Float
    errors_px: Float
    centre_covariance_mm2: Float | None = None


@dataclass(frozen=True)
class GivenRadius:
    """Radius of the arm's circle measured by hand, and its standard deviation, mm."""

    radius_mm: float
    deviation_mm: float


@dataclass(frozen=True)
class ArmProblem:
    """Measurements, and the frame about which the unknowns are small.

    Unknowns: the circle's centre from the anchor in radii (3), a turn of axis and start (3), the logarithm
    of the radius in `unit_mm`, and for each ball with a covariance its centre in standard deviations (3).
    In radii, a change of scale about the balls, which highlights hardly tell, is one unknown of its own.
    """

    camera: Camera
    series: tuple[BallHighlights, ...]
    radius: GivenRadius | None
    anchor: Float
    axis: Float
    start: Float
    unit_mm: float

    @property
    def unknowns(self) -> int:
        """How many there are."""
        return ARM_UNKNOWNS + 3 * sum(one.centre_covariance_mm2 is not None for one in self.series)

    @property
    def angles(self) -> list[float]:
        """Every angle at which at least one ball showed the highlight."""
        return sorted({angle_key(angle) for one in self.series for angle in one.angles_deg})

    def radius_mm(self, x: Float) -> float:
        """Radius of the circle."""
        return self.unit_mm * float(np.exp(x[6]))

    def spokes(self, x: Float, angles_deg: Float) -> Float:
        """Unit vectors from the circle's centre to the lights, shape (..., 3)."""
        turn = Rotation.from_rotvec(x[3:6])
        spokes: Float = turned(turn.apply(self.start), turn.apply(self.axis), angles_deg)
        return spokes

    def lights(self, x: Float, angles_deg: Float) -> Float:
        """Positions on the circle, shape (n, 3), mm."""
        lights: Float = self.anchor + self.radius_mm(x) * (x[:3] + self.spokes(x, angles_deg))
        return lights

    def balls(self, x: Float) -> list[Sphere]:
        """Balls with their centres moved as far as their covariances let the highlights move them."""
        balls, at = [], ARM_UNKNOWNS
        for one in self.series:
            centre = np.asarray(one.ball.centre_mm)
            if one.centre_covariance_mm2 is not None:
                centre = centre + np.linalg.cholesky(one.centre_covariance_mm2) @ x[at : at + 3]
                at += 3
            balls.append(Sphere(as_vector(centre), one.ball.radius_mm))
        return balls

    def residuals_px(self, x: Float) -> list[Float]:
        """For each ball, found less fitted, shape (n, 2)."""
        differences = []
        for one, ball in zip(self.series, self.balls(x), strict=True):
            columns, rows = highlight_pixels(self.camera, ball, self.lights(x, one.angles_deg))
            differences.append(np.stack([one.columns - columns, one.rows - rows], axis=-1))
        return differences

    def residuals(self, x: Float, left_out: frozenset[float]) -> Float:
        """In standard errors, with the given radius and the balls' centres at the end."""
        parts = []
        for one, difference in zip(self.series, self.residuals_px(x), strict=True):
            kept = ~among(one.angles_deg, left_out)
            parts.append((difference / one.errors_px[:, np.newaxis])[kept].ravel())
        if self.radius is not None:
            deviation = (self.radius_mm(x) - self.radius.radius_mm) / self.radius.deviation_mm
            parts.append(np.array([deviation]))
        return np.concatenate([*parts, x[ARM_UNKNOWNS:]])

    def solve(
        self, x: Float, left_out: frozenset[float], loss: Literal["linear", "soft_l1"] = "linear"
    ) -> Float:
        """Unknowns of the smallest sum of squares, from `x`."""
        found = least_squares(
            self.residuals, x, jac="3-point", loss=loss, f_scale=3.0, args=(left_out,), xtol=1e-12, ftol=1e-12
        )
        return np.asarray(found.x)

    def centred(self, x: Float) -> tuple[ArmProblem, Float]:
        """Take the turn and the radius reached as the new frame, and the unknowns there."""
        turn = Rotation.from_rotvec(x[3:6])
        problem = replace(
            self, axis=turn.apply(self.axis), start=turn.apply(self.start), unit_mm=self.radius_mm(x)
        )
        return problem, np.concatenate([x[:3], np.zeros(4), x[ARM_UNKNOWNS:]])

    def far_off(self, x: Float, left_out: frozenset[float]) -> frozenset[float]:
        """Angles whose residuals are too large for chance, the errors scaled up to the median scatter."""
        squares = dict.fromkeys(self.angles, 0.0)
        freedom = dict.fromkeys(self.angles, 0)
        for one, difference in zip(self.series, self.residuals_px(x), strict=True):
            sums = np.sum((difference / one.errors_px[:, np.newaxis]) ** 2, axis=-1)
            for angle, square in zip(one.angles_deg, sums, strict=True):
                squares[angle_key(angle)] += float(square)
                freedom[angle_key(angle)] += 2
        scatter = [
            squares[angle] / chdtri(freedom[angle], 0.5) for angle in self.angles if angle not in left_out
        ]
        scale = max(1.0, float(np.median(scatter)))
        return frozenset(a for a in self.angles if squares[a] > scale * chdtri(freedom[a], CHANCE))

    def residuals_by_angle(self, x: Float) -> dict[float, list[tuple[float, float]]]:
        """Found less fitted, columns and rows, px; a ball an entry."""
        by_angle: dict[float, list[tuple[float, float]]] = {angle: [] for angle in self.angles}
        for one, difference in zip(self.series, self.residuals_px(x), strict=True):
            for angle, (column, row) in zip(one.angles_deg, difference, strict=True):
                by_angle[angle_key(angle)].append((float(column), float(row)))
        return by_angle

    def centre(self, x: Float, covariance: Float) -> tuple[Float, Float]:
        """Centre of the circle, mm, and its covariance, mm²."""
        radius = self.radius_mm(x)
        change = radius * np.column_stack([np.eye(3), x[:3]])
        chosen = np.ix_([0, 1, 2, 6], [0, 1, 2, 6])
        return self.anchor + radius * x[:3], change @ covariance[chosen] @ change.T

    def direction_errors_deg(self, x: Float, covariance: Float) -> dict[float, float]:
        """Standard error of the direction from the anchor to the light by angle, in its worst direction.

        The unknowns must be those after `centred`, whose turn is zero.
        """
        radius = self.radius_mm(x)
        errors = {}
        for angle in self.angles:
            spoke = self.spokes(x, np.array(angle))
            toward = x[:3] + spoke
            turn = np.column_stack([np.cross(unit, spoke) for unit in np.eye(3)])
            change = radius * np.column_stack([np.eye(3), turn, toward])
            across = np.linalg.svd(toward[np.newaxis])[2][1:] @ change / (radius * np.linalg.norm(toward))
            variance = across @ covariance[:ARM_UNKNOWNS, :ARM_UNKNOWNS] @ across.T
            errors[angle] = float(np.rad2deg(np.sqrt(np.linalg.eigvalsh(variance)[-1])))
        return errors

    def covariance(self, x: Float, left_out: frozenset[float]) -> tuple[Float, float]:
        """Covariance of the unknowns from the Jacobian, and the scale of the errors in it, at least 1."""
        base = self.residuals(x, left_out)
        jacobian = np.empty((base.size, x.size))
        for k in range(x.size):
            step = np.zeros(x.size)
            step[k] = 1e-5
            jacobian[:, k] = (self.residuals(x + step, left_out) - self.residuals(x - step, left_out)) / 2e-5
        _, singular, right = np.linalg.svd(jacobian, full_matrices=False)
        inverse = right.T / np.maximum(singular, 1e-12 * singular[0])
        measured = base[: base.size - (x.size - ARM_UNKNOWNS)]
        scale = max(1.0, float(np.sqrt(measured @ measured / max(measured.size - ARM_UNKNOWNS, 1))))
        return scale**2 * (inverse @ inverse.T), scale


def among(angles_deg: Float, chosen: frozenset[float]) -> Mask:
    """Whether each angle, shape (n,), is one of `chosen`."""
    return np.array([angle_key(angle) in chosen for angle in angles_deg], dtype=bool)


def as_vector(values: Float) -> Vector:
    """Three numbers as a tuple."""
    x, y, z = (float(value) for value in values)
    return x, y, z
