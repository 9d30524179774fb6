"""Partners as further measurements: less noise, no bias, one matrix at the pole; and their disagreement."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.formats.table_data import Origin
from pbrdf.models import MODELS
from pbrdf.optics.frames import change_frames
from pbrdf.optics.rusinkiewicz import cosines, directions
from pbrdf.tabulation.axes import Axes, table_axes
from pbrdf.tabulation.band import Band, possible_nodes
from pbrdf.tabulation.consistency import (
    Disagreements,
    disagreement,
    none_compared,
    read_consistency,
    write_consistency,
)
from pbrdf.tabulation.symmetry import copy_symmetric, is_circle, pool_symmetric, require_circle

AXES = table_axes(12, 12, 73)
PLASTIC = {"alpha": 0.3, "eta": 1.5, "specular": 0.8, "albedo": 0.5}
POSSIBLE = possible_nodes(AXES)
ELECTRONS = 400.0
"""Of a pixel at normal incidence, where M00 is 1."""


def truth() -> NDArray[np.float64]:
    grid = np.meshgrid(AXES.theta_h, np.maximum(AXES.theta_d, 1e-6), AXES.phi_d, indexing="ij")
    mueller = MODELS["baek2018"].evaluate(*directions(*grid), PLASTIC)
    mueller[~POSSIBLE] = np.nan
    return mueller


TRUTH = truth()


def photographed(seed: int = 1, *, shear: float = 0.0) -> Band:
    """A band with the noise of photons, whose variances are estimated from what was measured.

    `shear` turns the frames of the reflected beam by that many radians, as a misplaced camera does.
    """
    random = np.random.default_rng(seed)
    cos_light, _ = cosines(AXES.theta_h[:, None, None], AXES.theta_d[:, None], AXES.phi_d)
    count = random.integers(1, 30, AXES.shape).astype(np.uint16)
    scale = 1.0 / (ELECTRONS * count * np.maximum(cos_light, 0.05))
    noise = random.normal(size=TRUTH.shape) * np.sqrt(scale[..., None, None] * TRUTH[..., :1, :1])
    mueller = change_frames(TRUTH, 0.0, shear) + noise
    estimated = scale[..., None, None] * np.maximum(mueller[..., :1, :1], 1e-3)
    variance = np.broadcast_to(estimated, TRUTH.shape).copy()
    origin = np.where(POSSIBLE, Origin.MEASURED, Origin.NEVER_VISIBLE).astype(np.uint8)
    arrays = (mueller.astype(np.float32), variance.astype(np.float32), count, origin)
    for array in arrays:
        array[:, :, -1] = array[:, :, 0]
        array[0] = array[0, :, :1]
    return Band(AXES, *arrays)


def standardised(band: Band) -> NDArray[np.float64]:
    deviation: NDArray[np.float64] = (band.mueller - TRUTH) / np.sqrt(band.variance)
    return deviation


def test_four_measurements_halve_the_noise_and_the_variance_says_so() -> None:
    band = photographed()
    before = band.mueller.copy()
    pool_symmetric(band)
    inside = POSSIBLE.copy()
    inside[0] = False
    noise, pooled = (np.abs(m - TRUTH)[inside].mean() for m in (before, band.mueller))
    assert 0.3 < pooled / noise < 0.5
    inside[:, :, [0, 18, 36, 54, 72]] = False  # which are partners of themselves
    assert standardised(band)[inside].std() == pytest.approx(1.0, abs=0.02)


def test_weights_that_know_nothing_of_the_noise_make_no_bias() -> None:
    """Inverse variances, which are small where light happened to be dim, darken the mean; pixels do not."""
    band = photographed()
    measured, estimated = band.mueller[..., 0, 0].astype(float), band.variance[..., 0, 0].astype(float)
    pool_symmetric(band)
    inside = POSSIBLE.copy()
    inside[0] = inside[..., -1] = False
    true = TRUTH[..., 0, 0]
    by_pixels = np.mean((band.mueller[..., 0, 0] / true)[inside]) - 1
    mirrored = (measured / estimated + (measured / estimated)[..., ::-1]) / (
        1 / estimated + 1 / estimated[..., ::-1]
    )
    by_variance = np.mean((mirrored / true)[inside]) - 1
    error = np.std((band.mueller[..., 0, 0] / true)[inside]) / np.sqrt(inside.sum() / 4)
    assert abs(by_pixels) < 3 * error
    assert by_variance < -3 * error


def test_pooled_tables_have_both_symmetries() -> None:
    band = photographed()
    pool_symmetric(band)
    q, p = np.diag([1, 1, -1, -1]), np.diag([1, 1, -1, 1])
    np.testing.assert_allclose(band.mueller, q @ band.mueller[:, :, ::-1] @ q, rtol=1e-6, atol=1e-9)
    opposite = (np.arange(73) + 36) % 72
    exchanged = p @ np.swapaxes(band.mueller[:, :, opposite], -1, -2) @ p
    np.testing.assert_allclose(band.mueller, exchanged, rtol=1e-6, atol=1e-9)
    assert (band.origin[POSSIBLE] == Origin.MEASURED).all()


@pytest.mark.parametrize("make", [pool_symmetric, copy_symmetric])
def test_the_pole_is_one_measurement(make: object) -> None:
    """All azimuths of θh = 0 are one photograph of one point: neither noise nor pixels change."""
    band = photographed()
    band.origin[0, 3, 5:9] = Origin.UNSEEN
    variance, count = band.variance[0, 3, 0].copy(), band.count[0, 3, 0]
    assert callable(make)
    make(band)
    np.testing.assert_array_equal(band.mueller[0, 3], np.broadcast_to(band.mueller[0, 3, 0], (73, 4, 4)))
    assert (band.origin[0, 3] == Origin.MEASURED).all()
    assert (band.count[0, 3] == count).all()
    np.testing.assert_allclose(np.diagonal(band.variance[0, 3, 0]), np.diagonal(variance), rtol=1e-6)
    assert (band.variance[0, 3, 0] >= 0.49 * variance).all()


def test_a_measurement_at_one_end_of_the_circle_is_one_at_both() -> None:
    band = photographed()
    band.origin[:, :, 0][POSSIBLE[:, :, 0]] = Origin.UNSEEN
    band.mueller[:, :, 0] = np.nan
    copy_symmetric(band)
    np.testing.assert_array_equal(band.mueller[:, :, 0], band.mueller[:, :, -1])
    assert (band.origin[:, :, 0][POSSIBLE[:, :, 0]] == Origin.MEASURED).all()


def test_disagreement_of_noise_is_its_standard_error(tmp_path: Path) -> None:
    found = Disagreements(AXES.theta_h, AXES.theta_d)
    for nm in (450, 550.5):
        found.add(nm, disagreement(photographed()))
    write_consistency(tmp_path / "c.json", found, pooled=True)
    told = read_consistency(tmp_path / "c.json")
    assert told["pooled"] is True
    for kind in ("mirror", "exchange"):
        for band in told[kind]["by_band_nm"].values():
            np.testing.assert_allclose(band["standard_errors"], 1.0, atol=0.1)
        along = told[kind]["along_theta_d"]
        assert len(along["pairs"]) == len(told["theta_d_deg"]) == 12
        assert np.sum(along["pairs"]) == 2 * told[kind]["by_band_nm"]["450"]["pairs"]
        # nothing is visible at θd = 90°
        assert along["relative"][-1] == [None] * 16
        nodes = np.array(told[kind]["by_node"]["standard_errors"], dtype=float)
        assert nodes.shape == AXES.shape[:2]
        # nothing is compared at θh = 0, whose azimuths are one measurement
        assert np.isnan(nodes[0]).all()
        assert np.nanmedian(nodes) == pytest.approx(1.0, abs=0.1)
    assert list(told["mirror"]["by_band_nm"]) == ["450", "550.5"]


def test_disagreement_shows_a_turned_frame() -> None:
    """Half a degree, in M10 and M20 of what a mirror image should make equal."""
    straight, turned = (
        disagreement(photographed(shear=shear)).sum(axis=(0, 1))[0] for shear in (0.0, np.deg2rad(5))
    )

    def errors(sums: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.sqrt(sums[34:] / sums[18:34])

    assert errors(straight).max() < 1.1
    assert errors(turned)[8] > 1.3  # M20 = −sin 2ε M10


def test_documents_of_another_kind_are_refused(tmp_path: Path) -> None:
    (tmp_path / "c.json").write_text(json.dumps({"schema": "pbrdf/consistency/2", "mirror": {}}))
    with pytest.raises(InputError, match=r"mirror.along_theta_d.pairs"):
        read_consistency(tmp_path / "c.json")


def test_nothing_compared_is_nothing_told(tmp_path: Path) -> None:
    found = Disagreements(AXES.theta_h, AXES.theta_d)
    found.add(550.0, none_compared(*AXES.shape[:2]))
    write_consistency(tmp_path / "c.json", found, pooled=False)
    told = read_consistency(tmp_path / "c.json")
    assert told["exchange"]["by_band_nm"]["550"]["relative"] == [None] * 16


@pytest.mark.parametrize(
    "azimuths", [np.linspace(-np.pi, np.pi - 0.1, 36), np.linspace(-3, 3, 36), np.array([0.0])]
)
def test_azimuths_that_do_not_close_are_told(azimuths: NDArray[np.float64]) -> None:
    axes = Axes(AXES.theta_h, AXES.theta_d, azimuths)
    assert not is_circle(axes)
    with pytest.raises(InputError, match="phi_d"):
        require_circle(axes, "jade")
    assert is_circle(AXES)
