"""The arm's circle from highlights: a tilted axis, balls beside the centre, a tenth of a pixel of noise."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pbrdf.calibration.arm_fit import ArmFit, fit_arm
from pbrdf.calibration.arm_problem import BallHighlights, GivenRadius
from pbrdf.calibration.camera import Camera
from pbrdf.calibration.sphere import Sphere
from pbrdf.errors import InputError
from pbrdf.optics.arm import Arm, generator_axis_at_zero

Float = NDArray[np.float64]
Path = Callable[[Sphere, Float], Float]
Take = Callable[..., BallHighlights]

TILT = Rotation.from_euler("xz", [1.5, 1.32], degrees=True)
GENERATOR = (0.0, -1.0, 0.0)


def turned_by_tilt(x: float, y: float, z: float) -> tuple[float, float, float]:
    a, b, c = TILT.apply([x, y, z])
    return float(a), float(b), float(c)


ARM = Arm((6.0, -4.0, 1004.0), turned_by_tilt(0, -1, 0), turned_by_tilt(0, 0, -1), 800.0, GENERATOR)
# a ball of a thousand pixels' radius, as in the camera of the paper
CAMERA = Camera((40_000.0, 40_000.0), (1688.0, 1352.0), 2704, 3376)
NEAR, BESIDE = Sphere((1.5, -2.0, 1001.0), 25.0), Sphere((45.0, -2.0, 970.0), 25.0)
ANGLES = np.arange(10.0, 161.0, 5.0)
SPHERE_AT = np.array([0.0, 0.0, 1000.0])
NOISE_PX = 0.1


@pytest.fixture(scope="module")
def take(shortest_path_point: Path) -> Take:
    """Highlights on a ball as they would be found: places by Fermat's principle, and noise."""

    @cache
    def places(ball: Sphere) -> tuple[Float, Float]:
        points = np.array([shortest_path_point(ball, ARM.light_position(angle)) for angle in ANGLES])
        return CAMERA.project(points)

    def taken(ball: Sphere, seed: int, noise_px: float = NOISE_PX) -> BallHighlights:
        draw = np.random.default_rng(seed)
        columns, rows = (part + draw.normal(0, noise_px, len(ANGLES)) for part in places(ball))
        return BallHighlights(ball, ANGLES, columns, rows, np.full(len(ANGLES), NOISE_PX))

    return taken


def errors_deg(fit: ArmFit, angles: Float = ANGLES, truth: Arm = ARM) -> Float:
    """Between the directions of the lights, found and true, as the sphere sees them."""
    found = fitted(fit)
    cosines = []
    for angle in angles:
        a, b = (arm.light_position(float(angle)) - SPHERE_AT for arm in (found, truth))
        cosines.append(np.linalg.norm(np.cross(a, b)) / np.linalg.norm(a) / np.linalg.norm(b))
    return np.rad2deg(np.arcsin(cosines))


def fitted(fit: ArmFit) -> Arm:
    return Arm(fit.centre_mm, fit.axis, fit.start, fit.radius_mm, GENERATOR, fit.offsets_mm)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("given_mm", [792.0, 808.0])
def test_directions_to_a_twentieth_of_a_degree_with_the_radius_to_a_hundredth(
    take: Take, seed: int, given_mm: float
) -> None:
    fit = fit_arm(CAMERA, [take(NEAR, seed)], GivenRadius(given_mm, 8.0))
    assert errors_deg(fit).max() < 0.05
    assert fit.verdict.startswith("usable")
    assert "how far these stand" in fit.notes[0]


@pytest.mark.parametrize("seed", range(4))
def test_directions_to_a_twentieth_of_a_degree_with_two_places_of_the_ball(take: Take, seed: int) -> None:
    fit = fit_arm(CAMERA, [take(NEAR, seed), take(BESIDE, seed + 100)])
    assert errors_deg(fit).max() < 0.05
    assert fit.usable
    assert fit.notes == ()
    assert fit.radius_mm == pytest.approx(800.0, abs=4 * fit.radius_error_mm)
    assert fit.radius_error_mm < 3


def test_one_ball_alone_is_called_unusable_because_the_distance_stays_open(take: Take) -> None:
    fit = fit_arm(CAMERA, [take(NEAR, 0)])
    assert not fit.usable
    assert fit.verdict.startswith("unusable")
    assert "radius" in fit.verdict
    assert fit.radius_error_mm > 20


def test_without_noise_the_arm_is_found_exactly(take: Take) -> None:
    fit = fit_arm(CAMERA, [take(NEAR, 0, 0.0), take(BESIDE, 0, 0.0)])
    np.testing.assert_allclose(fit.centre_mm, ARM.centre_mm, atol=0.01)
    np.testing.assert_allclose(fit.axis, ARM.axis, atol=1e-6)
    np.testing.assert_allclose(fit.start, ARM.start, atol=1e-5)
    assert errors_deg(fit).max() < 1e-4


