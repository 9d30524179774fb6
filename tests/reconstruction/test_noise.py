"""The noise that is stored is the noise that repeated photographs have."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml
from noise_twin import covariance, turned_variance
from numpy.typing import NDArray
from rig_truth import radiometry_content

from pbrdf.calibration.radiometry import Radiometry
from pbrdf.capture.frames import FrameIndex
from pbrdf.instruments.interface import Setting
from pbrdf.instruments.virtual_geometry import virtual_polarimeter
from pbrdf.instruments.virtual_rig import VirtualRig
from pbrdf.optics.mueller import rotator
from pbrdf.reconstruction.mueller_image import reconstruct
from pbrdf.reconstruction.noise import NoiseModel
from pbrdf.reconstruction.reduction import data_reduction
from pbrdf.settings.plan import Light

Float = NDArray[np.float64]

REPEATS = 200
SIDE = 32
BAND = 550
LIGHT = Light("090.00", 90.0)
SECONDS = (0.005, 0.08)
DARKS = 4
STATES = tuple((0.0, 25.0 * n % 360, 5.0 * n, 90.0) for n in range(36))
WHOLE = (slice(0, SIDE), slice(0, SIDE))


def brewster(index: float = 1.5) -> Float:
    """Reflection just off Brewster's angle, over M00, x across the plane of incidence (Born & Wolf 1.5.2)."""
    theta = np.arctan(index) - np.deg2rad(1.5)
    inside = np.arcsin(np.sin(theta) / index)
    s = -np.sin(theta - inside) / np.sin(theta + inside)
    p = np.tan(theta - inside) / np.tan(theta + inside)
    mean, difference, both = (s * s + p * p) / 2, (s * s - p * p) / 2, s * p
    mueller = np.diag([mean, mean, both, both])
    mueller[0, 1] = mueller[1, 0] = difference
    return mueller / mean


SUBJECTS = {"air": np.eye(4), "mirror": np.diag([1.0, 1.0, -1.0, -1.0]), "brewster": brewster()}


@dataclass(frozen=True)
class Patch:
    """The same matrix in every pixel, from a hundredth of the long exposure's range to ten times it."""

    name: str
    matrix: Float
    truth: str = "patch"

    def mueller_image(self, angle_deg: float, band_nm: int) -> NDArray[np.float32]:
        brightness = np.geomspace(1e-3, 1.2, SIDE * SIDE).reshape(SIDE, SIDE, 1)
        return (brightness * self.matrix.ravel()).astype(np.float32)


class Photographs:
    """What a light's frame store gives, straight from the rig."""

    path = "photographs"

    def __init__(self, rig: VirtualRig) -> None:
        form = rig.frame_format
        self._rig = rig
        self.header = SimpleNamespace(
            bands_nm=(BAND,),
            states_deg=STATES,
            exposures_s=SECONDS,
            references=(),
            darks=DARKS,
            rows=form.rows,
            columns=form.columns,
            dtype=form.dtype,
            shift=form.shift,
            saturation=form.saturation,
        )

    def saturating_at(self, limit: float) -> Photographs:
        assert limit >= self.header.saturation
        return self

    def read_states(
        self, band_nm: int, rows: slice, columns: slice, into: list[NDArray[Any]]
    ) -> Iterator[NDArray[Any]]:
        frames = []
        for n, state in enumerate(STATES):
            settings = [Setting(LIGHT, band_nm, state, seconds, position=n) for seconds in SECONDS]
            frames.append([self._rig.expose(FrameIndex(band_nm, n, e).id, s) for e, s in enumerate(settings)])
        for first in range(0, len(STATES), len(into[0])):
            yield np.array(frames[first : first + len(into[0])])

    def mean_dark(self, rows: slice, columns: slice) -> NDArray[np.float32]:
        frames = [
            [self._rig.expose_dark(FrameIndex(None, r, e).id, seconds) for r in range(DARKS)]
            for e, seconds in enumerate(SECONDS)
        ]
        return np.mean(frames, axis=1, dtype=np.float64).astype(np.float32)


@dataclass(frozen=True)
class Repeated:
    """Matrices and variances of every repetition (REPEATS, pixels, 16), and what they should be."""

    mueller: Float
    variance: Float
    truth: Float
    model: NoiseModel
    weighted_share: float


