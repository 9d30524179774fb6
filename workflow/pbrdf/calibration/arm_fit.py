"""The arm's circle from the lamp's highlights on chrome balls, by least squares in the photographs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from scipy.special import chdtri

from pbrdf.calibration.arm_problem import (
    CHANCE,
    ArmProblem,
    BallHighlights,
    GivenRadius,
    as_vector,
)
from pbrdf.calibration.camera import Camera
from pbrdf.calibration.light_directions import highlight_pixels, mirrored_rays
from pbrdf.errors import InputError
from pbrdf.optics.arm import Vector, angle_key

Float = NDArray[np.float64]

# Standard error of a light's direction, and how far the lights may stand off their circle on the whole,
# for the calibration to be called usable; and how far a single one may.
DIRECTION_LIMIT_DEG = 0.05
OFFSET_LIMIT_DEG = 1.0
_OFFSETS_LIMIT = 1 / 3
_LEAST_ANGLES = 5
_LEAST_SPAN_DEG = 20.0


@dataclass(frozen=True)
class ArmFit:
    """The arm's circle in the camera's frame, and how well it is known.

    Attributes
    ----------
    centre_mm, axis, start : Vector
        As in `pbrdf.optics.arm.Arm`.
    radius_mm : float
    offsets_mm : dict of float to Vector
        By angle: where the light stands off the circle, across the line from the balls, for the angles
        whose residuals the highlights' errors do not explain.
    centre_errors_mm : Vector
        Standard errors; they and the following are scaled up where the highlights scatter more than their
        errors say.
    axis_error_deg, start_error_deg, radius_error_mm : float
        Of the axis's tilt in its worst direction, of the turn about it, of the radius.
    direction_errors_deg : dict of float to float
        By angle: standard error of the direction toward the light from the balls' middle, in its worst
        direction.
    residuals_px : dict of float to list of tuple
        By angle, a ball an entry: columns and rows of the found highlight less those of the fit, with the
        offsets.
    usable : bool
    verdict : str
        In words, beginning with "usable" or "unusable".
    notes : tuple of str
        What the measurement leaves open.
    """

    centre_mm: Vector
    axis: Vector
    start: Vector
    radius_mm: float
    offsets_mm: dict[float, Vector]
    centre_errors_mm: Vector
    axis_error_deg: float
    start_error_deg: float
    radius_error_mm: float
    direction_errors_deg: dict[float, float]
    residuals_px: dict[float, list[tuple[float, float]]]
    usable: bool
    verdict: str
    notes: tuple[str, ...]


def fit_arm(
    camera: Camera,
    series: Sequence[BallHighlights],
    radius: GivenRadius | None = None,
    source: str | Path = "highlights",
    limit_deg: float = DIRECTION_LIMIT_DEG,
) -> ArmFit:
    """Fit one circle to the highlights on one or more balls.

    The residuals are those of the highlights' places in the photographs, in units of their errors; a given
    radius and the covariances of the balls' centres weigh in as further measurements. An angle whose
    residuals would come by chance once in 1e5 times, after the errors are scaled up to the median scatter,
    leaves the fit of the circle and gets an offset of its own, across the line from the balls.

    Parameters
    ----------
    camera : Camera
    series : sequence of BallHighlights
    radius : GivenRadius, optional
        Needed with a single ball, whose highlights tell directions but hardly distances.
    source : str or Path
        Name of the highlights for errors.
    limit_deg : float
        Standard error of a light's direction, and distance of the lights from their circle beyond the
        highlights' errors, from which the fit is called unusable.

    Raises
    ------
    InputError
        If a series does not fit together, names an angle twice, or a highlight lies outside its ball; if
        there are fewer than five angles or they span less than 20°; if the given radius is none.
    """
    _check(series, radius, source)
    problem = _first_guess(camera, series, radius, source)
    left_out: frozenset[float] = frozenset()
    x = problem.solve(np.zeros(problem.unknowns), left_out, loss="soft_l1")
    for _ in range(10):
        problem, x = problem.centred(x)
        x = problem.solve(x, left_out)
        found = problem.far_off(x, left_out)
        if found == left_out or len(problem.angles) - len(found) < _LEAST_ANGLES:
            break
        left_out = found
    return _report(*problem.centred(x), left_out, limit_deg)


def _check(series: Sequence[BallHighlights], radius: GivenRadius | None, source: str | Path) -> None:
    if not series:
        raise InputError(
            source, "series", "holds no ball", "photograph the lamp's highlight on a chrome ball"
        )
    for number, one in enumerate(series):
        field = f"series[{number}]"
        arrays = (one.angles_deg, one.columns, one.rows, one.errors_px)
        if len({array.shape for array in arrays}) != 1 or one.angles_deg.ndim != 1:
            raise InputError(source, field, "has arrays of different lengths", "give one entry an angle")
        if not all(np.isfinite(array).all() for array in arrays):
            raise InputError(source, field, "holds values that are not finite", "find the highlights again")
        if (one.errors_px <= 0).any():
            raise InputError(source, f"{field}.errors_px", "has an error that is not above zero", "give it")
        names, counts = np.unique(np.round(one.angles_deg, 2), return_counts=True)
        if (counts > 1).any():
            twice = ", ".join(f"{angle:.2f}°" for angle in names[counts > 1])
            raise InputError(source, f"{field}.angles_deg", f"uses {twice} twice", "give each angle once")
    for number, one in enumerate(series):
        if one.centre_covariance_mm2 is not None and not _is_covariance(one.centre_covariance_mm2):
            problem = "is no positive definite 3 × 3 covariance"
            raise InputError(
                source, f"series[{number}].centre_covariance_mm2", problem, "leave it out, or correct it"
            )
    angles = {angle_key(angle) for one in series for angle in one.angles_deg}
    span = max(angles) - min(angles)
    if len(angles) < _LEAST_ANGLES or span < _LEAST_SPAN_DEG:
        problem = f"hold {len(angles)} angles of the arm over {span:g}°"
        raise InputError(
            source, "series", problem, f"photograph at least {_LEAST_ANGLES} over {_LEAST_SPAN_DEG:g}°"
        )
    if radius is not None and not (0 < radius.deviation_mm < radius.radius_mm < np.inf):
        problem = f"is {radius.radius_mm:g} ± {radius.deviation_mm:g} mm"
        raise InputError(
            source, "radius", problem, "give a length and a smaller standard deviation above zero"
        )


def _first_guess(
    camera: Camera, series: Sequence[BallHighlights], radius: GivenRadius | None, source: str | Path
) -> ArmProblem:
    """Circle about the balls' middle, turned as the mirrored rays are (Kabsch's rotation)."""
    middle = np.mean([one.ball.centre_mm for one in series], axis=0)
    directions = [mirrored_rays(camera, one.ball, one.columns, one.rows, source)[1] for one in series]
    angles = np.deg2rad(np.concatenate([one.angles_deg for one in series]))
    flat = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=-1)
    rotation = Rotation.align_vectors(np.concatenate(directions), flat)[0].as_matrix()
    guess = float(np.linalg.norm(middle)) if radius is None else radius.radius_mm
    return ArmProblem(camera, tuple(series), radius, middle, rotation[:, 2], rotation[:, 0], guess)


@dataclass(frozen=True)
class _Sideways:
    """What one angle's highlights say of where its light stands, across the line from the balls.

    Attributes
    ----------
    offset_mm : ndarray, shape (3,)
        From the circle to the place that the highlights tell best.
    covariance_mm2 : ndarray, shape (2, 2)
    distance_mm : float
        From the balls' middle to the light.
    residuals_px : list of tuple
        Left at that place, a ball an entry.
    contradicted : bool
        Whether the balls disagree there by more than chance.
    """

    offset_mm: Float
    covariance_mm2: Float
    distance_mm: float
    residuals_px: list[tuple[float, float]]
    contradicted: bool


def _sideways(problem: ArmProblem, x: Float, angle_deg: float, scale: float) -> _Sideways:
    light = problem.lights(x, np.array([angle_deg]))[0]
    toward = light - problem.anchor
    distance = float(np.linalg.norm(toward))
    across = np.linalg.svd(toward[np.newaxis])[2][1:]
    found, errors, balls = [], [], []
    for one, ball in zip(problem.series, problem.balls(x), strict=True):
        for k, angle in enumerate(one.angles_deg):
            if angle_key(angle) == angle_deg:
                found.append((one.columns[k], one.rows[k]))
                errors.append(one.errors_px[k])
                balls.append(ball)

    def differences(step: Float) -> Float:
        at = light + distance * step @ across
        fitted = [highlight_pixels(problem.camera, ball, at) for ball in balls]
        apart: Float = np.array(found) - np.array(fitted)
        return apart

    def weighed(step: Float) -> Float:
        weighted: Float = differences(step) / np.array(errors)[:, np.newaxis]
        return weighted.ravel()

    best = least_squares(weighed, np.zeros(2), jac="3-point", xtol=1e-12, ftol=1e-12)
    jacobian, freedom = np.asarray(best.jac, dtype=np.float64), best.fun.size - 2
    return _Sideways(
        distance * best.x @ across,
        np.asarray(distance**2 * np.linalg.inv(jacobian.T @ jacobian), dtype=np.float64),
        distance,
        [(float(column), float(row)) for column, row in differences(best.x)],
        freedom > 0 and bool(best.fun @ best.fun > scale**2 * chdtri(freedom, CHANCE)),
    )


def _report(problem: ArmProblem, x: Float, left_out: frozenset[float], limit_deg: float) -> ArmFit:
    covariance, scale = problem.covariance(x, left_out)
    places = {angle: _sideways(problem, x, angle, scale) for angle in problem.angles}
    radius = problem.radius_mm(x)
    offsets = {angle: as_vector(places[angle].offset_mm) for angle in sorted(left_out)}
    residuals = problem.residuals_by_angle(x) | {a: places[a].residuals_px for a in left_out}
    errors = problem.direction_errors_deg(x, covariance) | {
        a: scale * _worst_deg(places[a].covariance_mm2, places[a].distance_mm) for a in left_out
    }
    centre, spread = problem.centre(x, covariance)
    turn = covariance[3:6, 3:6]
    tilts = np.stack([problem.start, np.cross(problem.axis, problem.start)])
    kept = {angle: place for angle, place in places.items() if angle not in left_out}
    faults = _faults(errors, places, left_out, _excess_deg(kept), limit_deg)
    verdict = "; ".join(faults) if faults else _praise(errors, residuals, scale, offsets)
    return ArmFit(
        centre_mm=as_vector(centre),
        axis=as_vector(problem.axis),
        start=as_vector(problem.start),
        radius_mm=radius,
        offsets_mm=offsets,
        centre_errors_mm=as_vector(np.sqrt(np.diag(spread))),
        axis_error_deg=_worst_deg(tilts @ turn @ tilts.T, 1.0),
        start_error_deg=float(np.rad2deg(np.sqrt(problem.axis @ turn @ problem.axis))),
        radius_error_mm=float(radius * np.sqrt(covariance[6, 6])),
        direction_errors_deg=dict(sorted(errors.items())),
        residuals_px=dict(sorted(residuals.items())),
        usable=not faults,
        verdict=f"{'unusable' if faults else 'usable'}: {verdict}",
        notes=_notes(problem, radius),
    )


def _faults(
    errors: Mapping[float, float],
    places: Mapping[float, _Sideways],
    left_out: frozenset[float],
    excess_deg: float,
    limit_deg: float,
) -> list[str]:
    """What forbids the use of a fit, in words."""
    faults = []
    worst = max(errors, key=lambda angle: errors[angle])
    if not errors[worst] <= limit_deg:
        faults.append(
            f"the light's direction at {worst:.2f}° of the arm is known to {errors[worst]:.2g}° only, and "
            f"{limit_deg:g}° are needed: measure the "
            "arm's radius, a second place of the ball, or more angles"
        )
    if len(left_out) > _OFFSETS_LIMIT * len(places):
        faults.append(
            f"{len(left_out)} of {len(places)} angles do not stand on one circle: check the angles' names "
            "and the arm's bearing"
        )
    elif excess_deg > limit_deg:
        faults.append(
            f"the lights stand {excess_deg:.2g}° off one circle, beyond the highlights' errors: check the "
            "arm's bearing, the camera and the ball's outline"
        )
    for angle in sorted(left_out):
        place = places[angle]
        off_deg = float(np.rad2deg(np.linalg.norm(place.offset_mm) / place.distance_mm))
        if off_deg > OFFSET_LIMIT_DEG:
            faults.append(
                f"at {angle:.2f}° the light stands {off_deg:.2g}° off the circle: check that photograph"
            )
        elif place.contradicted:
            faults.append(f"at {angle:.2f}° the balls contradict each other: check those photographs")
    return faults


def _praise(
    errors: Mapping[float, float],
    residuals: Mapping[float, list[tuple[float, float]]],
    scale: float,
    offsets: Mapping[float, Vector],
) -> str:
    every = np.concatenate([np.array(pairs).ravel() for pairs in residuals.values()])
    scaled = "" if scale == 1 else f", {scale:.1f} times what their errors say"
    own = (
        f"{len(offsets)} of {len(errors)} angles have an offset of their own"
        if offsets
        else "no angle stands off it"
    )
    return (
        f"light directions to {max(errors.values()):.2g}° at worst (one standard error); the highlights "
        f"scatter by {np.sqrt(np.mean(every**2)):.2g} px about the circle{scaled}; {own}"
    )


def _excess_deg(places: Mapping[float, _Sideways]) -> float:
    """Rms distance of the lights from the circle that the highlights' own errors do not explain."""
    squares = [
        (place.offset_mm @ place.offset_mm - np.trace(place.covariance_mm2)) / place.distance_mm**2
        for place in places.values()
    ]
    return float(np.rad2deg(np.sqrt(max(0.0, float(np.mean(squares))))))


