"""What every calibration is tested with: the rigs of the project, and a chrome ball by independent laws."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.sphere import Sphere
from pbrdf.settings.rig import RigSettings, read_rig

RIGS = Path(__file__).resolve().parents[2] / "config/rig"
Float = NDArray[np.float64]


@pytest.fixture(scope="session")
def virtual() -> RigSettings:
    return read_rig(RIGS / "virtual.yaml")


@pytest.fixture(scope="session")
def real() -> RigSettings:
    return read_rig(RIGS / "kaist2020.yaml")


@pytest.fixture(scope="session")
def shortest_path_point() -> Callable[[Sphere, Float], Float]:
    """Point of a ball with the shortest way from the camera over it to a light (Fermat's principle)."""

    def found(ball: Sphere, light: Float) -> Float:
        centre = np.asarray(ball.centre_mm)
        spoke = light - centre
        middle = spoke / np.linalg.norm(spoke) - centre / np.linalg.norm(centre)
        across = np.linalg.svd(middle[np.newaxis])[2][1:]

        def point(tilt: Float) -> Float:
            normal = middle / np.linalg.norm(middle) + tilt @ across
            return centre + ball.radius_mm * normal / np.linalg.norm(normal)

        def way(tilt: Float) -> float:
            return float(np.linalg.norm(point(tilt)) + np.linalg.norm(light - point(tilt)))

        options = {"xatol": 1e-10, "fatol": 0, "maxfev": 400}
        return point(minimize(way, np.zeros(2), method="Nelder-Mead", options=options).x)

    return found


@pytest.fixture(scope="session")
def photograph() -> Callable[..., Float]:
    """Ray tracer: the share of each pixel in which a ball mirrors a round lamp of radiance one."""

    def taken(camera: Camera, ball: Sphere, light: Float, lamp_radius_mm: float, samples: int = 8) -> Float:
        grid = (np.arange(samples) + 0.5) / samples - 0.5
        rows = (np.arange(camera.rows)[:, np.newaxis] + grid).ravel()
        columns = (np.arange(camera.columns)[:, np.newaxis] + grid).ravel()
        x, y = np.meshgrid(
            (columns - camera.principal_px[0]) / camera.focal_px[0],
            (rows - camera.principal_px[1]) / camera.focal_px[1],
        )
        sight = np.stack([x, y, np.ones_like(x)], axis=-1).reshape(-1, 3)
        sight /= np.linalg.norm(sight, axis=-1, keepdims=True)
        centre = np.asarray(ball.centre_mm)
        # the nearer root of |t d − c|² = r²
        half = sight @ centre
        root = half * half - centre @ centre + ball.radius_mm**2
        hit = root > 0
        at = (half[hit] - np.sqrt(root[hit]))[:, np.newaxis] * sight[hit]
        normal = (at - centre) / ball.radius_mm
        householder = np.eye(3) - 2 * np.einsum("ni,nj->nij", normal, normal)
        away = np.einsum("nij,nj->ni", householder, sight[hit])
        to_light = light - at
        ahead = np.einsum("ni,ni->n", away, to_light)
        beside = np.linalg.norm(to_light - ahead[:, np.newaxis] * away, axis=-1)
        seen = np.zeros(hit.shape)
        seen[hit] = (ahead > 0) & (beside < lamp_radius_mm)
        return seen.reshape(camera.rows, samples, camera.columns, samples).mean(axis=(1, 3))

    return taken