@pytest.fixture(scope="module", params=SUBJECTS)
def repeated(request: pytest.FixtureRequest) -> Repeated:
    rig = yaml.safe_load((request.config.rootpath / "config/rig/virtual.yaml").read_text(encoding="utf-8"))
    for imperfection in ("vignetting", "hot_pixels", "lamp_drift"):
        rig.pop(imperfection, None)
    rig["camera"] |= {"rows": SIDE, "columns": SIDE}
    truth = radiometry_content(rig)
    scale = truth["scale"][str(BAND)]
    radiometry = Radiometry(truth["dn_per_electron"], truth["read_noise_dn"], {BAND: scale})
    polarimeter = virtual_polarimeter(rig, BAND)
    patch = Patch(request.param, SUBJECTS[request.param])
    results = []
    for seed in range(REPEATS):
        photographs: Any = Photographs(VirtualRig({**rig, "seed": seed}, patch))
        image = reconstruct(photographs, BAND, polarimeter, radiometry, WHOLE)
        assert not image.missing.any()
        results.append((image.mueller.reshape(16, -1).T, image.variance.reshape(16, -1).T))
    mueller, variance = (np.array(values, np.float64) for values in zip(*results, strict=True))
    solution = data_reduction(polarimeter, STATES, "test")
    saturation = photographs.header.saturation - rig["camera"]["offset_dn"] * (1 << rig["camera"]["shift"])
    return Repeated(
        mueller,
        variance,
        patch.mueller_image(90.0, BAND).reshape(-1, 16) * scale,
        NoiseModel(
            solution,
            np.array(SECONDS),
            saturation,
            radiometry.dn_per_electron,
            radiometry.read_noise_dn,
            DARKS,
        ),
        image.summary["weighted_share"],
    )


def test_repeated_photographs_scatter_as_predicted(repeated: Repeated) -> None:
    """Standard deviations over 200 repetitions of 1024 pixels, for each of the sixteen elements."""
    assert 0.1 < repeated.weighted_share < 0.9
    empirical = repeated.mueller.var(axis=0, ddof=1)
    ratio = np.sqrt((empirical / repeated.variance.mean(axis=0)).mean(axis=0))
    np.testing.assert_allclose(ratio, 1.0, atol=0.03)


def test_deviations_from_the_truth_are_standard(repeated: Repeated) -> None:
    z = (repeated.mueller - repeated.truth) / np.sqrt(repeated.variance)
    np.testing.assert_allclose(z.std(axis=(0, 1)), 1.0, atol=0.03)
    # the mean over pixels of very different brightness: no bias of a twentieth of the noise
    assert np.abs(z.mean(axis=(0, 1))).max() < 0.05


def test_turned_matrices_scatter_as_predicted(repeated: Repeated) -> None:
    """And not as uncorrelated elements would."""
    turn = np.kron(rotator(np.deg2rad(35.0)), rotator(np.deg2rad(-20.0)))
    empirical = (repeated.mueller @ turn.T).var(axis=0, ddof=1)
    # where the noise decides which exposures saturate, single pixels are neither one case nor the other
    own = repeated.variance.mean(axis=0)
    angles = (np.full(len(own), np.deg2rad(degrees)) for degrees in (-20.0, 35.0))
    predicted = repeated.model.turned_variance(repeated.truth, own, *angles)
    ratio = np.sqrt((empirical / predicted).mean(axis=0))
    np.testing.assert_allclose(ratio, 1.0, atol=0.03)
    uncorrelated = own @ (turn**2).T
    assert np.abs(np.sqrt(predicted / uncorrelated) - 1).max() > 0.1


def test_turned_variances_equal_the_twin(repeated: Repeated) -> None:
    """Up to the rounding that the condition of Wᵀ Σ⁻¹ W, some hundreds, makes of it."""
    random = np.random.default_rng(1)
    angles = random.uniform(-np.pi, np.pi, (2, len(repeated.truth)))
    arguments = repeated.truth, repeated.variance[0], *angles
    expected = turned_variance(repeated.model, *arguments)
    np.testing.assert_allclose(repeated.model.turned_variance(*arguments), expected, rtol=1e-10)
    without_darks = replace(repeated.model, darks=0)
    expected = turned_variance(without_darks, *arguments)
    np.testing.assert_allclose(without_darks.turned_variance(*arguments), expected, rtol=1e-10)


def test_the_model_tells_the_stored_variances(repeated: Repeated) -> None:
    modelled = np.einsum("pkk->pk", covariance(repeated.model, repeated.truth))
    ratio = np.sqrt(repeated.variance.mean(axis=0) / modelled)
    assert np.median(np.abs(ratio - 1)) < 0.01