def _notes(problem: ArmProblem, radius_mm: float) -> tuple[str, ...]:
    centres = np.array([one.ball.centre_mm for one in problem.series])
    ball = problem.series[0].ball
    if np.ptp(centres, axis=0).max() > ball.radius_mm:
        return ()
    told = "nothing but their small parallax tells it"
    if problem.radius is not None:
        given = problem.radius
        told = f"it rests on the radius given as {given.radius_mm:g} ± {given.deviation_mm:g} mm"
    return (
        "A ball in one place tells the rays toward the lights, not how far these stand on them: "
        f"{told}. A ray passes up to r sin(θt/2) = {ball.radius_mm:.3g} mm beside the ball's centre, so an "
        "error of 1 % in the distance turns a light, seen from there, by up to "
        f"{np.rad2deg(0.01 * ball.radius_mm / radius_mm):.2g}°. A second place of the ball removes this.",
    )


def _worst_deg(covariance: Float, length: float) -> float:
    """Angle of the worst standard deviation of a covariance across a line of some length."""
    return float(np.rad2deg(np.sqrt(np.linalg.eigvalsh(covariance)[-1]) / length))


def _is_covariance(matrix: Float) -> bool:
    if matrix.shape != (3, 3) or not np.allclose(matrix, matrix.T):
        return False
    return bool(np.linalg.eigvalsh(matrix)[0] > 0)