def test_the_generator_turns_about_the_calibrated_axis(take: Take) -> None:
    """Known in the straight line, carried to zero and back to any angle: the tilt of two degrees shows."""
    true = replace(ARM, generator_axis=turned_by_tilt(0.0, -1.0, 0.02))
    fit = fit_arm(CAMERA, [take(NEAR, 1), take(BESIDE, 2)])
    at_zero = generator_axis_at_zero(true.generator_x(180.0), 180.0, fit.axis)
    measured = replace(fitted(fit), generator_axis=at_zero)
    upright = replace(measured, axis=(0.0, -1.0, 0.0))
    worst, naive = (
        max(np.rad2deg(np.arccos(min(1.0, arm.generator_x(a) @ true.generator_x(a)))) for a in ANGLES)
        for arm in (measured, upright)
    )
    assert worst < 0.02
    assert naive > 1.0


def test_standard_errors_are_those_of_repeated_fits(take: Take) -> None:
    fits = [fit_arm(CAMERA, [take(NEAR, seed), take(BESIDE, seed + 500)]) for seed in range(24)]
    scatter = np.std([fit.radius_mm for fit in fits])
    assert 0.6 < scatter / np.median([fit.radius_error_mm for fit in fits]) < 1.5
    centres = np.std([fit.centre_mm for fit in fits], axis=0)
    claimed = np.median([fit.centre_errors_mm for fit in fits], axis=0)
    assert ((centres / claimed > 0.6) & (centres / claimed < 1.5)).all()


def test_an_uncertain_centre_of_the_ball_shows_in_the_errors(take: Take) -> None:
    exact = take(NEAR, 3)
    moved = Sphere((1.5, -2.0, 1001.3), 25.0)
    covariance = np.diag([0.01, 0.01, 0.3]) ** 2
    uncertain = replace(exact, ball=moved, centre_covariance_mm2=covariance)
    radius = GivenRadius(800.0, 8.0)
    fit = fit_arm(CAMERA, [uncertain], radius)
    assert max(fit.direction_errors_deg.values()) > max(
        fit_arm(CAMERA, [exact], radius).direction_errors_deg.values()
    )
    assert errors_deg(fit).max() < 4 * max(fit.direction_errors_deg.values())


def test_an_angle_off_the_circle_gets_an_offset_of_its_own(take: Take, shortest_path_point: Path) -> None:
    off = replace(ARM, offsets_mm={90.0: (0.0, 5.0, 0.0)})
    series = []
    for ball, seed in ((NEAR, 5), (BESIDE, 6)):
        one = take(ball, seed)
        column, row = CAMERA.project(shortest_path_point(ball, off.light_position(90.0)))
        at = ANGLES == 90.0
        series.append(
            replace(one, columns=np.where(at, column, one.columns), rows=np.where(at, row, one.rows))
        )
    fit = fit_arm(CAMERA, series)
    assert list(fit.offsets_mm) == [90.0]
    assert "1 of 31 angles" in fit.verdict
    assert errors_deg(fit, truth=off).max() < 0.05
    assert np.max(np.abs(fit.residuals_px[90.0])) < 0.5


def test_lights_off_the_circle_everywhere_are_called_unusable(take: Take) -> None:
    one = take(NEAR, 0)
    shaken = replace(one, rows=one.rows + np.random.default_rng(0).normal(0, 5, len(ANGLES)))
    fit = fit_arm(CAMERA, [shaken], GivenRadius(800.0, 8.0))
    assert not fit.usable
    assert "circle" in fit.verdict


def test_a_photograph_under_a_wrong_angle_is_called_unusable(take: Take) -> None:
    one = take(NEAR, 0)
    wrong = replace(one, angles_deg=np.where(ANGLES == 60.0, 63.0, ANGLES))
    fit = fit_arm(CAMERA, [wrong], GivenRadius(800.0, 8.0))
    assert not fit.usable
    assert "63.00°" in fit.verdict


def test_balls_that_contradict_each_other_are_called_unusable(take: Take) -> None:
    one, other = take(NEAR, 0), take(BESIDE, 1)
    fit = fit_arm(CAMERA, [one, replace(other, rows=other.rows + np.where(ANGLES == 60.0, 8.0, 0.0))])
    assert not fit.usable
    assert "60.00°" in fit.verdict


def test_input_that_is_none_is_refused(take: Take) -> None:
    one = take(NEAR, 0)

    def refusal(series: Sequence[BallHighlights], radius: GivenRadius | None = None) -> str:
        with pytest.raises(InputError) as caught:
            fit_arm(CAMERA, series, radius, source="chrome")
        return str(caught.value)

    def some(chosen: Float) -> BallHighlights:
        return replace(
            one,
            angles_deg=ANGLES[chosen],
            columns=one.columns[chosen],
            rows=one.rows[chosen],
            errors_px=one.errors_px[chosen],
        )

    assert "holds no ball" in refusal([])
    assert "uses 25.00° twice" in refusal([replace(one, angles_deg=np.where(ANGLES == 20, 25.0, ANGLES))])
    assert "at least 5" in refusal([some(np.arange(4))])
    assert "over 20°" in refusal([some(ANGLES < 30)])
    assert "outside the ball" in refusal(
        [replace(one, columns=one.columns + np.where(ANGLES == 60, 3000, 0))]
    )
    assert "different lengths" in refusal([replace(one, rows=one.rows[:-1])])
    assert "not finite" in refusal([replace(one, rows=one.rows * np.nan)])
    assert "not above zero" in refusal([replace(one, errors_px=0 * ANGLES)])
    assert "radius" in refusal([one], GivenRadius(800.0, 0.0))
    assert "covariance" in refusal([replace(one, centre_covariance_mm2=np.zeros((3, 3)))])
